"""Which columns of a table tell the time: by their headings, by what they hold, or as the user says."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError, Setting
from stiction.sources.roles.vocabulary import INDEX_WORDS, TIME_UNITS, TIME_WORDS, UNIT_IN_BRACKETS, without_unit
from stiction.sources.table import find_column
from stiction.sources.time.numeric_time import find_epoch, is_compact_clock
from stiction.sources.time.text_column import parse_by_strptime
from stiction.sources.time.text_stamps import is_clock, is_date, is_timestamp
from stiction.sources.values.number_text import is_number, parse_number

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from numpy.typing import NDArray

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable

__all__ = [
    "TimeColumns",
    "find_time_columns",
    "is_stamp_column",
    "is_time_heading",
    "missing_time_error",
    "seconds_per_unit",
]

MIDNIGHT = r"[T ]00:00(?::00(?:\.0+)?)?$"
"""Time of day that a program writes behind a date."""


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


@lru_cache(maxsize=4096)
def is_time_heading(name: str) -> bool:
    """Whether a column name is one of time, such as "Time [s]" or "time_ms"."""
    word = _heading_word(name).lstrip("_")
    head, _, tail = word.replace("_", " ").rpartition(" ")
    return word in TIME_WORDS or word.replace("_", " ") in TIME_WORDS or (head in TIME_WORDS and tail in TIME_UNITS)


def seconds_per_unit(name: str, unit: str = "") -> float | None:
    """Return the seconds per unit of a time column by its heading or its unit, None where neither tells."""
    bracketed = UNIT_IN_BRACKETS.search(name)
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
    """Find the time columns, but `taken` ones, by headings, units and first rows, unless named by the user."""
    names = [*headings, *[""] * (table.width - len(headings))]
    free = [i for i in range(table.width) if i not in taken]
    if "time" in options.columns:
        named, last = options.columns["time"], table.width - 1
        candidates = [find_column(named, names, range(table.width), last, "the time", table.origin.name)]
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
    if fraction is not None and not (candidates and is_stamp_column(table, candidates[0])):
        candidates, fraction = sorted({*candidates, fraction}), None
    positions = _date_and_clock(candidates, table, options.time_format) or candidates[:1]
    several = f"Of {len(candidates)} time columns the first is used for all signals."
    return TimeColumns(
        positions=tuple(positions),
        fraction=fraction,
        fraction_unit=1e-3 if fraction is None else TIME_UNITS[_heading_word(names[fraction])],
        unit=seconds_per_unit(names[positions[0]], "".join(units[positions[0] :][:1])) if positions else None,
        index=index,
        candidates=tuple(candidates),
        notes=(several,) if len(positions) < len(candidates) else (),
    )


def missing_time_error(table: RawTable, headings: Sequence[str], used: Collection[int]) -> RecordError:
    """Make the error for a table without time or period: it names a column that may be time, of no `used` one."""
    give_dt = ("give the sampling period with ", Setting("dt"), " in seconds")
    has_index = bool(table.header) and 0 not in used and _heading_word("".join(headings[:1])) in INDEX_WORDS
    for i in sorted({*range(int(has_index), table.width)} - {*used}):
        steps = np.diff(_sample_numbers(table, i))
        if (steps.size > 0 and ((steps > 0).all() or (steps < 0).all())) or is_stamp_column(table, i):
            column = headings[i] if i < len(headings) and headings[i] else i
            return RecordError(
                "no column was recognised as the time",
                remedy=(f"if it is {column!r}, name it with ", Setting("columns", {"time": column}), ", or ", *give_dt),
                where=table.origin.name,
            )
    counted = "only a sample index" if has_index else "no time column"
    return RecordError(f"has {counted}", remedy=give_dt, where=table.origin.name)


def is_numeric_column(table: RawTable, position: int) -> bool:
    """Whether most cells of a column in the first rows are numbers."""
    cells = table.sample_column(position)
    return 2 * sum(is_number(cell, table.decimal) for cell in cells) > len(cells)


def _heading_word(name: str) -> str:
    return without_unit(name).upper()


def _sample_numbers(table: RawTable, position: int) -> NDArray[np.float64]:
    return np.array([parse_number(cell, table.decimal) for cell in table.sample_column(position)])


def is_stamp_column(table: RawTable, position: int) -> bool:
    """Whether most cells of a column in the first rows are time stamps."""
    cells = table.sample_column(position)
    return bool(cells) and 2 * sum(map(is_timestamp, cells)) > len(cells)


def _is_time_column(table: RawTable, position: int, name: str = "") -> bool:
    """Whether a column without a heading of time holds time stamps, or under a blank heading counts since a date."""
    if is_stamp_column(table, position):
        return True
    values = _sample_numbers(table, position) if _heading_word(name) in INDEX_WORDS else np.array([])
    return len(values) > 1 and bool(np.isfinite(values).all()) and find_epoch(values) is not None


def _is_fraction(name: str, table: RawTable, position: int) -> bool:
    """Whether a column holds the fraction of the second: by its heading and numbers below one second."""
    scale = TIME_UNITS.get(_heading_word(name), 1.0)
    values = _sample_numbers(table, position) * scale if scale < 1.0 else np.array([])
    return len(values) > 0 and bool(((values >= 0.0) & (values < 1.0 - 1e-12)).all())


def _date_and_clock(candidates: Sequence[int], table: RawTable, time_format: str | None) -> list[int]:
    """Take a date and a time of day out of several time columns; empty where there are none."""
    first = {i: "".join(table.sample_column(i)[:1]) for i in candidates}
    if time_format and len(candidates) > 1:
        joined = f"{first[candidates[0]]} {first[candidates[1]]}"
        if np.isfinite(parse_by_strptime(joined, time_format)[0]):
            return list(candidates[:2])
    date = next((i for i in candidates if is_date(re.sub(MIDNIGHT, "", first[i]))), None)
    if date is None:
        return []
    clocks = [i for i in candidates if is_clock(first[i])]
    clocks += [i for i in candidates if i != date and re.fullmatch(r"\d{1,2}\.\d{2}\.\d{2}", first[i])]
    clocks += [i for i in candidates if i != date and is_compact_clock(table.sample_column(i))]
    return [date, *clocks[:1]] if clocks else []
