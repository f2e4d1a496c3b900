"""``stiction limit-cycles``: every limit cycle a sticky loop can fall into."""

from typing import TYPE_CHECKING, Any

from stiction.apps.options import Json, Report, Text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.limitcycle import LimitCycle

__all__ = ["COLUMNS", "limit_cycles", "row"]

COLUMNS = (
    "Kind", "Family", "Stable", "Period [s]", "OP amplitude [%]", "PV amplitude", "Exact period [s]", "Trust",
)  # fmt: skip


def limit_cycles(
    *,
    process: Text = None,
    controller: Text = None,
    valve: Text = None,
    load: float = 0.0,
    sp: float = 0.0,
    loop: str | None = None,
    exact: bool = True,
    over: str = "gain",
    report: Report = None,
    as_json: Json = False,
) -> int:
    """List the limit cycles of a loop: period, amplitudes, stable or not, and how far to trust each prediction.

    Signals are deviations from the point of rest. Exit code 1 when the loop has a stable limit cycle, else 0.

    Parameters
    ----------
    process
        "3 exp(-10s)/(10s+1)" (the default), fopdt:K=3,tau=10,dead_time=10, sopdt:..., integrating:K=..., or
        tf:num=3,den=10 1,dead_time=10. PV units per % of span, seconds.
    controller
        pi:Kc=0.2,Ti=10 (the default), pid:..., p:Kc=.. or parallel:Kp=..,Ki=..,Kd=..
    valve
        kano:S=3,J=1 (the default), stenman:d=.., choudhury:..., he:..., srinivasan:sb=..,sj=..,r=..; % of span.
    load
        Constant load at the process inlet in % of span (0).
    sp
        Set point in PV units (0).
    loop
        TOML file with process, controller and valve, as for stiction simulate; options come before it.
    exact
        Whether to solve each cycle exactly beside its describing-function prediction.
    over
        Parameter of the bifurcation diagram in the report: gain (a factor), load, dead_time, or a parameter of the
        controller or of the valve.
    report
        HTML page to write: Nyquist plot, cycles in time, phase portrait, basins, bifurcation diagram.
    as_json
        Print the list of cycles as JSON.
    """
    from stiction import predict_limit_cycles
    from stiction.apps.files import check_report
    from stiction.apps.loop_text import make_loop, settings_of
    from stiction.apps.output import print_json, say
    from stiction.apps.simulate import DEFAULTS

    target = None if report is None else check_report(report)
    settings = settings_of(loop, {"process": process, "controller": controller, "valve": valve}, DEFAULTS)
    made = make_loop({**settings, "noise": 0.0})
    found = predict_limit_cycles(made, exact=exact, sp=sp, load=load)
    if target is not None:
        from stiction.apps.limit_cycles_page import write_limit_cycles_page

        texts = {name: str(settings[name]) for name in ("process", "controller", "valve")}
        write_limit_cycles_page(made, found, target, texts, sp=sp, load=load, over=over)
    if as_json:
        print_json([cycle.to_dict() for cycle in found])
    else:
        _tell(found)
        if target is not None:
            say(f"Report: {target}")
    return int(any(cycle.kind == "cycle" and cycle.stable for cycle in found))


def _tell(found: "Sequence[LimitCycle]") -> None:
    """Print the cycles as a table, the boundaries between them beside."""
    from stiction.apps.output import print_table, say

    if not found:
        say("No limit cycle: the describing function meets the loop nowhere.")
        return
    print_table(COLUMNS, [row(cycle) for cycle in found], right=COLUMNS[3:7])


def row(cycle: "LimitCycle") -> list[Any]:
    """Return what the tables say of one cycle."""
    from stiction.report.words import digits

    exact = cycle.exact.period if cycle.exact is not None else cycle.period if cycle.method == "continuous" else None
    return [
        cycle.kind,
        cycle.family or "-",
        {True: "stable", False: "unstable", None: "unknown"}[cycle.stable],
        digits(cycle.period, significant=4),
        digits(cycle.amplitude, significant=4),
        digits(cycle.pv_amplitude, significant=4),
        "" if exact is None else digits(exact, significant=5),
        cycle.trust,
    ]
