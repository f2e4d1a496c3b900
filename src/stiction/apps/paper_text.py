"""Title, source and parts of the paper, and the lines printed for each part."""

from typing import Any

__all__ = ["PARTS", "SOURCE", "TITLE", "part_lines"]

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
"""Function of `stiction.paper` -> its name in the paper, in the order of the paper."""
TITLE = "Issues in Modeling Stiction in Process Control Valves"
SOURCE = "R. Srinivasan, R. Rengaswamy, U. Nallasivam, V. Rajavelu, American Control Conference, 2008"


def part_lines(part: str, data: Any) -> list[str]:
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
