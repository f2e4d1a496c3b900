"""``stiction compensate``: choose what to do about a sticky valve until its repair."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from stiction.apps.failure import traceback_text
from stiction.apps.options import JsonOption, ReportOption, TextOption, reject_misplaced_options
from stiction.apps.reading_options import SOURCES, ReadingOptions
from stiction.errors import ParameterError, RecordError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stiction.apps.advise import Advice
    from stiction.apps.failure import Failure
    from stiction.models import Loop

__all__ = ["compensate", "parse_weights"]

FILE = f"{SOURCES} Without a source, give the loop with --process, --valve and --controller."


def compensate(
    *files: Annotated[str, Parameter(name="SOURCE", help=FILE, allow_leading_hyphen=True)],
    controller: TextOption = None,
    weights: str | None = None,
    seeds: int = 20,
    duration: float | None = None,
    max_travel: float = 3.0,
    process: TextOption = None,
    valve: TextOption = None,
    noise: float | None = None,
    loop: str | None = None,
    report: ReportOption = None,
    structured_text: str | None = None,
    work_order: str | None = None,
    as_json: JsonOption = False,
    reading: ReadingOptions = ReadingOptions(),  # noqa: B008 (frozen)
) -> int:
    """Try every remedy for a sticky valve on a simulated copy of the loop, and recommend one until the next shutdown.

    The loop is diagnosed from its record, or given by --process, --valve and --controller ("what if"). When no advice
    can be given, the reason is printed. Exit code 1 when there is advice for a loop, 0 when there is none, 3 when the
    file could not be used.

    Parameters
    ----------
    controller
        pi:Kc=0.2,Ti=10, pid:Kc=..,Ti=..,Td=.., p:Kc=.. or parallel:Kp=..,Ki=..,Kd=.. : the controller, if it is not to
        be identified from the record; op_limits=0..100 adds limits.
    weights
        NAME=VALUE,...: weights of the cost: pv_std (1), iae (0.5), offset (0.25), travel (0.05), reversals (0.05),
        op_travel (0.02), sp_step (0.25), load_step (0.25), errors (0.5); the defaults are in brackets.
    seeds
        Runs of each remedy; noise and load differ from run to run (20).
    duration
        Length in seconds of the part of each run before the steps; by default 14 periods of the cycle.
    max_travel
        Largest stem travel of a recommended remedy over the present one (3): more wears the valve.
    process
        Without FILE: "3 exp(-10s)/(10s+1)" (the default), fopdt:K=3,tau=10,dead_time=10, and so on as for simulate.
    valve
        Without FILE: kano:S=3,J=1 (the default) or another sticky valve, as for simulate; % of span.
    noise
        Without FILE: standard deviation of the measurement noise in PV units (0).
    loop
        Without FILE: TOML file with these settings, as for simulate; options override it.
    structured_text
        File to write the recommended compensator to, as a function block of IEC 61131-3.
    work_order
        File to write the work order for the valve shop to, in Markdown; it needs a FILE.
    as_json
        Print only a list with one JSON object per loop, without time series.
    """
    reject_misplaced_options(files, compensate)
    given = {"process": process, "valve": valve, "noise": noise, "loop": loop}
    options = reading.arguments()
    idle = [name for name, value in vars(reading).items() if value not in (None, ()) and name not in ("tag", "dt")]
    _require_one_source(files, given, idle, controller, work_order)
    from stiction.apps.parse_model import parse_controller
    from stiction.compensation.cost import check_weights
    from stiction.errors import require_count, require_positive

    settings: dict[str, Any] = {
        "weights": check_weights(parse_weights(weights)),
        "seeds": require_count("seeds", seeds),
        "duration": None if duration is None else require_positive("duration", duration, "s"),
        "max_travel": max_travel,
    }
    targets = _check_targets(files, report, structured_text, work_order)
    from stiction.apps.advise import advise_file, advise_loop

    failures: Sequence[Failure] = ()
    if files:
        single = [option for option in ("--structured-text", "--work-order") if option in targets]
        pid = None if controller is None else parse_controller(controller)
        advices, failures = advise_file(files[0], options, pid, settings, single, as_json=as_json)
    else:
        given |= {"controller": controller, "dt": reading.dt, "tag": reading.tag}
        advices = [advise_loop(*_loop_from_options(given), settings)]
    return _write_results(advices, failures, targets, as_json=as_json)


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
                f'--weights "{text}": "{part}" is not of the form NAME=VALUE; write for example --weights '
                "travel=0.5,errors=1."
            ) from None
    return weights


def _require_one_source(
    files: tuple[str, ...], given: "Mapping[str, Any]", idle: "Sequence[str]", controller: str | None,
    work_order: str | None,
) -> None:  # fmt: skip
    """Refuse a record together with a loop, and neither of them."""
    loop_options = [f"--{name}" for name, value in given.items() if value is not None]
    if len(files) > 1:
        raise ParameterError(f"compensate takes one file, but {len(files)} were given; give one.")
    if files and loop_options:
        raise ParameterError(
            f"{loop_options[0]} describes a loop without a record; leave out {files[0]} or the option."
        )
    if not files and not loop_options and controller is None:
        raise ParameterError("there is no file and no loop; give a file, or --process, --valve and --controller.")
    if not files and idle:
        option = f"--{idle[0].replace('_', '-')}"
        raise ParameterError(
            f"{option} is for reading a file, but no file is given; give a file or leave out the option."
        )
    if not files and work_order is not None:
        raise ParameterError("--work-order needs a record to diagnose; give a file.")


def _check_targets(
    files: tuple[str, ...], report: str | None, structured_text: str | None, work_order: str | None
) -> dict[str, Path]:
    """Check the files to write before the work."""
    from stiction.apps.output_files import check_report, check_target, check_text

    asked = {"--report": report, "--structured-text": structured_text, "--work-order": work_order}
    targets: dict[str, Path] = {}
    for option, name in asked.items():
        if name is None:
            continue
        target = check_target(name)
        others = {Path(file).resolve(): f"the record {file}" for file in files}
        others |= {path.resolve(): other for other, path in targets.items()}
        if target.resolve() in others:
            raise ParameterError(f"{option} {name} would replace {others[target.resolve()]}; give another name.")
        targets[option] = check_report(name) if option == "--report" else check_text(name, option)
    return targets


def _loop_from_options(typed: dict[str, Any]) -> "tuple[Loop, str]":
    """Return the loop from the options and the TOML file, and its name."""
    from stiction.apps.parse_loop import make_loop, merge_settings
    from stiction.apps.simulate import DEFAULTS

    settings = merge_settings(typed.pop("loop"), typed, {**DEFAULTS, "tag": "loop"})
    if settings["compensator"] not in (None, "none"):
        raise ParameterError(
            "the loop has a compensator already; remove it from the TOML file, because all compensators are tried."
        )
    return make_loop(settings), str(settings["tag"])


def _write_results(
    advices: "Sequence[Advice]", failures: "Sequence[Failure]", targets: "Mapping[str, Path]", *, as_json: bool
) -> int:  # fmt: skip
    """Print the advice, write the files, and return the exit code."""
    from stiction.apps import advice_output
    from stiction.apps.output import print_err, print_json, print_out
    from stiction.apps.output_files import write_text

    lines, written = [], {}
    for key in ("structured_text", "work_order") if advices else ():
        target, text = targets.get(f"--{key.replace('_', '-')}"), getattr(advices[0], key)
        if target is None:
            continue
        if text is None:
            lines.append(advice_output.not_written_text(key, target, advices[0]))
        else:
            write_text(text, target)
            written[key] = str(target)
            lines.append(f"{key.replace('_', ' ').capitalize()}: {target}")
    if "--report" in targets and advices:
        advice_output.write_advice_page(advices, targets["--report"])
        lines.append(f"Report: {targets['--report']}")
    if as_json:
        failed = [advice_output.failed_advice_dict(failure) for failure in failures]
        print_json([*(advice_output.advice_dict(advice, written) for advice in advices), *failed])
    else:
        advice_output.print_advice(advices, failures)
    faults = [failure.fault for failure in failures if failure.fault is not None]
    if not advices:
        if faults:
            raise faults[0]
        reason = failures[0].reason if len(failures) == 1 else "no loop could be used; see the reasons above."
        raise RecordError(reason)
    for error in faults:
        print_err(traceback_text(error))
    for line in lines:
        (print_err if as_json else print_out)(line)
    return int(any(not advice.trial.refused for advice in advices))
