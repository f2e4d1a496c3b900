"""The command `stiction`: which verbs there are, and what becomes of their results and errors.

Exit codes: 0 nothing found, 1 findings, 2 usage, 3 data problem; 70 a fault of this program, 130 interrupted, 141
nobody reads on, 143 asked to end.
"""

import errno
import logging
import os
import re
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from stiction import __version__
from stiction.errors import ParameterError, StictionError

if TYPE_CHECKING:
    from cyclopts import App, CycloptsError, Token

__all__ = ["main"]

VERBS = {
    "demo": ("stiction.apps.demo:demo", "", "Diagnose a simulated plant and set each verdict beside the truth."),
    "diagnose": (
        "stiction.apps.diagnose:diagnose",
        "SOURCE...",
        "Say of each loop whether its valve sticks.",
    ),
    "serve": ("stiction.apps.serve:serve", "[AUDIT|SOURCE...]", "Open a local web page for files and audits."),
    "audit": (
        "stiction.apps.audit:audit",
        "SOURCE... --out FOLDER",
        "Diagnose all loops of a plant, rank and group them.",
    ),
    "read": ("stiction.apps.read:read", "SOURCE...", "Say what a source holds, convert it, write its map."),
    "compensate": (
        "stiction.apps.compensate:compensate",
        "[SOURCE]",
        "Say what to do about a sticky valve until it is repaired.",
    ),
    "simulate": ("stiction.apps.simulate:simulate", "", "Simulate a control loop with a sticky valve."),
    "stroke": ("stiction.apps.stroke:stroke", "", "Drive a valve over a test signal."),
    "valve-test plan": ("stiction.apps.valve_test:plan", "ramp|step", "Plan a ramp or step test of a valve."),
    "valve-test analyse": ("stiction.apps.valve_test:analyse", "ramp|step SOURCE", "Read the record of such a test."),
    "limit-cycles": (
        "stiction.apps.limit_cycles:limit_cycles",
        "",
        "List the limit cycles of a sticky loop.",
    ),
    "paper": ("stiction.apps.paper:paper", "", "Walk through the paper, printed beside corrected."),
    "benchmark": ("stiction.apps.benchmark:benchmark", "[FOLDER]", "Count verdicts against the labels of a folder."),
    "doctor": ("stiction.apps.doctor:doctor", "", "Say what is installed and what is missing."),
}
"""Verb -> (its function, what it is given besides options, what it does); its page is imported when it is asked for."""

GROUPS = {"valve-test": "Plan a ramp or step test of a valve, or read its record."}
"""First word of verbs of two words -> what they do."""

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Why the system takes no more of the output, where that is nobody's fault."""

HELP = "From friction physics to a verdict on a recorded control loop: does the valve stick, and how badly?"
EPILOGUE = "Exit codes: 0 nothing found, 1 findings, 2 wrong usage, 3 a problem with data or files."
FIRST = "Begin with `stiction demo`, then `stiction diagnose FILE.csv`. Each command tells more with --help."


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Parameters
    ----------
    argv : sequence of str, optional
        What was typed after ``stiction``; by default the arguments of this process.

    Returns
    -------
    int
        The exit code.

    Examples
    --------
    >>> main(["--version"])
    0.1.0
    0
    """
    try:
        with _ended_in_order():
            return _run(list(sys.argv[1:] if argv is None else argv))
    except _Asked as asked:
        return 128 + asked.args[0]
    except KeyboardInterrupt:
        return 130


class _Asked(KeyboardInterrupt):
    """The system asks the program to end, by the signal of that number."""


@contextmanager
def _ended_in_order() -> Iterator[None]:
    """Let SIGTERM and SIGHUP end the work as Ctrl-C does, so that no half-written file is left behind."""

    def end(number: int, _: object) -> None:
        raise _Asked(number)

    ours = {}
    if threading.current_thread() is threading.main_thread():
        known = (getattr(signal, name, None) for name in ("SIGTERM", "SIGHUP"))
        ours = {one: signal.signal(one, end) for one in known if one and signal.getsignal(one) is signal.SIG_DFL}
    try:
        yield
    finally:
        for one, before in ours.items():
            signal.signal(one, before)


def _run(tokens: list[str]) -> int:
    """Run one command and tell its errors; all that takes time to import is imported in here."""
    from cyclopts import CycloptsError

    _listen()
    try:
        code = _app(tokens)(tokens, exit_on_error=False, print_error=False, result_action="return_value")
        sys.stdout.flush()
    except CycloptsError as error:
        return _complain(f"{_told(error)} Try: {_help_for(tokens)}", 2)
    except ParameterError as error:
        return _complain(str(error), 2)
    except StictionError as error:
        return _complain(str(error), 3)
    except BrokenPipeError:
        _drop_output()
        return 141
    except SystemExit as left:
        # So Rich ends a program whose help or version nobody reads on.
        if not isinstance(left.__context__, BrokenPipeError):
            raise
        return 141
    except OSError as error:
        if error.errno not in FULL:
            return _fault(error)
        _drop_output()
        return _complain(f"the output cannot be written: {error.strerror}; free some space or write elsewhere.", 3)
    except MemoryError:
        return _complain(
            "there is not enough memory for this; give a shorter duration, larger steps or a shorter file.", 2
        )
    except Exception as error:
        return _fault(error)
    return code if isinstance(code, int) else 0


def _drop_output() -> None:
    """Let what is not written yet go nowhere, or Python would try once more when it ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _fault(error: Exception) -> int:
    import traceback

    traceback.print_exception(error)
    return _complain(f"this is a fault of the program, not yours ({type(error).__name__}); please report it.", 70)


def _listen() -> None:
    """Show on a terminal what the package tells its logger: that kernels are compiled, so that waiting has a reason."""
    logger = logging.getLogger("stiction")
    if sys.stderr.isatty() and not logger.handlers:
        handler = logging.StreamHandler()
        handler.setFormatter(logging.Formatter("stiction: %(message)s"))
        logger.addHandler(handler)
        logger.setLevel(logging.INFO)


def _app(tokens: list[str]) -> "App":
    """The app; the verb that is asked for tells itself by its docstring, the others by a line."""
    from cyclopts import App, Parameter

    app = App(
        name="stiction",
        help=f"{HELP}\n\n{FIRST}",
        help_epilogue=EPILOGUE,
        version=__version__,
        version_flags=["--version"],
        default_parameter=Parameter(show_default=False, negative_iterable=(), converter=_converted),
        suppress_keyboard_interrupt=False,
    )
    groups = {name: App(name=name, help=does) for name, does in GROUPS.items()}
    for group in groups.values():
        app.command(group)
    for verb, (place, given, does) in VERBS.items():
        *group, name = verb.split()
        usage = " ".join(filter(None, ("Usage: stiction", verb, given, "[OPTIONS]")))
        asked = tokens[: len(group) + 1] == [*group, name]
        (groups[group[0]] if group else app).command(place, name=name, usage=usage, help=None if asked else does)
    return app


def _converted(kind: Any, tokens: "Sequence[Token]") -> Any:
    """What was typed as the kind asked for; a fraction is no whole number, and is not rounded to one."""
    if kind is int and not re.fullmatch(r"[+-]?\d+", tokens[0].value.strip()):
        raise ParameterError(f"{tokens[0].value} is not a whole number; give one such as 3.")
    from cyclopts import convert

    return convert(kind, tokens)


def _complain(sentence: str, code: int) -> int:
    print(f"stiction: {sentence}", file=sys.stderr)
    return code


def _told(error: "CycloptsError") -> str:
    """The message of an error in what was typed, on one line."""
    return " ".join(str(error).split())


def _help_for(tokens: list[str]) -> str:
    known = [verb for verb in (*VERBS, *GROUPS) if tokens[: verb.count(" ") + 1] == verb.split()]
    return " ".join(["stiction", *known[:1], "--help"])


if __name__ == "__main__":
    sys.exit(main())
