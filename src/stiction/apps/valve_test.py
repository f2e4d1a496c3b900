"""``stiction valve-test``: plan a ramp or step test of a valve, and read the test's record."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from stiction.apps.options import Json, Out, Report, in_options, refuse_options
from stiction.apps.reading_options import ReadingOptions
from stiction.errors import ParameterError

__all__ = ["analyse", "plan"]

Kind = Annotated[Literal["ramp", "step"], Parameter(help="ramp or step.")]
Numbers = Annotated[tuple[float, ...] | None, Parameter(consume_multiple=True)]


def plan(
    kind: Kind,
    /,
    *,
    low: float | None = None,
    high: float | None = None,
    threshold: float | None = None,
    rates: Numbers = None,
    repeats: int | None = None,
    start: float | None = None,
    fine_step: float | None = None,
    fine_range: float | None = None,
    sizes: Numbers = None,
    wait: float | None = None,
    dt: float = 1.0,
    out: Out = None,
    as_json: Json = False,
) -> int:
    """Plan a test: the OP to give by hand or by the control system, as CSV of time_s and OP.

    Parameters
    ----------
    low
        Ramp: lowest OP in % of span.
    high
        Ramp: highest OP in % of span.
    threshold
        Ramp: expected rate r in %/s below which the stem goes in stairs; rates are chosen about it.
    rates
        Ramp: rates to test in %/s, instead of a threshold; several after one another.
    repeats
        Ramp: how often each rate is tested (1).
    start
        OP before the test in % of span; needed for steps.
    fine_step
        Step: height of the staircase's steps in % of span (0.1).
    fine_range
        Step: reach of the staircase to either side in % of span (2).
    sizes
        Step: steps for the response time in % of span (0.5 1 2 5).
    wait
        Seconds of rest between ramps (60), or at each step (30).
    dt
        Sampling period in seconds (1).
    out
        CSV file to write; without it the CSV goes to the output.
    as_json
        Print the plan as JSON, and the CSV only where --out says.
    """
    from stiction import plan_ramp_test, plan_step_test
    from stiction.apps.files import check_text, write_csv
    from stiction.apps.output import note, print_json, say
    from stiction.records import LoopRecord

    ramp = {"low": low, "high": high, "threshold": threshold, "rates": rates, "repeats": repeats}
    step = {"fine_step": fine_step, "fine_range": fine_range, "sizes": sizes}
    _of_its_kind(kind, ramp, step, ("start", "wait", "dt"))
    target = None if out is None or out == "-" else check_text(out, "--out")
    if kind == "ramp":
        if low is None or high is None:
            raise ParameterError("a ramp test needs --low and --high, the range of the OP in % of span.")
        made = plan_ramp_test(**_given({**ramp, "start": start, "wait": wait}), dt=dt)
    else:
        if start is None:
            raise ParameterError("a step test needs --start, the OP about which it steps in % of span.")
        made = plan_step_test(start, **_given({**step, "hold": wait}), dt=dt)
    if target is not None or not as_json:
        write_csv(LoopRecord("plan", made.dt, op=made.op), target)
    if as_json:
        print_json({**made.to_dict(), "file": None if target is None else str(target)})
    else:
        (say if target is not None else note)(made.summary())
        if target is not None:
            say(f"Plan: {target}")
    return 0


def analyse(
    kind: Kind,
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
    report: Report = None,
    as_json: Json = False,
    reading: ReadingOptions = ReadingOptions(),  # noqa: B008 (frozen)
) -> int:
    """Read a test's record: every stick and slip, deadband, stick band, jump, rate threshold, response times.

    Exit code 1 when deadband plus stickband exceeds the limit, 0 when it does not or cannot be told.

    Parameters
    ----------
    limit
        Limit on deadband plus stickband, S, in % of span (1).
    signal
        mv (valve position) or pv (flow): what shows the stem; mv where it was recorded.
    lag
        Ramp: known lag between OP and stem force in seconds (0).
    before
        CSV file of an earlier test of the same kind to compare with.
    as_json
        Print the result as JSON.
    """
    from stiction import RecordError, analyse_ramp, analyse_steps, compare_tests, read
    from stiction.apps.files import check_report
    from stiction.apps.output import note, print_json, say
    from stiction.records import summarise

    refuse_options((file,), analyse, "valve-test analyse")
    ramp = {"lag": lag}
    _of_its_kind(kind, ramp, {}, ("limit", "signal", "before"))
    target = None if report is None else check_report(report)

    options = reading.arguments()

    def result(path: str):
        try:
            records = read(path, **options)
            if len(records) > 1:
                tags = ", ".join(record.tag for record in records)
                raise RecordError(f"{path}: holds {len(records)} valves ({tags}); name one with --tag.")
            if kind == "ramp":
                return analyse_ramp(records[0], signal=signal, limit=limit, **_given(ramp))
            return analyse_steps(records[0], signal=signal, limit=limit)
        except RecordError as error:
            reason = in_options(_of_a_test(str(error)))
            if as_json:
                print_json({
                    "kind": kind, "record": {"file": path, "tag": reading.tag}, "verdict": None, "reason": reason,
                    "comparison": None, "error": reason,
                })  # fmt: skip
            raise RecordError(reason) from None

    found = result(file)
    earlier = None if before is None else result(before)
    changes = None if earlier is None else compare_tests(earlier, found)
    (note if as_json else say)(in_options(summarise(test.record for test in (found, earlier) if test).summary()))
    if target is not None:
        from stiction.apps.valve_test_page import write_valve_test_page

        write_valve_test_page(found, target, changes)
    if as_json:
        print_json({
            **found.to_dict(), "comparison": None if changes is None else changes.to_dict(), "error": None,
        })  # fmt: skip
    else:
        say(found.summary())
        if changes is not None:
            say(changes.summary())
        if target is not None:
            say(f"Report: {target}")
    return int(found.verdict == "beyond limit")


_VERBS = {
    "analyse_ramp": "valve-test analyse ramp",
    "analyse_steps": "valve-test analyse step",
    "plan_ramp_test": "valve-test plan ramp",
    "plan_step_test": "valve-test plan step",
    "diagnose or identify": "diagnose",
    "signal='pv'": "--signal pv",
}
"""What a library says of its functions, and the verb or option for it."""


def _of_a_test(sentence: str) -> str:
    """What the library says of a loop said of a test, in which the stem is looked for where a loop has its PV."""
    sentence = sentence.replace("no loop with PV and OP was", "no OP with a valve position (MV) or a flow (PV) was")
    sentence = sentence.replace("columns={'pv': ..., 'op': ...}", "columns={'mv': ..., 'op': ...}")
    for function, verb in _VERBS.items():
        sentence = sentence.replace(function, verb)
    return sentence


def _given(options: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in options.items() if value is not None}


def _of_its_kind(kind: str, ramp: dict[str, Any], step: dict[str, Any], both: Sequence[str]) -> None:
    """Refuse options that only the other kind of test has."""
    own, other = (ramp, step) if kind == "ramp" else (step, ramp)
    if foreign := list(_given(other)):
        fitting = _as_options([*own, *both])
        raise ParameterError(
            f"{_as_options(foreign)} {'is' if len(foreign) == 1 else 'are'} not of a {kind} test; it takes {fitting}."
        )


def _as_options(names: Sequence[str]) -> str:
    return ", ".join(f"--{name.replace('_', '-')}" for name in names)
