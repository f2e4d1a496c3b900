"""``stiction stroke``: simulate a valve alone for a given input."""

from typing import Annotated

from cyclopts import Parameter

from stiction.apps.options import JsonOption, OutOption, ReportOption

__all__ = ["stroke"]


def stroke(
    *,
    valve: str = "kano:S=3,J=1",
    op: Annotated[str, Parameter(allow_leading_hyphen=True)] = "triangle:mean=50,amplitude=10,period=400,duration=800",
    dt: float = 1.0,
    mv_start: float | None = None,
    out: OutOption = None,
    report: ReportOption = None,
    as_json: JsonOption = False,
) -> int:
    """Simulate the stem of a valve for a test signal; OP and valve position come as CSV.

    Parameters
    ----------
    valve
        kano:S=3,J=1 (the default), choudhury:S=..,J=.., stenman:d=.., he:fs=..,fd=.., srinivasan:sb=..,sj=..,r=..,
        physical:mass=3 lbm,spring_rate=300 lbf/in,..., a published set such as nominal, or ideal. % of span.
    op
        ramp:start=..,stop=..,rate=.., triangle:mean=..,amplitude=..,period=..,duration=.., sine:... (the same),
        staircase:levels=50 51 50,hold=60, random_walk:..., binary_sequence:..., or a CSV file with an OP column.
    dt
        Sampling period in seconds; not used with a CSV file.
    mv_start
        Valve position at rest before the start in % of span; equal to the first OP when not given.
    out
        CSV file to write (time_s, OP, MV: the valve position); without it the CSV goes to standard output.
    report
        HTML page to write: trend and signature of the valve.
    as_json
        Print the signals as JSON.
    """
    from stiction.apps.output import print_json, print_out
    from stiction.apps.output_files import check_report, check_text, write_csv
    from stiction.apps.parse_loop import require_position
    from stiction.apps.parse_model import parse_valve
    from stiction.apps.parse_signal import parse_op_signal
    from stiction.errors import require_positive

    target = None if out is None or out == "-" else check_text(out, "--out")
    page = None if report is None else check_report(report)
    made = parse_valve(valve)
    series, step = parse_op_signal(op, require_positive("dt", dt, "s"))
    from stiction.simulation import stroke as run

    if mv_start is not None:
        mv_start = require_position(
            "mv_start", mv_start, min(0.0, float(series.min())), max(100.0, float(series.max()))
        )
    record = run(made, series, step, mv_start)
    if target is not None or not (as_json or page):
        write_csv(record, target)
    if page is not None:
        from stiction.report import write_page
        from stiction.report.pages.stroke import stroke_blocks

        write_page("Valve stroke", stroke_blocks(record, valve=valve, op=op), page)
    if as_json:
        assert record.mv is not None
        print_json({"valve": valve, "dt_s": record.dt, "op": record.op, "mv": record.mv})
        return 0
    if target is not None:
        print_out(f"{len(record)} samples every {record.dt:g} s written to {target}.")
    if page is not None:
        print_out(f"Report: {page}")
    return 0
