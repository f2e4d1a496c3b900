"""Which columns of a table tell the time: by their headings, by what they hold, or as the user says."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError
from stiction.sources.roles.vocabulary import INDEX_WORDS, TIME_UNITS, TIME_WORDS
from stiction.sources.time.numeric_time import find_epoch, is_compact_clock
from stiction.sources.time.text_stamps import is_clock, is_date, is_timestamp
from stiction.sources.values.numeric_cells import is_number, parse_number

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable

__all__ = ["TimeColumns", "find_time_columns", "is_time_heading", "missing_time_error", "seconds_per_unit"]

MIDNIGHT = r"[T ]00:00(?::00(?:\.0+)?)?$"
_DOTTED_CLOCK = re.compile(r"\d{1,2}\.\d{2}\.\d{2}")
_UNIT_IN_BRACKETS = re.compile(r"\s*[\[(]([^\])]*)[\])]\s*$")
_FRACTIONS = {
    **dict.fromkeys(("MS", "MSEC", "MSECS", "MILLIS", "MILLI", "MILLISECOND", "MILLISECONDS", "MILLISEKUNDEN"), 1e-3),
    **dict.fromkeys(("US", "USEC", "MICROSECOND", "MICROSECONDS"), 1e-6),
    **dict.fromkeys(("NS", "NSEC", "NANOSECOND", "NANOSECONDS"), 1e-9),
}
"""Heading of a column that holds the fraction of the second -> seconds per unit."""


@dataclass(frozen=True)
class TimeColumns:
    """Columns that tell the time, by their positions in the table."""

    positions: tuple[int, ...] = ()
    """One column of time, or a date and a time of day; empty when none was found."""
    fraction: int | None = None
    """A column that holds the fraction of the second, such as milliseconds."""
    fraction_unit: float = 1e-3
    """Seconds per unit of `fraction`."""
    unit: float | None = None
    """Seconds per unit of a time column of numbers; None where the header does not name it."""
    index: int | None = None
    """A column that only counts the samples."""
    candidates: tuple[int, ...] = ()
    """All columns with a heading of time."""
    notes: tuple[str, ...] = ()
    """Assumptions, a sentence each."""


def _heading_word(name: str) -> str:
    return " ".join(_UNIT_IN_BRACKETS.sub("", name).strip().strip("\"'").upper().split())


def is_time_heading(name: str) -> bool:
    """Whether a column name is one of time.

    Examples
    --------
    >>> is_time_heading("Time [s]"), is_time_heading("time_ms"), is_time_heading("FIC-1.PV")
    (True, True, False)
    """
    word = _heading_word(name).lstrip("_")
    head, _, tail = word.replace("_", " ").rpartition(" ")
    return word in TIME_WORDS or word.replace("_", " ") in TIME_WORDS or (head in TIME_WORDS and tail in TIME_UNITS)


def seconds_per_unit(name: str, unit: str = "") -> float | None:
    """Return the seconds per unit of a time column by its heading or its unit, None where neither tells.

    Examples
    --------
    >>> seconds_per_unit("Time [min]"), seconds_per_unit("time_ms"), seconds_per_unit("Time", "h")
    (60.0, 0.001, 3600.0)
    """
    bracketed = _UNIT_IN_BRACKETS.search(name)
    tail = _heading_word(name).replace("_", " ").rsplit(" ", 1)[-1]
    texts = (bracketed[1].strip().upper() if bracketed else "", unit.strip().upper(), tail)
    return next((TIME_UNITS[text] for text in texts if text in TIME_UNITS), None)


def find_time_columns(
    headings: Sequence[str],
    units: Sequence[str],
    table: RawTable,
    options: ReadOptions,
    taken: Collection[int] = (),
) -> TimeColumns:
    """Find the time columns of a table.

    Parameters
    ----------
    headings, units : sequence of str
        Name and unit of each column; may be shorter than the table is wide.
    table : RawTable
        The table, of which only the first rows are looked at.
    options : ReadOptions
        A column that the user names as time wins; a `time_format` tells a date beside a time of day.
    taken : collection of int
        Columns that hold something else.

    Returns
    -------
    TimeColumns
        Without positions when there is no time column.

    Raises
    ------
    RecordError
        When the user names a column that does not exist.
    """
    names = [*headings, *[""] * (table.width - len(headings))]
    free = [i for i in range(table.width) if i not in taken]
    if "time" in options.columns:
        candidates = [_named_column(options.columns["time"], names, table)]
    else:
        candidates = [i for i in free if is_time_heading(names[i])]
    fraction = next((i for i in free if i not in candidates[:1] and _is_fraction(names[i], table, i)), None)
    candidates = [i for i in candidates if i != fraction]
    index = None
    if not candidates:
        if 0 in free and table.header and _heading_word(names[0]) in INDEX_WORDS and not _is_time_column(table, 0):
            index = 0
        first = 0 if index is None else 1
        candidates = [first] if first in free and _is_time_column(table, first, names[first]) else []
    if fraction is not None and not (candidates and _mostly_stamps(table.sample_column(candidates[0]))):
        candidates, fraction = sorted({*candidates, fraction}), None
    positions, notes = _choose(candidates, table, options)
    unit = (
        seconds_per_unit(names[positions[0]], units[positions[0]] if positions[0] < len(units) else "")
        if positions
        else None
    )
    scale = _FRACTIONS[_heading_word(names[fraction])] if fraction is not None else 1e-3
    return TimeColumns(tuple(positions), fraction, scale, unit, index, tuple(candidates), tuple(notes))


def missing_time_error(table: RawTable, headings: Sequence[str], used: Collection[int]) -> RecordError:
    """Make the error for a table without a time column when no sampling period is given.

    Parameters
    ----------
    table : RawTable
        The table.
    headings : sequence of str
        Name of each column, empty when there is no header.
    used : collection of int
        Columns that hold signals.

    Returns
    -------
    RecordError
        With the name of a column that may be the time, where there is one.
    """
    has_index = bool(table.header) and 0 not in used and _heading_word(next(iter(headings), "")) in INDEX_WORDS
    for i in sorted({*range(int(has_index), table.width)} - {*used}):
        cells = table.sample_column(i)
        values = np.array([parse_number(cell, table.decimal) for cell in cells])
        earlier, later = values[:-1], values[1:]
        if (later.size > 0 and ((later > earlier).all() or (later < earlier).all())) or _mostly_stamps(cells):
            column = headings[i] if i < len(headings) and headings[i] else i
            return RecordError(
                f"{table.origin.name}: no column is known as time; if {column!r} is, say so with "
                f"columns={{'time': {column!r}}}, or give the sampling period with dt= (--dt) in seconds."
            )
    counted = "only a sample index" if has_index else "no time column"
    return RecordError(f"{table.origin.name}: has {counted}; give the sampling period with dt= (--dt) in seconds.")


def _named_column(column: str | int, names: Sequence[str], table: RawTable) -> int:
    """Position of the column that the user names as time."""
    if isinstance(column, str):
        same = [i for i, name in enumerate(names) if name.strip().upper() == column.strip().upper()]
        if same:
            return same[0]
        if not column.lstrip("-").isdigit():
            shown = ", ".join(filter(None, names[:20])) or "without names: give a number from 0"
            raise RecordError(f"{table.origin.name}: has no column {column!r} for TIME; its columns are {shown}.")
    if not 0 <= int(column) < table.width:
        raise RecordError(
            f"{table.origin.name}: has no column {column} for TIME; they are numbered 0 to {table.width - 1}."
        )
    return int(column)


def _mostly_stamps(cells: Sequence[str]) -> bool:
    return bool(cells) and 2 * sum(map(is_timestamp, cells)) > len(cells)


def _is_time_column(table: RawTable, position: int, name: str = "") -> bool:
    """Whether a column without a heading of time holds time stamps, or under a blank heading counts since a date."""
    cells = table.sample_column(position)
    if _mostly_stamps(cells):
        return True
    if _heading_word(name) not in INDEX_WORDS:
        return False
    values = np.array([parse_number(cell, table.decimal) for cell in cells])
    return len(values) > 1 and bool(np.isfinite(values).all()) and find_epoch(values) is not None


def _is_fraction(name: str, table: RawTable, position: int) -> bool:
    """Whether a column holds the fraction of the second: by its heading and numbers below one second."""
    scale = _FRACTIONS.get(_heading_word(name))
    cells = table.sample_column(position) if scale else []
    values = [parse_number(cell, table.decimal) for cell in cells]
    return scale is not None and bool(values) and all(v == v and 0 <= v * scale < 1.0 - 1e-12 for v in values)


def _choose(candidates: Sequence[int], table: RawTable, options: ReadOptions) -> tuple[list[int], list[str]]:
    """Take a date and a time of day out of several time columns, or else the first."""
    if len(candidates) < 2:
        return list(candidates), []
    cells = {i: table.sample_column(i) or [""] for i in candidates}
    dates = [i for i in candidates if is_date(re.sub(MIDNIGHT, "", cells[i][0]))]
    others = [i for i in candidates if i not in dates[:1]]
    clocks = [i for i in candidates if is_clock(cells[i][0])]
    clocks += [i for i in others if dates and (_DOTTED_CLOCK.fullmatch(cells[i][0]) or is_compact_clock(cells[i]))]
    if options.time_format and _fits_format(
        f"{cells[candidates[0]][0]} {cells[candidates[1]][0]}", options.time_format
    ):
        dates, clocks = list(candidates[:1]), list(candidates[1:2])
    chosen = [dates[0], clocks[0]] if dates and clocks else list(candidates[:1])
    if len(chosen) == len(candidates):
        return chosen, []
    return chosen, [f"Of {len(candidates)} time columns the first is used for all signals."]


def _fits_format(stamp: str, time_format: str) -> bool:
    try:
        return datetime.strptime(stamp, time_format) is not None
    except ValueError:
        return False


def is_numeric_column(table: RawTable, position: int) -> bool:
    """Whether most cells of a column in the first rows are numbers."""
    cells = table.sample_column(position)
    return 2 * sum(is_number(cell, table.decimal) for cell in cells) > len(cells)
