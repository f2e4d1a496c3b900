"""The command `stiction`: its commands, and the exit codes for their results and errors.

Exit codes: 0 nothing found, 1 findings, 2 wrong usage, 3 a problem with data; 70 an error in this program, 130
interrupted, 141 the output was closed, 143 terminated.
"""

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
from stiction.scratch import leave_run, remove_abandoned

if TYPE_CHECKING:
    from cyclopts import App, CycloptsError, Token

__all__ = ["main"]

VERBS = {
    "demo": ("stiction.apps.demo:demo", "", "Diagnose a simulated plant and compare each verdict with the truth."),
    "diagnose": (
        "stiction.apps.diagnose:diagnose",
        "SOURCE...",
        "Find out for each loop whether its valve sticks.",
    ),
    "serve": ("stiction.apps.serve:serve", "[AUDIT|SOURCE...]", "Open a local web page for files and audits."),
    "audit": (
        "stiction.apps.audit:audit",
        "SOURCE... --out FOLDER",
        "Diagnose all loops of a plant, rank and group them.",
    ),
    "watch": ("stiction.apps.watch:watch", "PLANT.toml", "Watch a plant from its historians, and raise alarms."),
    "worklist": ("stiction.apps.worklist:worklist", "AUDIT", "List what to repair, retune and test after an audit."),
    "read": ("stiction.apps.read:read", "SOURCE...", "Show what a source contains, convert it, write its map."),
    "compensate": (
        "stiction.apps.compensate:compensate",
        "[SOURCE]",
        "Choose what to do about a sticky valve until its repair.",
    ),
    "simulate": ("stiction.apps.simulate:simulate", "", "Simulate a control loop with a sticky valve."),
    "stroke": ("stiction.apps.stroke:stroke", "", "Simulate the stem of a valve for a test signal."),
    "valve-test plan": ("stiction.apps.valve_test:plan", "ramp|step", "Plan a ramp or step test of a valve."),
    "valve-test analyse": (
        "stiction.apps.valve_test:analyse",
        "ramp|step SOURCE",
        "Analyse the record of such a test.",
    ),
    "limit-cycles": (
        "stiction.apps.limit_cycles:limit_cycles",
        "",
        "List the limit cycles of a sticky loop.",
    ),
    "export": (
        "stiction.apps.export:export",
        "MODEL",
        "Write a valve or a compensator as FMU, C, Modelica or MATLAB.",
    ),
    "paper": ("stiction.apps.paper:paper", "", "Show the paper's tables and figures, as printed and corrected."),
    "benchmark": ("stiction.apps.benchmark:benchmark", "[FOLDER]", "Compare verdicts with the labels of a folder."),
    "doctor": ("stiction.apps.doctor:doctor", "", "Show what is installed and what is missing."),
}
"""Command -> (its function, its arguments, what it does); its file is imported when the command is run."""

GROUPS = {"valve-test": "Plan a ramp or step test of a valve, or analyse its record."}
"""First word of the commands with two words -> what they do."""

HELP = "From friction physics to a verdict on a recorded control loop: does the valve stick, and how badly?"
EPILOGUE = "Exit codes: 0 nothing found, 1 findings, 2 wrong usage, 3 a problem with data or files."
GETTING_STARTED = (
    "Begin with `stiction demo`, then `stiction diagnose FILE.csv`. Add --help to a command for its options."
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments after ``stiction``; by default the arguments of this process.

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
    if argv is None:
        leave_run()
    try:
        with _termination_signals():
            return _run(list(sys.argv[1:] if argv is None else argv))
    except _TerminationRequested as asked:
        return 128 + asked.args[0]
    except KeyboardInterrupt:
        return 130


class _TerminationRequested(KeyboardInterrupt):
    """A signal with this number asks the program to end."""


@contextmanager
def _termination_signals() -> Iterator[None]:
    """Make SIGTERM and SIGHUP end the work like Ctrl-C, so that no incomplete file remains."""

    def end(number: int, _: object) -> None:
        raise _TerminationRequested(number)

    ours = {}
    if threading.current_thread() is threading.main_thread():
        known = (getattr(signal, name, None) for name in ("SIGTERM", "SIGHUP"))
        ours = {
            number: signal.signal(number, end)
            for number in known
            if number and signal.getsignal(number) is signal.SIG_DFL
        }
    try:
        yield
    finally:
        for number, before in ours.items():
            signal.signal(number, before)


def _run(tokens: list[str]) -> int:
    """Run one command and print its errors."""
    from cyclopts import CycloptsError

    _attach_logger()
    remove_abandoned()
    try:
        code = _app(tokens)(tokens, exit_on_error=False, print_error=False, result_action="return_value")
        sys.stdout.flush()
    except CycloptsError as error:
        return _exit_with(f"{_usage_message(error)} Try: {_help_for(tokens)}", 2)
    except StictionError as error:
        from stiction.apps.options import option_text

        return _exit_with(error.text(option_text), 2 if isinstance(error, ParameterError) else 3)
    except BrokenPipeError:
        _drop_output()
        return 141
    except SystemExit as left:
        # Rich ends the program this way when the output of --help or --version is closed.
        if not isinstance(left.__context__, BrokenPipeError):
            raise
        return 141
    except BaseException as error:  # a panic of a library in Rust is no Exception
        return _exit_for_any(error)
    return code if isinstance(code, int) else 0


def _exit_for_any(error: BaseException) -> int:
    """Report what the data or the machine caused as a problem with data, and anything else as a fault."""
    from stiction.apps.options import option_text
    from stiction.foreign_errors import DISK_FULL_ERRNOS, data_error

    if isinstance(error, OSError) and error.errno in DISK_FULL_ERRNOS:
        _drop_output()
        return _exit_with(f"the disk is full ({error.strerror}); free some space or write elsewhere.", 3)
    if (known := data_error(error)) is not None:
        return _exit_with(known.text(option_text), 3)
    if not isinstance(error, Exception):
        raise error
    return _report_fault(error)


def _drop_output() -> None:
    """Discard unwritten output; otherwise Python would try to write it again at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _report_fault(error: Exception) -> int:
    import traceback

    traceback.print_exception(error)
    return _exit_with(
        f"this is an error in the program ({type(error).__name__}); please report it with the lines above.", 70
    )


class _VisibleFormatter(logging.Formatter):
    """Shows control characters of tags as their codes."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line of a message."""
        from stiction.display.visible_text import visible

        return visible(super().format(record))


def _attach_logger() -> None:
    """Show log messages on a terminal, such as the one that kernels are being compiled."""
    logger = logging.getLogger("stiction")
    if sys.stderr.isatty() and not logger.handlers:
        handler = logging.StreamHandler()
        handler.setFormatter(_VisibleFormatter("stiction: %(message)s"))
        logger.addHandler(handler)
        logger.setLevel(logging.INFO)


def _app(tokens: list[str]) -> "App":
    """Return the app: the requested command with its full help, the others with one line."""
    from cyclopts import App, Parameter

    app = App(
        name="stiction",
        help=f"{HELP}\n\n{GETTING_STARTED}",
        help_epilogue=EPILOGUE,
        version=__version__,
        version_flags=["--version"],
        default_parameter=Parameter(show_default=False, negative_iterable=(), converter=_convert),
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


def _convert(kind: Any, tokens: "Sequence[Token]") -> Any:
    """Convert an argument to its type; a fraction is not accepted as a whole number."""
    if kind is int and not re.fullmatch(r"[+-]?\d+", tokens[0].value.strip()):
        raise ParameterError(f"{tokens[0].value} is not a whole number; give a number such as 3.")
    from cyclopts import convert

    return convert(kind, tokens)


def _exit_with(sentence: str, code: int) -> int:
    from stiction.display.visible_text import visible

    print(visible(f"stiction: {sentence}"), file=sys.stderr)
    return code


def _usage_message(error: "CycloptsError") -> str:
    """Return the message of a usage error on one line."""
    return " ".join(str(error).split())


def _help_for(tokens: list[str]) -> str:
    known = [verb for verb in (*VERBS, *GROUPS) if tokens[: verb.count(" ") + 1] == verb.split()]
    return " ".join(["stiction", *known[:1], "--help"])


if __name__ == "__main__":
    sys.exit(main())
