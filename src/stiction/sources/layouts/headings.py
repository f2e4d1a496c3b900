"""What every layout asks of a table first: its column names, the signals that they name and its time column."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

from stiction.sources.roles.column_names import HeaderNames, header_names, parse_column_name, role_of
from stiction.sources.tag_column import Clock, TagColumn
from stiction.sources.time.parse import find_time_columns, is_time_heading, is_timestamp, parse_time

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable

__all__ = [
    "UNIT_HEADINGS",
    "find_clock",
    "forget_note_on_lines_above",
    "has_loop",
    "heading_column",
    "is_stamp_column",
    "parse_role",
    "table_headings",
]

UNIT_HEADINGS = ("UNIT", "UNITS", "UOM", "EU", "ENGUNITS", "ENG UNITS", "ENG. UNITS", "ENGINEERING UNITS")
"""Words before a unit, or above a column of units."""

TYPE_WORDS = {"DOUBLE", "FLOAT", "FLOAT32", "FLOAT64", "SINGLE", "REAL", "INT", "INTEGER", "LONG", "NUMBER", "NUMERIC"}
TYPE_WORDS |= {"STRING", "STR", "TEXT", "DATE", "DATETIME", "TIMESTAMP", "BOOL", "BOOLEAN"}
"""Types of columns, which some exporters write in a row of the header."""
_TYPE_CODE = re.compile(r"[IDSBRF](?:[48]|16|32|64)|[IDSB]")
_HEADINGS: WeakKeyDictionary[RawTable, HeaderNames] = WeakKeyDictionary()


def table_headings(table: RawTable) -> HeaderNames:
    """Give the column names, units and descriptions of a table, each `table.width` long.

    Rows above the header are tried too where the header itself names neither a signal nor a time: markers such as
    ``#TYPES`` may stand between the names and the data (Ignition).
    """
    if table not in _HEADINGS:
        header = [row for row in table.header if not _are_types(row)]
        found = header_names(header)
        above = [row for row in table.above if len(row) == table.width and any(map(is_time_heading, row))]
        if above and not any(map(parse_column_name, found.names)):
            other = header_names([*above, *header])
            if any(map(parse_column_name, other.names)):
                found = other
                forget_note_on_lines_above(table)
        blank = [""] * table.width
        _HEADINGS[table] = found if found.names else HeaderNames(blank, blank, blank)
    return _HEADINGS[table]


def _are_types(row: Sequence[str]) -> bool:
    """Whether a header row holds the types of the columns."""
    words = {cell.strip().upper() for cell in row[1:]} - {""}
    return bool(words) and all(word in TYPE_WORDS or _TYPE_CODE.fullmatch(word) for word in words)


def forget_note_on_lines_above(table: RawTable) -> None:
    """Take back the note that lines above the header are not used."""
    table.notes[:] = [note for note in table.notes if "above the header" not in note]


def parse_role(name: str) -> tuple[str, str] | None:
    """Give tag and role of a column name; None where it names no signal."""
    pair = parse_column_name(name)
    return (pair[0], role_of(pair[1]).split()[-1]) if pair else None


def heading_column(table: RawTable, position: int, clock: Clock | None) -> TagColumn:
    """Give a whole column under its heading."""
    names, units, descriptions = table_headings(table)
    load = partial(table.column, position)
    return TagColumn(names[position], table, clock, load, units[position], descriptions[position], position)


def has_loop(names: Iterable[str]) -> bool:
    """Whether column names make a loop: two of PV, OP and valve position under one tag."""
    pairs = {pair for name in names if (pair := parse_role(name)) and pair[1] in ("pv", "op", "mv")}
    return len(pairs) > len({tag for tag, _ in pairs})


def is_stamp_column(table: RawTable, position: int) -> bool:
    """Whether most cells of a column in the first rows are time stamps."""
    cells = table.sample_column(position)
    return bool(cells) and 2 * sum(map(is_timestamp, cells)) > len(cells)


def find_clock(
    table: RawTable, options: ReadOptions, *, taken: Iterable[int] = (), only: int | None = None
) -> tuple[Clock | None, set[int]]:
    """Find the time of the rows of a table.

    Parameters
    ----------
    table : RawTable
        The table.
    options : ReadOptions
        What the user said; a time column named there wins.
    taken : iterable of int
        Columns that hold something else.
    only : int, optional
        The one column that may be time.

    Returns
    -------
    clock : Clock or None
        Time of each row, parsed when it is first needed; None when there is no time column.
    positions : set of int
        Columns that hold time or count the samples, and so no signal.
    """
    names, units, _ = table_headings(table)
    if only is not None:
        taken = set(range(table.width)) - {only}
        options = replace(options, columns={"time": only})
    found = find_time_columns(names, units, table, options, taken=set(taken))
    positions = {*found.positions, *found.candidates}
    positions |= {i for i in (found.fraction, found.index) if i is not None}
    return (Clock(partial(parse_time, table, found, options)) if found.positions else None), positions
