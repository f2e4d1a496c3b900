"""``stiction compensate``: what to do about a sticky valve until it is repaired."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from stiction.apps.failure import traceback_of
from stiction.apps.options import Json, Report, Text, refuse_options
from stiction.apps.reading_options import SOURCES, ReadingOptions
from stiction.errors import ParameterError, RecordError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stiction.apps.advise import Advice
    from stiction.apps.failure import Failure
    from stiction.models import Loop

__all__ = ["compensate", "parse_weights"]

FILE = f"{SOURCES} Without it the loop is given."


def compensate(
    *files: Annotated[str, Parameter(name="SOURCE", help=FILE, allow_leading_hyphen=True)],
    controller: Text = None,
    weights: str | None = None,
    seeds: int = 20,
    duration: float | None = None,
    process: Text = None,
    valve: Text = None,
    noise: float | None = None,
    loop: str | None = None,
    report: Report = None,
    structured_text: str | None = None,
    work_order: str | None = None,
    as_json: Json = False,
    reading: ReadingOptions = ReadingOptions(),  # noqa: B008 (frozen)
) -> int:
    """Try every remedy of a sticky loop on its twin: what each gives and costs, and which to take until the shutdown.

    The loop is diagnosed from its record, or given by --process, --valve and --controller ("what if"). Where no
    advice can be given the reason is said. Exit code 1 when there is advice for a loop, 0 when there is none, 3 when
    the file could not be used.

    Parameters
    ----------
    controller
        pi:Kc=0.2,Ti=10, pid:Kc=..,Ti=..,Td=.., p:Kc=.. or parallel:Kp=..,Ki=..,Kd=.. : the controller, instead of the
        one found from the record; op_limits=0..100 adds limits.
    weights
        NAME=VALUE,...: weights of the cost: pv_std (1), iae (0.5), offset (0.25), travel (0.05), reversals (0.05),
        op_travel (0.02), sp_step (0.25), load_step (0.25), errors (0.5); those left out keep these.
    seeds
        Runs of each remedy, each with its own noise and load (20).
    duration
        Seconds of the undisturbed part of each run; by default 14 periods of the cycle.
    process
        Without FILE: "3 exp(-10s)/(10s+1)" (the default), fopdt:K=3,tau=10,dead_time=10, and so on as for simulate.
    valve
        Without FILE: kano:S=3,J=1 (the default) or another sticky valve, as for simulate; % of span.
    noise
        Without FILE: standard deviation of the measurement noise in PV units (0).
    loop
        Without FILE: TOML file with these settings, as for simulate; options come before it.
    structured_text
        File to write the recommended compensator to, as a function block of IEC 61131-3.
    work_order
        File to write the page for the valve shop to, in Markdown; it needs a FILE.
    as_json
        Print a list with one object per loop, and nothing else, on the output; it holds no series over time.
    """
    refuse_options(files, compensate)
    given = {"process": process, "valve": valve, "noise": noise, "loop": loop}
    options = reading.arguments()
    idle = [name for name, value in vars(reading).items() if value not in (None, ()) and name not in ("tag", "dt")]
    _one_source(files, given, idle, controller, work_order)
    from stiction.apps.model_text import controller as controller_of
    from stiction.compensation.cost import checked
    from stiction.errors import require_count, require_positive

    settings: dict[str, Any] = {
        "weights": checked(parse_weights(weights)),
        "seeds": require_count("seeds", seeds),
        "duration": None if duration is None else require_positive("duration", duration, "s"),
    }
    targets = _targets(files, report, structured_text, work_order)
    from stiction.apps.advise import advise_file, advise_loop

    failures: Sequence[Failure] = ()
    if files:
        single = [option for option in ("--structured-text", "--work-order") if option in targets]
        pid = None if controller is None else controller_of(controller)
        advices, failures = advise_file(files[0], options, pid, settings, single, as_json=as_json)
    else:
        given |= {"controller": controller, "dt": reading.dt, "tag": reading.tag}
        advices = [advise_loop(*_given_loop(given), settings)]
    return _out(advices, failures, targets, as_json=as_json)


def parse_weights(text: str | None) -> dict[str, float]:
    """Read ``NAME=VALUE,...``.

    Examples
    --------
    >>> parse_weights("travel=0.5, errors=0")
    {'travel': 0.5, 'errors': 0.0}
    """
    weights: dict[str, float] = {}
    for part in filter(None, (piece.strip() for piece in (text or "").split(","))):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        try:
            if not (name and equals) or name in weights:
                raise ValueError
            weights[name] = float(value)
        except ValueError:
            raise ParameterError(
                f'--weights "{text}": "{part}" is not one NAME=VALUE; write for example --weights travel=0.5,errors=1.'
            ) from None
    return weights


def _one_source(
    files: tuple[str, ...], given: "Mapping[str, Any]", idle: "Sequence[str]", controller: str | None,
    work_order: str | None,
) -> None:  # fmt: skip
    """A record or a loop, not both and not neither."""
    said = [f"--{name}" for name, value in given.items() if value is not None]
    if len(files) > 1:
        raise ParameterError(f"{len(files)} files were named; compensate takes one at a time.")
    if files and said:
        raise ParameterError(f"{said[0]} describes a loop without a record; leave it or {files[0]} out.")
    if not files and not said and controller is None:
        raise ParameterError(
            "no file was named and no loop given; name a CSV file, or give --process, --valve and --controller."
        )
    if not files and idle:
        option = f"--{idle[0].replace('_', '-')}"
        raise ParameterError(f"{option} says how to read a file, and none was named; name one or leave it out.")
    if not files and work_order is not None:
        raise ParameterError("--work-order needs a record: its findings are the diagnosis. Name a CSV file.")


def _targets(
    files: tuple[str, ...], report: str | None, structured_text: str | None, work_order: str | None
) -> dict[str, Path]:
    """The files to write, looked at before the work."""
    from stiction.apps.files import check_report, check_target, check_text

    asked = {"--report": report, "--structured-text": structured_text, "--work-order": work_order}
    targets: dict[str, Path] = {}
    for option, name in asked.items():
        if name is None:
            continue
        target = check_target(name)
        others = {Path(file).resolve(): f"the record {file}" for file in files}
        others |= {path.resolve(): other for other, path in targets.items()}
        if target.resolve() in others:
            raise ParameterError(f"{option} {name} would replace {others[target.resolve()]}; name another file.")
        targets[option] = check_report(name) if option == "--report" else check_text(name, option)
    return targets


def _given_loop(typed: dict[str, Any]) -> "tuple[Loop, str]":
    """The loop from options and TOML, and its name."""
    from stiction.apps.loop_text import make_loop, settings_of
    from stiction.apps.simulate import DEFAULTS

    settings = settings_of(typed.pop("loop"), typed, {**DEFAULTS, "tag": "loop"})
    if settings["compensator"] not in (None, "none"):
        raise ParameterError("the loop holds a compensator already; take it out of the file to try all of them.")
    return make_loop(settings), str(settings["tag"])


def _out(
    advices: "Sequence[Advice]", failures: "Sequence[Failure]", targets: "Mapping[str, Path]", *, as_json: bool
) -> int:  # fmt: skip
    """Tell, write, and return the exit code."""
    from stiction.apps import remedy_output as told
    from stiction.apps.files import write_text
    from stiction.apps.output import note, print_json, say

    lines, written = [], {}
    for key in ("structured_text", "work_order") if advices else ():
        target, text = targets.get(f"--{key.replace('_', '-')}"), getattr(advices[0], key)
        if target is None:
            continue
        if text is None:
            lines.append(told.not_written_text(key, target, advices[0]))
        else:
            write_text(text, target)
            written[key] = str(target)
            lines.append(f"{key.replace('_', ' ').capitalize()}: {target}")
    if "--report" in targets and advices:
        from stiction.apps.compensate_page import write_compensate_page

        write_compensate_page(advices, targets["--report"])
        lines.append(f"Report: {targets['--report']}")
    if as_json:
        failed = [told.failed_advice_dict(failure) for failure in failures]
        print_json([*(told.advice_dict(advice, written) for advice in advices), *failed])
    else:
        told.print_advice(advices, failures)
    faults = [failure.fault for failure in failures if failure.fault is not None]
    if not advices:
        if faults:
            raise faults[0]
        reason = failures[0].reason if len(failures) == 1 else "no loop could be used; see the reasons above."
        raise RecordError(reason)
    for error in faults:
        note(traceback_of(error))
    for line in lines:
        (note if as_json else say)(line)
    return int(any(not advice.trial.refused for advice in advices))
