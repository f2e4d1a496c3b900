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
    from stiction.apps.output import print_err, print_json, print_out
    from stiction.apps.output_files import check_report
    from stiction.apps.parse_loop import make_loop, merge_settings
    from stiction.apps.print_blocks import print_blocks
    from stiction.apps.simulate import DEFAULTS
    from stiction.errors import ParameterError
    from stiction.limitcycle.predict import explain_no_cycle
    from stiction.report.pages.limit_cycles import cycle_table, limit_cycle_blocks

    if over is not None and report is None:
        raise ParameterError(f"--over {over} is for the diagram of the report; add --report, or leave --over out.")
    target = None if report is None else check_report(report)
    settings = merge_settings(loop, {"process": process, "controller": controller, "valve": valve}, DEFAULTS)
    made = make_loop({**settings, "noise": 0.0})
    cycles = predict_limit_cycles(made, exact=exact, sp=sp, disturbance=disturbance)
    if target is not None:
        from stiction.limitcycle.study import study_cycles
        from stiction.report import write_page

        over = over or "gain"
        study = study_cycles(made, cycles, over, sp=sp, disturbance=disturbance)
        parts = {name: str(settings[name]) for name in ("process", "controller", "valve")}
        given = {**parts, "sp": f"{sp:g}", "disturbance": f"{disturbance:g}"}
        blocks = limit_cycle_blocks(made, cycles, study, given, sp=sp, disturbance=disturbance, over=over)
        write_page("Limit cycles", blocks, target, subtitle=", ".join(parts.values()))
    if as_json:
        print_json([cycle.to_dict() for cycle in cycles])
        if not cycles:
            print_err(explain_no_cycle(made))
    else:
        if cycles:
            print_blocks([cycle_table(cycles)])
        else:
            print_out(explain_no_cycle(made))
        if target is not None:
            print_out(f"Report: {target}")
    return int(any(cycle.kind == "cycle" and cycle.stable for cycle in cycles))
