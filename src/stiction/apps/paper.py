"""``stiction paper``: the paper that this package implements, as printed and corrected."""

from typing import Any

from stiction.apps.options import JsonOption, ReportOption
from stiction.apps.paper_text import PARTS, SOURCE, TITLE, part_lines

__all__ = ["paper"]


def paper(*, report: ReportOption = None, figure: int | None = None, as_json: JsonOption = False) -> int:
    """Show the tables, figures and equations of the paper, as printed and corrected, and its errata.

    Everything is simulated; the paper's recorded data are not available. Exit code 0.

    Parameters
    ----------
    report
        HTML page to write: the whole paper, or one figure.
    figure
        Only this figure, 2 to 8; --json then includes its series.
    as_json
        Print the numbers as JSON.
    """
    from stiction import paper as room
    from stiction.apps.output import print_json, print_out, track
    from stiction.apps.output_files import check_report
    from stiction.errors import ParameterError

    if figure is not None and f"figure{figure}" not in PARTS:
        raise ParameterError(
            f"--figure {figure} is outside 2 to 8; give a number from 2 to 8 (Fig. 1 of the paper is a drawing of the "
            "valve)."
        )
    target = None if report is None else check_report(report)
    wanted = list(PARTS) if figure is None else [f"figure{figure}"]
    parts: dict[str, Any] = {part: getattr(room, part)() for part in track(wanted, "Computing")}
    if target is not None:
        from stiction.apps.paper_page import write_paper_page

        write_paper_page(parts, target)
    if as_json:
        from stiction.display.json_form import to_json

        print_json({part: to_json(data, series=figure is not None) for part, data in parts.items()})
        return 0
    print_out(f"{TITLE}\n{SOURCE}\nSimulated; the recorded data of the paper are not available.")
    for part, data in parts.items():
        print_out(f"\n{PARTS[part]}")
        print_out("\n".join(f"  {line}" for line in part_lines(part, data)))
    if target is not None:
        print_out(f"\nReport: {target}")
    return 0
