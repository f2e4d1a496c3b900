"""Lines that name a tag or a unit and hold no data: above a table, or between blocks of it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from stiction.sources.layouts.headings import UNIT_HEADINGS, parse_role
from stiction.sources.roles.column_names import is_unit
from stiction.sources.roles.vocabulary import TAG_WORDS

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from stiction.sources.table import RawTable

__all__ = ["MARKS", "first_unit", "last_tag", "lines_above", "tag_in_line", "unit_in_line"]

MARKS = "\"'[]#:= "
"""Characters around the words of such a line."""
MAX_LINE_LENGTH = 100
"""Longest line that names a tag [characters]."""


def _any_of(words: Iterable[str]) -> str:
    return "|".join(sorted(map(re.escape, words), key=len, reverse=True))


_TAG = re.compile(rf"(?:(?:{_any_of(TAG_WORDS)})\s*[:=,]\s*)?([^:,=]{{1,80}})", re.IGNORECASE)
_UNIT = re.compile(rf"(?:{_any_of(UNIT_HEADINGS)})\s*[:=,]\s*([^,\s]{{1,12}})", re.IGNORECASE)


def tag_in_line(cells: Sequence[str]) -> str:
    """Give the tag that a line names; empty where it names none or holds something else too.

    Examples
    --------
    >>> tag_in_line(["Tag Name", "FIC-1.PV", ""]), tag_in_line(["# Point: FIC-1.PV"]), tag_in_line(["Time", "FIC-1.PV"])
    ('FIC-1.PV', 'FIC-1.PV', '')
    """
    text = _join(cells)
    if not text or len(text) > MAX_LINE_LENGTH or text[-1].isdigit() or _UNIT.fullmatch(text):
        return ""
    found = _TAG.fullmatch(text)
    pair = parse_role(found[1].strip()) if found else None
    return found[1].strip() if found and pair and pair[0] else ""


def unit_in_line(cells: Sequence[str]) -> str:
    """Give the unit that a line names; empty where it names none.

    Examples
    --------
    >>> unit_in_line(["Units: t/h"]), unit_in_line(["Eng units", "%"]), unit_in_line(["Unit: boiler"])
    ('t/h', '%', '')
    """
    found = _UNIT.fullmatch(_join(cells))
    return found[1] if found and is_unit(found[1]) else ""


def _join(cells: Sequence[str]) -> str:
    """Join the cells of a line, without the marks around it."""
    return ",".join(cell.strip() for cell in cells if cell.strip()).strip(MARKS).replace(":,", ":")


def lines_above(table: RawTable) -> list[list[str]]:
    """Give all lines above the data, and the metadata as lines of key and value."""
    return [*([key, value] for key, value in table.metadata.items()), *table.above, *table.header]


def last_tag(table: RawTable) -> str:
    """Give the tag that the last line above the data with a tag names; empty where none does."""
    return next((tag for line in reversed(lines_above(table)) if (tag := tag_in_line(line))), "")


def first_unit(table: RawTable) -> str:
    """Give the unit that a line above the data names; empty where none does."""
    return next((unit for line in lines_above(table) if (unit := unit_in_line(line))), "")
