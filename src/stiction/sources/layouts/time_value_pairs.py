"""Pairs: each tag, or each group of tags, has a column of time stamps before it (PI DataLink)."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from stiction.sources.layouts.headings import find_clock, heading_column, is_stamp_column, parse_role, table_headings
from stiction.sources.layouts.row_groups import gather_rows, select_stamps, shared_clocks
from stiction.sources.roles.column_names import normalise_name
from stiction.sources.roles.vocabulary import VALUE_WORDS
from stiction.sources.time.parse import is_time_heading

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    import polars as pl
    from numpy.typing import NDArray

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable
    from stiction.sources.tag_column import TagColumn
    from stiction.sources.time.stamps import Stamps

__all__ = ["read", "recognises"]

_REPEAT_NUMBER = re.compile(r"[._ ]?\d{1,3}$")


def recognises(table: RawTable, options: ReadOptions) -> bool:
    """Whether several columns of time stand in the table, each before columns of signals, under the same heading.

    That heading may also be blank, or name the signal.
    """
    return "time" not in options.columns and len(_time_positions(table)) > 1


def _time_positions(table: RawTable) -> list[int]:
    """Find the columns of time; empty when they are not of this layout."""
    names = table_headings(table).names
    times = [i for i, name in enumerate(names) if is_time_heading(name) or _is_repeated_time(table, i, name)]
    if len(times) > 1:
        same = len({normalise_name(_without_number(names[i])) for i in times}) == 1
        return times if same and _stand_before_signals(times, table.width) else []
    first_row = table.sample[0] if table.sample else []
    if sum(not name.strip() or parse_role(name) is not None for name in names) < len(names) - 1:
        return []
    times = [i for i, cell in enumerate(first_row[: table.width]) if ":" in cell and is_stamp_column(table, i)]
    return times if len(times) > 1 and _stand_before_signals(times, table.width) else []


def _without_number(name: str) -> str:
    """Cut the number that pandas and Excel put after a repeated heading: ``Time.1``."""
    return _REPEAT_NUMBER.sub("", name.strip())


def _is_repeated_time(table: RawTable, position: int, name: str) -> bool:
    """Whether a heading of time with a number after it stands over time stamps; T1 may be a temperature."""
    return is_time_heading(_without_number(name)) and is_stamp_column(table, position)


def _stand_before_signals(times: Sequence[int], width: int) -> bool:
    return times[0] == 0 and all(after - before > 1 for before, after in zip(times, [*times[1:], width], strict=True))


def read(table: RawTable, options: ReadOptions) -> list[TagColumn]:
    """Give the signals of a table, each with the times of the column before it.

    Signals with the same time stamps share a clock.
    """
    names, units, _ = table_headings(table)
    times = _time_positions(table)
    table.load(times)
    rows = {time: _written_rows(table.column(time)) for time in times}
    stamps: dict[int, Stamps] = {}
    for time in times:
        clock, _ = find_clock(table, options, only=time)
        if clock is not None:
            stamps[time] = select_stamps(clock.stamps, rows[time])
    clocks = dict(zip(stamps, shared_clocks(list(stamps.values())), strict=True))
    table.drop(times)
    is_one_clock = len({id(clock) for clock in clocks.values()}) == 1
    if is_one_clock:
        table.notes.append(f"The {len(times)} time columns hold the same times.")
    columns = []
    for i in range(table.width):
        time = max(time for time in times if time <= i)
        if i == time or time not in clocks:
            continue
        above_time = parse_role(names[time]) is not None
        blank = not names[i].strip() or normalise_name(names[i]) in VALUE_WORDS
        column = heading_column(table, i, clocks[time])
        columns.append(
            replace(
                column,
                name=names[time] if above_time and blank else names[i],
                load=partial(gather_rows, table, i, rows[time]),
                unit=column.unit or (units[time] if above_time else ""),
                own_clock=not is_one_clock,
            )
        )
    return columns


def _written_rows(times: pl.Series) -> NDArray[np.integer]:
    """Give the rows with a time stamp; a pair may end before the longest one of the table."""
    import polars as pl

    written = times.is_not_null()
    if times.dtype == pl.String:
        written &= times.str.strip_chars() != ""
    return written.arg_true().to_numpy()
