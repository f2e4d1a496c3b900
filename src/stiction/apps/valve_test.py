"""``stiction valve-test``: plan a ramp or step test of a valve, and analyse its record."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from stiction.apps.options import JsonOption, OutOption, ReportOption, option_text, reject_misplaced_options
from stiction.apps.reading_options import ReadingOptions
from stiction.errors import ParameterError

__all__ = ["analyse", "plan"]

KindOption = Annotated[Literal["ramp", "step"], Parameter(help="ramp or step.")]
NumbersOption = Annotated[tuple[float, ...] | None, Parameter(consume_multiple=True)]


def plan(
    kind: KindOption,
    /,
    *,
    low: float | None = None,
    high: float | None = None,
    threshold: float | None = None,
    rates: NumbersOption = None,
    repeats: int | None = None,
    start: float | None = None,
    fine_step: float | None = None,
    fine_range: float | None = None,
    sizes: NumbersOption = None,
    wait: float | None = None,
    dt: float = 1.0,
    out: OutOption = None,
    as_json: JsonOption = False,
) -> int:
    """Plan a test: the OP over time, for manual operation or the control system, as CSV of time_s and OP.

    Parameters
    ----------
    low
        Ramp: lowest OP in % of span.
    high
        Ramp: highest OP in % of span.
    threshold
        Ramp: expected rate r in %/s below which the stem moves in steps; the rates are chosen near it.
    rates
        Ramp: rates to test in %/s instead of a threshold, one or more.
    repeats
        Ramp: number of tests at each rate (1).
    start
        OP before the test in % of span; required for a step test.
    fine_step
        Step: height of the steps of the staircase in % of span (0.1).
    fine_range
        Step: range of the staircase in each direction in % of span (2).
    sizes
        Step: steps for the response time in % of span (0.5 1 2 5).
    wait
        Waiting time in seconds between ramps (60), or after each step (30).
    dt
        Sampling period in seconds (1).
    out
        CSV file to write; without it the CSV goes to standard output.
    as_json
        Print the plan as JSON; the CSV is written only with --out.
    """
    from stiction import plan_ramp_test, plan_step_test
    from stiction.apps.output import print_err, print_json, print_out
    from stiction.apps.output_files import check_text, write_csv
    from stiction.records import LoopRecord

    ramp = {"low": low, "high": high, "threshold": threshold, "rates": rates, "repeats": repeats}
    step = {"fine_step": fine_step, "fine_range": fine_range, "sizes": sizes}
    _reject_other_kind(kind, ramp, step, ("start", "wait", "dt"))
    target = None if out is None or out == "-" else check_text(out, "--out")
    if kind == "ramp":
        if low is None or high is None:
            raise ParameterError("a ramp test needs --low and --high, the range of OP in % of span.")
        made = plan_ramp_test(**_given_options({**ramp, "start": start, "wait": wait}), dt=dt)
    else:
        if start is None:
            raise ParameterError("a step test needs --start, the OP before the test in % of span.")
        made = plan_step_test(start, **_given_options({**step, "hold": wait}), dt=dt)
    if target is not None or not as_json:
        write_csv(LoopRecord("plan", made.dt, op=made.op), target)
    if as_json:
        print_json({**made.to_dict(), "file": None if target is None else str(target)})
    else:
        (print_out if target is not None else print_err)(made.summary())
        if target is not None:
            print_out(f"Plan: {target}")
    return 0


def analyse(
    kind: KindOption,
    file: Annotated[
        str,
        Parameter(
            help='Source with OP and valve position (or flow), as for diagnose; "-" is the standard input.',
            allow_leading_hyphen=True,
        ),
    ],
    /,
    *,
    limit: float = 1.0,
    signal: Literal["mv", "pv"] | None = None,
    lag: float | None = None,
    before: str | None = None,
    report: ReportOption = None,
    as_json: JsonOption = False,
    reading: ReadingOptions = ReadingOptions(),  # noqa: B008 (frozen)
) -> int:
    """Analyse the record of a test: slips, deadband, stickband, slip jump, rate threshold, response times.

    Exit code 1 when deadband plus stickband exceeds the limit, 0 when it does not or the record does not show it.

    Parameters
    ----------
    limit
        Limit on deadband plus stickband, S, in % of span (1).
    signal
        Signal that shows the stem: mv (valve position) or pv (flow); mv if it was recorded.
    lag
        Ramp: known lag between OP and stem force in seconds (0).
    before
        CSV file of an earlier test of the same kind, for comparison.
    as_json
        Print the result as JSON.
    """
    from stiction import RecordError, analyse_ramp, analyse_steps, compare_tests, read
    from stiction.apps.output import print_err, print_json, print_out
    from stiction.apps.output_files import check_report
    from stiction.records import summarise

    reject_misplaced_options((file,), analyse, "valve-test analyse")
    ramp = {"lag": lag}
    _reject_other_kind(kind, ramp, {}, ("limit", "signal", "before"))
    target = None if report is None else check_report(report)

    options = reading.arguments()

    def result(path: str):
        try:
            records = read(path, **options)
            if len(records) > 1:
                tags = ", ".join(record.tag for record in records)
                raise RecordError(f"contains {len(records)} loops ({tags}); choose one with --tag.", where=path)
            if kind == "ramp":
                return analyse_ramp(records[0], signal=signal, limit=limit, **_given_options(ramp))
            return analyse_steps(records[0], signal=signal, limit=limit)
        except RecordError as error:
            reason = error.text(option_text)
            if as_json:
                print_json({
                    "kind": kind, "record": {"file": path, "tag": reading.tag}, "verdict": None, "reason": reason,
                    "comparison": None, "error": reason,
                })  # fmt: skip
            raise RecordError(reason) from None

    test = result(file)
    earlier = None if before is None else result(before)
    changes = None if earlier is None else compare_tests(earlier, test)
    (print_err if as_json else print_out)(summarise(test.record for test in (test, earlier) if test).summary())
    if target is not None:
        from stiction.report import write_page
        from stiction.report.labels import format_duration
        from stiction.report.pages.valve_test import valve_test_blocks

        subtitle = f"{test.kind.capitalize()}, {format_duration(test.record.duration)}"
        write_page(test.record.tag, valve_test_blocks(test, changes), target, subtitle=subtitle)
    if as_json:
        print_json({
            **test.to_dict(), "comparison": None if changes is None else changes.to_dict(), "error": None,
        })  # fmt: skip
    else:
        print_out(test.summary())
        if changes is not None:
            print_out(changes.summary())
        if target is not None:
            print_out(f"Report: {target}")
    return int(test.verdict == "beyond limit")


def _given_options(options: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in options.items() if value is not None}


def _reject_other_kind(kind: str, ramp: dict[str, Any], step: dict[str, Any], both: Sequence[str]) -> None:
    """Refuse options that only the other kind of test has."""
    own, other = (ramp, step) if kind == "ramp" else (step, ramp)
    if foreign := list(_given_options(other)):
        fitting = _option_names([*own, *both])
        raise ParameterError(f"A {kind} test does not use {_option_names(foreign)}; its options are {fitting}.")


def _option_names(names: Sequence[str]) -> str:
    return ", ".join(f"--{name.replace('_', '-')}" for name in names)
