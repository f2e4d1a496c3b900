"""``stiction paper``: a walk through the paper this package implements, printed beside corrected."""

from typing import Any

from stiction.apps.options import Json, Report
from stiction.apps.paper_text import PARTS, SOURCE, TITLE, part_lines

__all__ = ["paper"]


def paper(*, report: Report = None, figure: int | None = None, as_json: Json = False) -> int:
    """Walk through the paper: its tables, figures and equations, printed beside corrected, and its errata.

    Everything is simulated; the paper's recorded data are not available. Exit code 0.

    Parameters
    ----------
    report
        HTML page to write: the whole paper in its order, or one figure.
    figure
        Only this figure, 2 to 8; with --json its series too.
    as_json
        Print the numbers as JSON.
    """
    from stiction import paper as room
    from stiction.apps.files import check_report
    from stiction.apps.output import print_json, say, track
    from stiction.errors import ParameterError

    if figure is not None and f"figure{figure}" not in PARTS:
        raise ParameterError(f"--figure {figure} is not one of 2 to 8; Fig. 1 of the paper is a drawing of the valve.")
    target = None if report is None else check_report(report)
    wanted = list(PARTS) if figure is None else [f"figure{figure}"]
    parts: dict[str, Any] = {part: getattr(room, part)() for part in track(wanted, "Computing")}
    if target is not None:
        from stiction.apps.paper_page import write_paper_page

        write_paper_page(parts, target)
    if as_json:
        from stiction.paper.to_plain import to_plain

        print_json({part: to_plain(data, series=figure is not None) for part, data in parts.items()})
        return 0
    say(f"{TITLE}\n{SOURCE}\nSimulated; the recorded data of the paper are not available.")
    for part, data in parts.items():
        say(f"\n{PARTS[part]}")
        say("\n".join(f"  {line}" for line in part_lines(part, data)))
    if target is not None:
        say(f"\nReport: {target}")
    return 0
