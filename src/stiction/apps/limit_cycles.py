"""``stiction limit-cycles``: all limit cycles of a loop with a sticky valve."""

from stiction.apps.options import JsonOption, ReportOption, TextOption

__all__ = ["limit_cycles"]


def limit_cycles(
    *,
    process: TextOption = None,
    controller: TextOption = None,
    valve: TextOption = None,
    disturbance: float = 0.0,
    sp: float = 0.0,
    loop: str | None = None,
    exact: bool = True,
    over: str | None = None,
    report: ReportOption = None,
    as_json: JsonOption = False,
) -> int:
    """List the limit cycles of a loop: period, amplitudes, stability, and how reliable each prediction is.

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
    disturbance
        Constant load at the process inlet in % of span (0).
    sp
        Set point in PV units (0).
    loop
        TOML file with process, controller and valve, as for stiction simulate; options override it.
    exact
        Whether to compute each cycle exactly too, in addition to the describing-function prediction.
    over
        Parameter of the bifurcation diagram in the report: gain (a factor; the default), disturbance, dead_time,
        or a parameter of the controller or of the valve.
    report
        HTML page to write: Nyquist plot, cycles in time, phase portrait, basins, bifurcation diagram.
    as_json
        Print the list of cycles as JSON.
    """
    from stiction import predict_limit_cycles
    from stiction.apps.limit_cycle_table import COLUMNS, FAMILIES, cycle_row
    from stiction.apps.output import print_err, print_json, print_out, print_table
    from stiction.apps.output_files import check_report
    from stiction.apps.parse_loop import make_loop, merge_settings
    from stiction.apps.simulate import DEFAULTS
    from stiction.errors import ParameterError
    from stiction.limitcycle.predict import explain_no_cycle

    if over is not None and report is None:
        raise ParameterError(f"--over {over} is for the diagram of the report; add --report, or leave --over out.")
    target = None if report is None else check_report(report)
    settings = merge_settings(loop, {"process": process, "controller": controller, "valve": valve}, DEFAULTS)
    made = make_loop({**settings, "noise": 0.0})
    found = predict_limit_cycles(made, exact=exact, sp=sp, disturbance=disturbance)
    if target is not None:
        from stiction.apps.limit_cycles_page import write_limit_cycles_page

        texts = {name: str(settings[name]) for name in ("process", "controller", "valve")}
        write_limit_cycles_page(made, found, target, texts, sp=sp, disturbance=disturbance, over=over or "gain")
    if as_json:
        print_json([cycle.to_dict() for cycle in found])
        if not found:
            print_err(explain_no_cycle(made))
    else:
        if found:
            print_table(COLUMNS, [cycle_row(cycle) for cycle in found], right=COLUMNS[3:9])
            if any(cycle.family for cycle in found):
                print_out(FAMILIES)
        else:
            print_out(explain_no_cycle(made))
        if target is not None:
            print_out(f"Report: {target}")
    return int(any(cycle.kind == "cycle" and cycle.stable for cycle in found))
