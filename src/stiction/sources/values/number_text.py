"""A cell as a number: decimal comma, thousands, a unit after the number."""

from __future__ import annotations

import re
from collections import Counter

from stiction.sources.roles.vocabulary import CELL_UNITS

__all__ = [
    "GROUPED",
    "GROUP_MARKS",
    "NUMBER_AND_ANY_UNIT",
    "NUMBER_AND_UNIT",
    "PLAIN",
    "SPACES",
    "is_number",
    "parse_number",
    "usual_unit",
]

# The digits are written out, since \d takes those of other scripts too.
PLAIN = {m: rf"[+-]?(?:[0-9]+\{m}?[0-9]*|\{m}[0-9]+)(?:[eE][+-]?[0-9]+)?" for m in ".,"}
GROUP_MARKS = {".": "[,' ]", ",": "[.' ]"}
GROUPED = {m: rf"[+-]?[1-9][0-9]{{0,2}}(?:{GROUP_MARKS[m]}[0-9]{{3}})+(?:\{m}[0-9]*)?" for m in ".,"}
SPACES = str.maketrans({"\u00a0": " ", "\u202f": " ", "\u2212": "-"})
NUMBER_AND_UNIT = rf"(.*[0-9.,])\s*({'|'.join(map(re.escape, CELL_UNITS))})?"
# Beside the known units any flow, for a library of units to judge.
NUMBER_AND_ANY_UNIT = NUMBER_AND_UNIT.removesuffix(")?") + r"|[a-z°µ%][a-z0-9*^·²³°%().]{0,8}/[a-z]{1,5})?"
_IS_PLAIN, _IS_GROUPED = ({m: re.compile(form[m]) for m in ".,"} for form in (PLAIN, GROUPED))
_HAS_UNIT = re.compile(NUMBER_AND_UNIT, re.IGNORECASE)


def is_number(cell: str, decimal: str, *, grouped: bool = True) -> bool:
    """Whether a cell is a number, with or without thousands separators and a unit."""
    if _IS_PLAIN[decimal].fullmatch(cell):
        return True
    text, _ = _split_unit(cell)
    return bool(_IS_PLAIN[decimal].fullmatch(text) or (grouped and _IS_GROUPED[decimal].fullmatch(text)))


def parse_number(cell: str, decimal: str) -> float:
    """Give the number in a cell; NaN when there is none."""
    text, _ = _split_unit(cell)
    if _IS_GROUPED[decimal].fullmatch(text):
        text = re.sub(GROUP_MARKS[decimal], "", text)
    elif not _IS_PLAIN[decimal].fullmatch(text):
        return float("nan")
    return float(text.replace(",", "."))


def usual_unit(cells: list[str], decimal: str) -> str:
    """Give the unit that stands after most numbers; empty when most have none."""
    if all(cell[-1:].isdigit() for cell in cells):
        return ""
    units = Counter(_split_unit(cell)[1] for cell in cells if is_number(cell, decimal))
    return max(units, key=lambda unit: units[unit], default="")


def _split_unit(cell: str) -> tuple[str, str]:
    """Split a cell into number and unit."""
    text = cell.translate(SPACES).strip()
    match = None if text[-1:].isdigit() else _HAS_UNIT.fullmatch(text)
    return (match[1], match[2] or "") if match else (text, "")
