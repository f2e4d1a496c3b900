"""The time of each row of a table."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from stiction.sources.table import SNIFF_ROWS
from stiction.sources.time.compact_clock import compact_clock_seconds, is_compact_clock
from stiction.sources.time.elapsed_time import unwrap_clock
from stiction.sources.time.numeric_time import parse_numeric_time
from stiction.sources.time.stamps import Stamps
from stiction.sources.time.text_column import parse_text_stamps
from stiction.sources.time.text_stamps import is_clock, is_date, is_timestamp
from stiction.sources.time.time_columns import (
    TimeColumns,
    find_time_columns,
    is_numeric_column,
    is_time_heading,
    missing_time_error,
    seconds_per_unit,
)
from stiction.sources.time.zones import localise
from stiction.sources.values.numeric_cells import parse_numbers

if TYPE_CHECKING:
    import polars as pl
    from numpy.typing import NDArray

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable

__all__ = [
    "TimeColumns",
    "find_time_columns",
    "is_clock",
    "is_date",
    "is_time_heading",
    "is_timestamp",
    "missing_time_error",
    "parse_time",
    "seconds_per_unit",
]

MIN_SECONDS, MAX_SECONDS = -2208988800.0, 7258118400.0
"""Years 1900 and 2200 [s since 1970]; stamps outside stand for no date, as 0001-01-01 does in some databases."""
_MIDNIGHT = r"[T ]00:00(?::00(?:\.0+)?)?$"


def parse_time(
    table: RawTable, time_columns: TimeColumns, options: ReadOptions, rows: NDArray[np.int64] | None = None
) -> Stamps:
    """Parse the time columns of a table.

    Parameters
    ----------
    table : RawTable
        The table.
    time_columns : TimeColumns
        What `find_time_columns` found, with one or two positions.
    options : ReadOptions
        `day_first`, `time_format` and `timezone` count here.
    rows : ndarray of int, optional
        Rows to parse, in this order; all when not given.

    Returns
    -------
    Stamps
        Seconds of each row, with the notes of `time_columns`.
    """
    table.load([*time_columns.positions, *([] if time_columns.fraction is None else [time_columns.fraction])])
    first, *second = (_column(table, position, rows) for position in time_columns.positions)
    if second:
        stamps = _parse_date_and_clock(first, second[0], options)
    elif first.dtype.is_temporal():
        stamps = _parse_temporal(first)
    elif first.dtype.is_numeric() or (
        options.time_format is None and is_numeric_column(table, time_columns.positions[0])
    ):
        values = parse_numbers(first, table.decimal, where=f"{table.origin.name}, time column").values
        stamps = parse_numeric_time(values, time_columns.unit)
    else:
        stamps = parse_text_stamps(_as_text(first), day_first=options.day_first, time_format=options.time_format)
    if time_columns.fraction is not None:
        fraction = parse_numbers(_column(table, time_columns.fraction, rows), table.decimal).values
        if not (np.nan_to_num(stamps.seconds) % 1.0).any():
            stamps.seconds = stamps.seconds + np.nan_to_num(fraction) * time_columns.fraction_unit
    if stamps.kind != "relative":
        _drop_unlikely_years(stamps, first)
    stamps.notes[:0] = time_columns.notes
    if options.timezone is None:
        return stamps
    if stamps.kind == "utc":
        stamps.notes.append(f"timezone = {options.timezone} is not used, as the time stamps name their zone.")
        return stamps
    stamps.notes = [note for note in stamps.notes if "is not looked up" not in note]
    return localise(stamps, options.timezone)


def _drop_unlikely_years(stamps: Stamps, cells: pl.Series) -> None:
    with np.errstate(invalid="ignore"):
        unlikely = np.flatnonzero((stamps.seconds < MIN_SECONDS) | (stamps.seconds >= MAX_SECONDS))
    if unlikely.size:
        stamps.seconds = stamps.seconds.copy()
        stamps.seconds[unlikely] = np.nan
        row = int(unlikely[0])
        if stamps.first_unread is None or stamps.first_unread[0] > row:
            stamps.first_unread = row, str(cells[row])


def _column(table: RawTable, position: int, rows: NDArray[np.int64] | None) -> pl.Series:
    cells = table.column(position)
    return cells if rows is None else cells.gather(rows)


def _as_text(cells: pl.Series) -> pl.Series:
    import polars as pl

    return cells if cells.dtype == pl.String else cells.cast(pl.String)


def _parse_temporal(cells: pl.Series) -> Stamps:
    """Convert a column that is stored as dates, times or durations."""
    import polars as pl

    if cells.dtype == pl.Duration:
        return Stamps(cells.dt.total_nanoseconds().cast(float).to_numpy() / 1e9, "relative")
    if cells.dtype == pl.Time:
        note = "The time column holds a time of day without a date."
        return Stamps(unwrap_clock(cells.cast(pl.Int64).cast(float).to_numpy() / 1e9, 86400.0), "relative", [note])
    zone = cells.dtype.time_zone if isinstance(cells.dtype, pl.Datetime) else None
    seconds = cells.cast(pl.Datetime("us", zone)).dt.epoch("us").cast(float).to_numpy() / 1e6
    return Stamps(seconds, "utc" if zone else "local")


def _parse_date_and_clock(dates: pl.Series, clocks: pl.Series, options: ReadOptions) -> Stamps:
    """Parse a date and a time of day that stand in two columns."""
    days, times = _as_text(dates), _as_text(clocks)
    if options.time_format is not None:
        return parse_text_stamps(days + " " + times, time_format=options.time_format)
    days = days.str.replace(_MIDNIGHT, "")
    sample = [cell for cell in times.head(SNIFF_ROWS).to_list() if cell]
    if not is_compact_clock(sample):
        return parse_text_stamps(days + " " + times, day_first=options.day_first)
    stamps = parse_text_stamps(days, day_first=options.day_first)
    numbers = times.str.replace(",", ".", literal=True).cast(float, strict=False).to_numpy()
    seconds, has_seconds = compact_clock_seconds(numbers)
    stamps.seconds = stamps.seconds + seconds
    width = 6 if has_seconds else 4
    if cut := next((cell for cell in sample if len(re.split("[.,]", cell)[0]) < width), ""):
        note = f"Times such as {cut} are read as hours and minutes{', and seconds' if has_seconds else ''}"
        remedy = "" if has_seconds else "; if seconds are among them give the sampling period with dt= (--dt)"
        stamps.notes.append(f"{note}{remedy}.")
    return stamps
