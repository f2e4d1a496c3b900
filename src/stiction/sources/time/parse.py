"""The time of each row of a table."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from stiction.display.number_format import count_noun
from stiction.sources.options import FIXED_OFFSET
from stiction.sources.table import SNIFF_ROWS
from stiction.sources.time.numeric_time import compact_clock_seconds, is_compact_clock, parse_numeric_time
from stiction.sources.time.stamps import Stamps, unwrap_clock
from stiction.sources.time.text_column import find_first_unread, parse_text_stamps
from stiction.sources.time.time_columns import MIDNIGHT, is_numeric_column
from stiction.sources.time.time_order import is_newest_first, to_datetime
from stiction.sources.values.numeric_cells import parse_numbers

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable
    from stiction.sources.time.time_columns import TimeColumns

__all__ = ["localise", "parse_time"]


def parse_time(table: RawTable, time_columns: TimeColumns, options: ReadOptions) -> Stamps:
    """Parse the time columns of a table, which `find_time_columns` found."""
    fraction = time_columns.fraction
    positions = [*time_columns.positions, *([] if fraction is None else [fraction])]
    table.load(positions)
    first, *second = (table.column(i) for i in time_columns.positions)
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
        stamps = parse_text_stamps(first.cast(pl.String), day_first=options.day_first, time_format=options.time_format)
    if fraction is not None and not (np.nan_to_num(stamps.seconds) % 1.0).any():
        parts = parse_numbers(table.column(fraction), table.decimal).values
        stamps.seconds = stamps.seconds + np.nan_to_num(parts) * time_columns.fraction_unit
    if stamps.kind != "relative":
        # Years before 1900 or after 2200 stand for no date, as 0001-01-01 does in some databases.
        is_likely = (stamps.seconds >= -2208988800.0) & (stamps.seconds < 7258118400.0)
        stamps.seconds = np.where(is_likely, stamps.seconds, np.nan)
        stamps.first_unread = find_first_unread(first, stamps.seconds)
    stamps.notes[:0] = time_columns.notes
    if options.timezone is None:
        return stamps
    if stamps.kind == "utc":
        stamps.notes.append(f"timezone = {options.timezone} is not used, as the time stamps name their zone.")
        return stamps
    if stamps.kind == "local":
        stamps.notes.append(f"The time stamps have no time zone: they are taken as {options.timezone}.")
    return localise(stamps, options.timezone)


def _parse_temporal(cells: pl.Series) -> Stamps:
    """Convert a column that is stored as dates, times or durations."""
    if cells.dtype == pl.Duration:
        return Stamps(cells.dt.total_nanoseconds().cast(float).to_numpy() / 1e9, "relative")
    if cells.dtype == pl.Time:
        note = "The time column contains times of day without a date."
        return Stamps(unwrap_clock(cells.cast(pl.Int64).cast(float).to_numpy() / 1e9), "relative", [note])
    zone = cells.dtype.time_zone if isinstance(cells.dtype, pl.Datetime) else None
    seconds = cells.cast(pl.Datetime("us", zone)).dt.epoch("us").cast(float).to_numpy() / 1e6
    return Stamps(seconds, "utc" if zone else "local")


def _parse_date_and_clock(dates: pl.Series, clocks: pl.Series, options: ReadOptions) -> Stamps:
    """Parse a date and a time of day that stand in two columns."""
    days, times = dates.cast(pl.String), clocks.cast(pl.String)
    if options.time_format is not None:
        return parse_text_stamps(days + " " + times, time_format=options.time_format)
    days = days.str.replace(MIDNIGHT, "")
    sample = [cell for cell in times.head(SNIFF_ROWS).to_list() if cell]
    if not is_compact_clock(sample):
        times = times.str.replace(";", ".", literal=True)  # 10:00:00;250 of a trend recorder
        return parse_text_stamps(days + " " + times, day_first=options.day_first)
    stamps = parse_text_stamps(days, day_first=options.day_first)
    numbers = times.str.replace(",", ".", literal=True).cast(float, strict=False).to_numpy()
    seconds, form = compact_clock_seconds(numbers)
    stamps.seconds = stamps.seconds + seconds
    if cut := next((cell for cell in sample if len(re.split("[.,]", cell)[0]) < len(form)), ""):
        note = f"Times such as {cut} are read as hours and minutes"
        doubt = "; if seconds are among them give the sampling period (dt)"
        stamps.notes.append(f"{note}{', and seconds' if form == 'hhmmss' else doubt}.")
    return stamps


def localise(stamps: Stamps, timezone: str) -> Stamps:
    """Wall-clock stamps as UTC; of a repeated hour summer time is first, or a single pass leaves the smaller gap."""
    if stamps.kind != "local":
        return stamps
    rows = np.flatnonzero(np.isfinite(stamps.seconds))
    if is_newest_first(stamps.seconds[rows]):
        rows = rows[::-1]
    wall = stamps.seconds[rows]
    first, second = _to_utc(wall, timezone, "earliest"), _to_utc(wall, timezone, "latest")
    skipped = np.isnan(first)
    first[skipped] = second[skipped] = _to_utc(wall[skipped] - 3600.0, timezone, "earliest") + 3600.0
    is_second = np.zeros(len(rows), dtype=bool)
    changes: list[str] = []
    edges = np.flatnonzero(np.diff((first != second).astype(np.int8), prepend=0, append=0)).tolist()
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        steps = np.diff(first[begin:end])
        # Where several steps go back, those of less than ten minutes are rows out of order.
        back = np.flatnonzero(steps <= -600.0) if (steps < 0).sum() > 1 else np.flatnonzero(steps < 0)
        if back.size:
            is_second[begin + back[0] + 1 : end] = True
        else:
            before = first[begin] - first[begin - 1] if begin else np.inf
            after = second[end] - second[end - 1] if end < len(rows) else np.inf
            is_second[begin:end] = abs(after) < abs(before)
        changes.append(
            f"The clock of {timezone} shows the hour of {to_datetime(float(wall[begin]), 'local'):%Y-%m-%d %H}:00 "
            "twice: its rows are kept in the order of the file."
        )
    changes = list(dict.fromkeys(changes))  # the tags of a long table repeat the same hour
    notes = [*stamps.notes, *changes]
    if n_skipped := int(skipped.sum()):
        notes.append(
            f"{count_noun(n_skipped, 'stamp')} in an hour that the clock of {timezone} skips: taken as winter time."
        )
    seconds = np.full(len(stamps.seconds), np.nan)
    seconds[rows] = np.where(is_second, second, first)
    return replace(
        stamps, seconds=seconds, kind="utc", notes=notes,
        clock_jumps=stamps.clock_jumps + len(changes), dst_changes=stamps.dst_changes + len(changes),
    )  # fmt: skip


def _to_utc(seconds: NDArray[np.float64], timezone: str, ambiguous: str) -> NDArray[np.float64]:
    """Convert a wall clock to UTC [s]; NaN in an hour that the clock skips."""
    if fixed := FIXED_OFFSET.fullmatch(timezone):
        return seconds - float(f"{fixed[1]}60") * (60.0 * int(fixed[2]) + int(fixed[3]))
    local = pl.Series(np.round(seconds * 1e6).astype(np.int64)).cast(pl.Datetime("us"))
    utc = local.dt.replace_time_zone(timezone, ambiguous=ambiguous, non_existent="null")  # pyright: ignore
    return utc.dt.epoch("us").cast(float).to_numpy(writable=True) / 1e6
