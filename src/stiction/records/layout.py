"""Which signals of a table share their times, and the table laid out with a row for each time where they do not."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from datetime import datetime
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError
from stiction.records.columns import Assignment, assign, choose_names, time_unit
from stiction.records.compact import is_compact_clock, with_colons
from stiction.records.dialects import MISSING_WORDS
from stiction.records.epochs import parse_numbers
from stiction.records.long_table import LongTable, apart, long_columns, widened
from stiction.records.numbers import to_numbers
from stiction.records.timestamps import is_clock, is_date, is_stamp, parse_texts

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.records.table import Table
    from stiction.records.timestamps import Stamps

__all__ = ["MIN_ROWS", "Options", "find_time", "is_loop", "laid_out", "stamps_of", "unit_of_time"]

MIN_ROWS = 10
"""Rows that a loop has at least [-]."""
SPARSE, LONGEST_BLANK = 0.5, 20
"""Share of the first rows that hold both OP and PV below which each is stored at its own times, and rows in a row
without one of them up to which that is so [-]; more are gaps."""

_DOTTED = re.compile(r"\d{1,2}\.\d{2}\.\d{2}")


@dataclass(frozen=True)
class Options:
    """What the user said; see `stiction.records.read`."""

    dt: float | None = None
    tag: str | None = None
    columns: Mapping[str, str | int] | None = None
    loop_type: str | None = None
    time_format: str | None = None
    op_range: tuple[float, float] | None = None
    mv_range: tuple[float, float] | None = None
    day_first: bool | None = None


def laid_out(table: Table, options: Options) -> list[tuple[Table, Options]]:
    """Lay a table out with a row for each time and a column for each signal.

    Parameters
    ----------
    table : Table
        The table as it was read.
    options : Options
        What the user said of it.

    Returns
    -------
    list of (Table, Options)
        One table, or one for each loop where these have times of their own; the options by its column names.

    Raises
    ------
    RecordError
        When a long table has no time column, or its stamps are not understood.
    """
    names, units = choose_names(table.header)
    if not names:
        return [(table, options)]
    named = {signal: _name_of(column, names) for signal, column in (options.columns or {}).items()}
    given = assign(names, len(names), {s: column for s, column in named.items() if column in names}, table.source.name)
    loops = {tag: signals for tag, signals in given.loops.items() if is_loop(signals)}
    laid: list[LongTable] = []
    if not loops:
        if columns := long_columns(names, () if given.chosen else table.sample, table.decimal):
            laid = [_widened(table, columns, given, names, units, options)]
    elif times := _own_times(given, names, table):

        def parse(time: int, cells: list[str]) -> Stamps:
            return stamps_of([time], {time: cells}, table, names, units, options)

        several = len(set(times.values())) > 1
        asked = [tag for tag in loops if options.tag is None or tag.lower() == options.tag.lower()]
        shared = given.loops.get("", {}).values()
        groups = [sorted({*loops[tag].values(), *shared}) for tag in asked] if several else []
        laid = apart(table, names, units, times, groups or [list(times)], parse, ("",) if several else MISSING_WORDS)
    own = replace(options, columns={signal: i for signal, i in named.items() if signal.lower() != "time"})
    return [(one, own) for one in laid] or [(table, options)]


def _name_of(column: str | int, names: list[str]) -> str | int:
    """The column's name as it is written; what is none stays, lest it be the tag of a long table."""
    if isinstance(column, str):
        same = [name for name in names if name.strip().upper() == column.strip().upper()]
        if same or not column.isdecimal():
            return same[0] if same else column
    return names[int(column)] if 0 <= int(column) < len(names) else column


def is_loop(signals: dict[str, int]) -> bool:
    """Whether signals make a loop: OP, and PV or the valve's position."""
    return "op" in signals and ("pv" in signals or "mv" in signals)


def _own_times(given: Assignment, names: list[str], table: Table) -> dict[int, int]:
    """Column -> column of its time stamps where the signals of a table are not stored at the same times; else empty.

    Time columns of one name, each before its signals, are such. Others say the same time in another way.
    """
    used = sorted({i for signals in given.loops.values() for i in signals.values()})
    times = [max((time for time in given.time if time < i), default=-1) for i in used]
    if len(given.time) > 1:
        same = len({names[i].strip().upper() for i in given.time}) == 1
        return dict(zip(used, times, strict=True)) if same and set(times) == set(given.time) else {}
    if not given.time or given.tag is not None:
        return {}
    whole = [signals for signals in given.loops.values() if "op" in signals and "pv" in signals]
    return dict.fromkeys(used, given.time[0]) if any(_is_sparse(table, signals) for signals in whole) else {}


def _is_sparse(table: Table, signals: dict[str, int]) -> bool:
    """Whether OP and PV seldom stand in the same row, and neither is missing for long."""
    stored = np.array([[_stored(row, signals[role]) for role in ("op", "pv")] for row in table.sample])
    if stored.all(axis=1).mean() >= SPARSE or stored.sum(axis=0).min() < MIN_ROWS:
        return False
    return all(np.diff(np.flatnonzero(np.r_[True, there, True])).max() - 1 <= LONGEST_BLANK for there in stored.T)


def _stored(row: list[str], column: int) -> bool:
    return column < len(row) and row[column].strip().upper() not in MISSING_WORDS


def find_time(given: Assignment, table: Table, options: Options) -> None:
    """Settle the time column: by name, else a first column of stamps."""
    if not given.time and given.index is None:
        used = {i for signals in given.loops.values() for i in signals.values()}
        first = [row[0] for row in table.sample if row]
        if 0 not in used and first and 2 * sum(map(is_stamp, first)) > len(first):
            given.time = [0]
    if len(given.time) > 1:
        cells = {i: [row[i] for row in table.sample if i < len(row) and row[i].strip()] or [""] for i in given.time}
        dates = [i for i in given.time if is_date(cells[i][0])]
        beside = [i for i in given.time if i not in dates[:1]]
        clocks = [i for i in given.time if is_clock(cells[i][0])]
        clocks += [i for i in beside if dates and (_DOTTED.fullmatch(cells[i][0]) or is_compact_clock(cells[i]))]
        if options.time_format and _reads(f"{cells[given.time[0]][0]} {cells[given.time[1]][0]}", options.time_format):
            dates, clocks = given.time[:1], given.time[1:2]
        several = len(given.time)
        given.time = [dates[0], clocks[0]] if dates and clocks else given.time[:1]
        if several > len(given.time):
            given.guesses.append(f"Of {several} time columns the first is used for all signals.")
    if not given.time and options.dt is None:
        names, _ = choose_names(table.header)
        known = {given.index, *(i for signals in given.loops.values() for i in signals.values())}
        for i in sorted({*range(len(table.sample[0]))} - known):
            cells = [row[i] for row in table.sample if i < len(row)]
            steps = np.diff(to_numbers(cells, table.decimal)[0])
            one_way = len(steps) > 0 and ((steps > 0).all() or (steps < 0).all())
            if one_way or 2 * sum(map(is_stamp, cells)) > len(cells):
                column = names[i] if names and names[i] else i
                raise RecordError(
                    f"{table.source.name}: no column is known as time; if {column!r} is, say so with "
                    f"columns={{'time': {column!r}}}, or give the sampling period with dt= (--dt) in seconds."
                )
        counted = " only a sample index" if given.index is not None else " no time column"
        raise RecordError(f"{table.source.name}: has{counted}; give the sampling period with dt= (--dt) in seconds.")


def _reads(stamp: str, time_format: str) -> bool:
    """Whether a format is that of a stamp."""
    try:
        return datetime.strptime(stamp, time_format) is not None
    except ValueError:
        return False


def unit_of_time(column: int, names: list[str], units: list[str]) -> float | None:
    """Seconds per unit of a time column of numbers [s]; None where the header does not tell."""
    return time_unit(names[column] if names else "", units[column] if units else "")


def stamps_of(
    time: list[int],
    text: Mapping[int, list[str]],
    table: Table,
    names: list[str],
    units: list[str],
    options: Options,
) -> Stamps:
    """Time of each row from the cells of one column, or of a date and a time of day."""
    cells, told = text[time[0]], ""
    if len(time) == 2:
        clocks = text[time[1]]
        if options.time_format is None and is_compact_clock(clocks[:200]):
            clocks, told = with_colons(clocks)
        cells = [f"{day} {clock}" for day, clock in zip(cells, clocks, strict=True)]
    elif table.is_numeric(time[0]) and options.time_format is None:
        return parse_numbers(to_numbers(cells, table.decimal)[0], unit_of_time(time[0], names, units))
    stamps = parse_texts(cells, day_first=options.day_first, time_format=options.time_format)
    stamps.guesses += [told] if told else []
    return stamps


def _widened(
    table: Table, columns: dict[str, int], given: Assignment, names: list[str], units: list[str], options: Options
) -> LongTable:
    """Lay a long table out wide, by its time column."""
    first = [row for row in table.sample if row]
    free = [i for i in range(len(names)) if i not in columns.values()]
    stamped = [i for i in free if all(i < len(row) and is_stamp(row[i]) for row in first)]
    time = Assignment(time=given.time or stamped[:1])
    if not time.time:
        raise RecordError(f"{table.source.name}: is a long table without a time column; export the time stamps too.")
    find_time(time, table, options)
    long = widened(table, columns, time.time, lambda text: stamps_of(time.time, text, table, names, units, options))
    long.guesses += time.guesses
    return long
