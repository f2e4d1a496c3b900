"""``stiction paper``: the paper that this package implements, as printed and corrected."""

from typing import Any

from stiction.apps.options import JsonOption, ReportOption

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
    from stiction.report.pages.paper import PARTS, SOURCE, TITLE, paper_blocks

    if figure is not None and f"figure{figure}" not in PARTS:
        raise ParameterError(
            f"--figure {figure} is outside 2 to 8; give a number from 2 to 8 (Fig. 1 of the paper is a drawing of the "
            "valve)."
        )
    target = None if report is None else check_report(report)
    wanted = list(PARTS) if figure is None else [f"figure{figure}"]
    parts: dict[str, Any] = {part: getattr(room, part)() for part in track(wanted, "Computing")}
    if target is not None:
        from stiction.report import write_page

        title = TITLE if figure is None else f"{PARTS[wanted[0]]}: {TITLE}"
        write_page(title, paper_blocks(parts), target, subtitle=SOURCE)
    if as_json:
        from stiction.display.json_form import to_json

        print_json({part: to_json(data, series=figure is not None) for part, data in parts.items()})
        return 0
    print_out(f"{TITLE}\n{SOURCE}\nSimulated; the recorded data of the paper are not available.")
    for part, data in parts.items():
        print_out(f"\n{PARTS[part]}")
        print_out("\n".join(f"  {line}" for line in _part_lines(part, data)))
    if target is not None:
        print_out(f"\nReport: {target}")
    return 0


def _part_lines(part: str, data: Any) -> list[str]:
    """Return the lines that describe a part of the paper."""
    if part in ("figure3", "figure4"):
        return [
            f"{ramp.rate:g} %/s, seen in the paper: {ramp.paper}. "
            + "; ".join(f"{model}: {seen}" for model, seen in ramp.behaviour.items())
            for ramp in data
        ]
    if part == "figure5":
        return data.test.summary().splitlines()
    if part == "figure6":
        return [cycle.summary() for cycle in data.cycles]
    if part == "figure7":
        corrected = [cycle.summary() for cycle in data.corrected]
        return corrected + [f"as printed, E3 mended: {cycle.summary()}" for cycle in data.printed]
    if part == "figure8":
        size, begin, length = data.pulse
        lines = [f"a pulse of {size:g} % for {length:g} s at {begin:g} s moves the loop from cycle A to cycle C."]
        if data.smallest is not None:
            lines.append(f"The smallest pulse of that length that does is {abs(data.smallest[0]):.3g} %.")
        return lines
    if part == "errata":
        return [erratum.summary() for erratum in data]
    return data.summary().splitlines()
