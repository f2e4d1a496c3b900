"""Pairs: each tag, or each group of tags, has a column of time stamps before it (PI DataLink)."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from stiction.sources.layouts.headings import (
    find_clock,
    heading_column,
    parse_role,
    pick_rows,
    pick_stamps,
    share_clocks,
    table_headings,
    written_mask,
)
from stiction.sources.roles.column_names import normalise_name
from stiction.sources.roles.vocabulary import VALUE_WORDS
from stiction.sources.time.time_columns import is_stamp_column, is_time_heading

if TYPE_CHECKING:
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import Clock, RawTable, TagColumn

__all__ = ["read"]


def _time_positions(table: RawTable) -> list[int]:
    """Find the columns of time before signals, their headings equal, blank or the name of the signal; else none."""
    names = table_headings(table).names
    # pandas and Excel put a number after a repeated heading, `Time.1`; but T1 may be a temperature.
    plain = [re.sub(r"[._ ]?\d{1,3}$", "", name.strip()) for name in names]
    times = [
        i
        for i, name in enumerate(names)
        if is_time_heading(name) or (is_time_heading(plain[i]) and is_stamp_column(table, i))
    ]
    if len(times) < 2 and sum(not name.strip() or parse_role(name) is not None for name in names) >= len(names) - 1:
        first_row = table.sample[0][: table.width] if table.sample else []
        times = [i for i, cell in enumerate(first_row) if ":" in cell and is_stamp_column(table, i)]
    elif len({normalise_name(plain[i]) for i in times}) > 1:
        return []
    ends = [*times[1:], table.width]
    return times if times[:1] == [0] and all(end - i > 1 for i, end in zip(times, ends, strict=True)) else []


def read(table: RawTable, options: ReadOptions) -> list[TagColumn] | None:
    """Give the signals of a table, each with the times of the column before it; equal times are one clock."""
    times = [] if "time" in options.columns else _time_positions(table)
    if len(times) < 2:
        return None
    names, units, _ = table_headings(table)
    table.load(times)
    # A pair may end before the longest one of the table.
    rows = {time: written_mask(table.column(time)).arg_true().to_numpy() for time in times}
    own: dict[int, Clock] = {}
    for time in times:
        clock, _ = find_clock(table, options, only=time)
        if clock is not None:
            own[time] = pick_stamps(clock, rows[time])
    clocks = dict(zip(own, share_clocks(list(own.values())), strict=True))
    table.drop(times)
    is_one_clock = len(set(map(id, clocks.values()))) == 1
    if is_one_clock:
        table.notes.append(f"The {len(times)} time columns contain the same times.")
    columns = []
    for i in range(table.width):
        time = max(time for time in times if time <= i)
        if i == time or time not in clocks:
            continue
        column = heading_column(table, i, None)
        if parse_role(names[time]) is not None:  # the heading of the time names the signal
            column.unit = column.unit or units[time]
            if not names[i].strip() or normalise_name(names[i]) in VALUE_WORDS:
                column.name = names[time]
        columns.append(pick_rows(column, rows[time], clocks[time], own_clock=not is_one_clock))
    return columns
