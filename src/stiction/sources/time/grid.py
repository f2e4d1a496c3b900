"""From recorded stamps to an even grid: samples are picked, as a line would invent a movement of the valve."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.duration_format import format_seconds
from stiction.display.number_format import count_noun
from stiction.errors import RecordError, Setting
from stiction.records.straight_line import fit_line
from stiction.sources.time.stamps import unread_stamp_error
from stiction.sources.time.time_order import (
    MAX_SHARED_STAMPS,
    is_newest_first,
    shortest_number,
    sort_by_time,
    spread_rounded_stamps,
    to_datetime,
)

if TYPE_CHECKING:
    from datetime import datetime

    from numpy.typing import NDArray

    from stiction.sources.time.stamps import Stamps
    from stiction.sources.time.time_order import RowsDiffer

__all__ = ["Grid", "regular_grid"]


@dataclass
class Grid:
    """Which row of the source stands at each sample."""

    source_row: NDArray[np.int64]
    """Row of the source per sample, -1 where none was recorded, shape (n_samples,)."""
    dt: float
    """Sampling period [s]."""
    start: datetime | None = None
    """Time of the first sample: aware (UTC) when the stamps name a zone, naive for a wall clock, None otherwise."""
    clock_jumps: int = 0
    """Times that the clock jumped and was corrected."""
    dst_changes: int = 0
    """How many of `clock_jumps` were changes to or from summer time."""
    notes: list[str] = field(default_factory=list)
    """Assumptions, a sentence each."""


def regular_grid(
    stamps: Stamps,
    *,
    dt: float | None,
    name: str,
    first_line: int,
    max_hold: float | None = None,
    rows_differ: RowsDiffer | None = None,
) -> Grid:
    """Lay an even grid of `dt`, by default the median step [s], over the stamps; notes of these are not repeated.

    Rows whose stamps do not fit are `dt` apart in their order, but a value stands for `max_hold` [s], by default ten
    periods if uneven, in rows written on change. `rows_differ` tells whether pairs of rows do; by default all.
    """
    n_rows, t = len(stamps.seconds), stamps.seconds[np.isfinite(stamps.seconds)]
    if dt is not None and (len(t) < 2 or np.ptp(t) == 0.0):
        return Grid(
            np.arange(n_rows), dt, notes=["The time stamps cannot be used: the sampling period is the given one."]
        )
    if len(t) < 2:
        raise unread_stamp_error(stamps, name, first_line, other_remedy=(" or ", Setting("dt")))
    if np.ptp(t) == 0.0:
        raise RecordError(
            "all time stamps are equal",
            remedy=("give ", Setting("dt"), " if the rows are evenly sampled"),
            where=f"{name}, line {first_line}",
        )
    is_reversed = is_newest_first(t)
    result, rows = sort_by_time(stamps, rows_differ)
    t, notes = result.seconds, result.notes
    if n_rows > len(t):
        first = first_line + int(np.argmax(~np.isfinite(stamps.seconds)))
        lost = count_noun(n_rows - len(t), "row")
        notes.insert(0, f"Left out: {lost} without a readable time stamp (first near line {first}).")
    twice = np.flatnonzero(np.diff(t) == 0.0)
    are_copies = rows_differ is not None and twice.size > 0 and not rows_differ(rows[twice], rows[twice + 1]).any()
    if not are_copies:
        t = spread_rounded_stamps(t, rows, stamps.resolution, notes)
    if dt is not None and max_hold is None and not _fits(t, dt):
        apart = " to ".join(dict.fromkeys(format_seconds(float(step)) for step in (np.diff(t).min(), np.diff(t).max())))
        note = (
            f"The rows are taken as {dt:g} s apart{', the last one first,' if is_reversed else ''} in the order they "
            f"come, as dt is given: the time stamps ({apart} apart) do not fit it and are not used."
        )
        rows = np.arange(n_rows)[:: -1 if is_reversed else 1]
        return Grid(rows, dt, to_datetime(float(t[0]), stamps.kind), notes=[note])
    is_last = _is_last_of_stamp(t, rows, notes, name, rows_differ)
    t, rows = t[is_last], rows[is_last]
    source_row, dt = _place_rows(t, rows, dt, notes, name, max_hold)
    start = to_datetime(float(t[0]), stamps.kind)
    return Grid(source_row, dt, start, result.clock_jumps, result.dst_changes, notes)


def _fits(t: NDArray, dt: float) -> bool:
    """Whether stamps are those of rows `dt` apart, with gaps."""
    steps = np.diff(t) / dt
    whole = np.round(steps)
    is_usual = bool(np.median(whole) == 1.0) and whole.sum() <= max(20 * len(t), 10_000)
    return is_usual and bool((whole >= 1.0).all() and np.abs(steps - whole).max() <= 0.3)


def _is_last_of_stamp(
    t: NDArray, rows: NDArray, notes: list[str], name: str, rows_differ: RowsDiffer | None
) -> NDArray[np.bool_]:
    """Mark the last row of each stamp; refuse a record that loses many rows so."""
    is_last = np.append(np.diff(t) > 0, True)
    twice = np.flatnonzero(~is_last)
    if twice.size:
        n_other = twice.size if rows_differ is None else int(rows_differ(rows[twice], rows[twice + 1]).sum())
        if n_other > MAX_SHARED_STAMPS * len(t):
            shared = f"{n_other} of {len(t)} rows have the same time stamp as"
            limit = f"but other values (at most {100.0 * MAX_SHARED_STAMPS:g} % may)"
            if np.median(np.abs(rows[twice + 1] - rows[twice])) <= 1:
                raise RecordError(
                    f"{shared} the next row {limit}, so the stamps are rounded",
                    where=name,
                    remedy=(
                        "export stamps with more digits, or, if the rows are evenly sampled, give the sampling period "
                        "with ",
                        Setting("dt"),
                        " in seconds",
                    ),
                )
            raise RecordError(
                f"{shared} another row {limit}; when the file contains two exports one below the other, save "
                "each as a file of its own.",
                where=name,
            )
        values = f", {count_noun(n_other, 'row')} of them with other values" if n_other else ""
        notes.append(f"Left out: {count_noun(twice.size, 'row')} with the same time stamp as the next row{values}.")
    return is_last


def _place_rows(
    t: NDArray, rows: NDArray, dt: float | None, notes: list[str], name: str, max_hold: float | None
) -> tuple[NDArray[np.int64], float]:
    """Put each row at its sample: on a grid that all stamps fit, or else the last row at or before each sample."""
    steps = np.diff(t)
    median = float(np.median(steps))
    period = dt or median
    with np.errstate(over="ignore"):  # a damaged file may hold steps of 1e-300 s: the error below names them
        whole = np.maximum(np.round(steps / period), 1.0)
    place = np.concatenate([[0.0], np.cumsum(whole)])
    if place[-1] > max(20 * len(t), 10_000):
        k = int(np.argmax(steps))
        raise RecordError(
            f"rows {rows[k] + 1} and {rows[k + 1] + 1} of the data are {steps[k]:.6g} s apart, but the sampling "
            f"period is {period:.6g} s",
            remedy=("cut the file there, or give ", Setting("dt")),
            where=name,
        )
    if dt is None:  # the slope over all rows, so that a period of 9.999 s does not drift
        slope = fit_line(place, t - t[0]).slope
        period = shortest_number(slope, 1e-5 * slope)
    off = t - place * period
    is_even = (dt is not None and max_hold is None) or np.ptp(off) <= 0.6 * period
    longest = max_hold or 0.0
    if not is_even:
        period = dt or shortest_number(median, 1e-5 * median)
        place, longest = (t - t[0]) / period, max(10.0 * period, longest)
        notes.append(
            f"The stamps are uneven ({format_seconds(steps.min())} to {format_seconds(steps.max())}): each value is "
            f"used until the next one, every {period:.6g} s, for at most {format_seconds(longest)}."
        )
    samples = np.arange(int(place[-1] + 1e-6) + 1)
    last = np.searchsorted(place, samples + 1e-6, side="right") - 1
    source_row = np.where((samples - place[last]) * period <= longest + 1e-6 * period, rows[last], -1)
    if is_even and (n_missing := int((source_row < 0).sum())):
        samples, gaps = count_noun(n_missing, "sample"), count_noun(int((whole > 1).sum()), "gap")
        notes.append(f"Missing: {samples} in {gaps} of the time stamps (not filled).")
    return source_row, period
