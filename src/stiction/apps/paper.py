"""``stiction paper``: a walk through the paper this package implements, printed beside corrected."""

from typing import Any

from stiction.apps.options import Json, Report

__all__ = ["PARTS", "paper", "told"]

PARTS = {
    "table1": "Table I",
    "figure2": "Fig. 2",
    "figure3": "Fig. 3",
    "figure4": "Fig. 4",
    "figure5": "Fig. 5",
    "section5": "Section V",
    "equation5": "Eq. 5",
    "figure6": "Fig. 6",
    "equations6and7": "Eqs. 6-7",
    "figure7": "Fig. 7",
    "figure8": "Fig. 8",
    "errata": "Errata",
}
"""Function of `stiction.paper` -> what it is in the paper, in its order."""
TITLE = "Issues in Modeling Stiction in Process Control Valves"
SOURCE = "R. Srinivasan, R. Rengaswamy, U. Nallasivam, V. Rajavelu, American Control Conference, 2008"


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
        from stiction.paper.plain import plain

        print_json({part: plain(data, series=figure is not None) for part, data in parts.items()})
        return 0
    say(f"{TITLE}\n{SOURCE}\nSimulated; the recorded data of the paper are not available.")
    for part, data in parts.items():
        say(f"\n{PARTS[part]}")
        say("\n".join(f"  {line}" for line in told(part, data)))
    if target is not None:
        say(f"\nReport: {target}")
    return 0


def told(part: str, data: Any) -> list[str]:
    """Lines that say what a part of the paper shows."""
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
