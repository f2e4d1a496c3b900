"""Rows in the order of time: files turned round, clock changes undone, the rest sorted, rounded stamps made even."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.duration_format import format_seconds
from stiction.display.number_format import count_noun

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from stiction.sources.time.stamps import Stamps

    RowsDiffer = Callable[[NDArray[np.int64], NDArray[np.int64]], NDArray[np.bool_]]

__all__ = [
    "MAX_SHARED_STAMPS",
    "has_two_levels",
    "is_newest_first",
    "shortest_number",
    "sort_by_time",
    "spread_rounded_stamps",
    "to_datetime",
]

MAX_SHARED_STAMPS = 0.1
"""Share of the rows that may have the stamp of another one and other values [-]."""
_HOUR = 3600.0


def sort_by_time(stamps: Stamps, rows_differ: RowsDiffer | None = None) -> tuple[Stamps, NDArray[np.int64]]:
    """Sort valid time stamps and undo clock changes; the notes are on that only.

    `rows_differ` tells for pairs of rows whether they do; without it no clock counts as set back.
    """
    rows = np.flatnonzero(np.isfinite(stamps.seconds))
    result = replace(stamps, seconds=stamps.seconds[rows], notes=[])
    if is_newest_first(result.seconds):
        result.seconds, rows = result.seconds[::-1], rows[::-1]
        result.notes.append("The file begins with the newest row, so its order was reversed.")
    steps = np.diff(result.seconds)
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    if stamps.kind == "local" and 0.0 < usual < _HOUR / 2:
        _undo_summer_time(result, usual)
    if rows_differ is not None:
        _undo_set_back(result, rows, usual, rows_differ)
    if n_back := int((np.diff(result.seconds) < 0).sum()):
        result.clock_jumps += n_back
        result.notes.append(
            f"The rows are not in the order of time, which steps back {count_noun(n_back, 'time')}: they were sorted."
        )
        order = np.argsort(result.seconds, kind="stable")
        result.seconds, rows = result.seconds[order], rows[order]
    return result, rows


def is_newest_first(seconds: NDArray[np.float64]) -> bool:
    """Whether rows run from the newest to the oldest, nine of ten steps at least."""
    steps = np.diff(seconds)
    return bool((steps < 0).sum() > 0.9 * np.count_nonzero(steps))


def to_datetime(seconds: float, kind: str) -> datetime | None:
    """Return the moment that seconds since 1970 mean, aware of its zone when the stamps are; None without a date."""
    if kind == "relative":
        return None
    return datetime(1970, 1, 1, tzinfo=UTC if kind == "utc" else None) + timedelta(seconds=round(seconds, 6))


def _undo_summer_time(result: Stamps, usual: float) -> None:
    """Undo the hour that a wall clock repeats in autumn and skips in spring, on a Sunday from midnight to three."""
    seconds = result.seconds.copy()
    excess = np.diff(seconds) - usual
    for k in np.flatnonzero(np.abs(np.abs(excess) - _HOUR) < 0.5 * usual):
        moment = datetime(1970, 1, 1) + timedelta(seconds=round(float(result.seconds[k]), 6))
        about = moment + timedelta(minutes=5)
        if about.weekday() == 6 and 60 * about.hour + about.minute <= 190 and about.month in (3, 4, 9, 10, 11):
            seconds[k + 1 :] -= np.sign(excess[k]) * _HOUR
            result.clock_jumps += 1
            result.dst_changes += 1
            way, season = ("forward", "start") if excess[k] > 0 else ("back", "end")
            result.notes.append(f"The clock goes {way} one hour at {moment}: taken as the {season} of summer time.")
    result.seconds = seconds


def _undo_set_back(result: Stamps, rows: NDArray[np.int64], usual: float, rows_differ: RowsDiffer) -> None:
    """Let time go on where other rows repeat it, unless times begin anew (two exports) or late rows fill a gap."""
    t = result.seconds
    backwards = np.flatnonzero(np.diff(t) < 0) + 1
    if not 0 < backwards.size <= 200:  # with more the rows are out of order
        return
    bounds = [0, *backwards.tolist(), len(t)]
    shift = np.zeros(len(t))
    for begin, at, end in zip(bounds, bounds[1:], bounds[2:], strict=False):
        before, by = t[begin:at], float(t[at - 1] - t[at]) + usual
        again = t[at : at + int(np.searchsorted(t[at:end], before[-1], side="right"))]
        # Where several rows have one time, the first is compared with the first, the second with the second.
        place = np.searchsorted(before, again) + np.arange(len(again)) - np.searchsorted(again, again)
        right = np.minimum(place, len(before) - 1)
        left = np.maximum(right - 1, 0)
        near = np.where(again - before[left] < before[right] - again, left, right)
        repeated = np.flatnonzero(np.abs(again - before[near]) <= 0.75 * usual)
        if t[at] <= t[0] or len(repeated) < max(3, 0.5 * len(again)):
            continue
        if rows_differ(rows[begin + near[repeated]], rows[at + repeated]).mean() > MAX_SHARED_STAMPS:
            shift[at:] += by
            result.clock_jumps += 1
            result.notes.append(
                f"The clock was set back by {format_seconds(by)} at row {rows[at] + 1} of the data: the rows from "
                "there on are placed after the last row before it."
            )
    result.seconds = t + shift


def spread_rounded_stamps(
    seconds: NDArray[np.float64], rows: NDArray[np.int64], resolution: float, notes: list[str]
) -> NDArray[np.float64]:
    """Spread ascending rows that share stamps evenly, or move stamps rounded to `resolution` [s]; copies stay."""
    first = np.flatnonzero(np.diff(seconds, prepend=np.nan) != 0.0)
    values, counts = seconds[first], np.diff(first, append=len(seconds))
    per_stamp = float(np.mean(counts[1:-1])) if len(values) >= 4 else 1.0
    if per_stamp < 1.2:
        return _spread_by_resolution(seconds, resolution, notes) if resolution > 0.0 else seconds
    extent = np.maximum.reduceat(rows, first) - np.minimum.reduceat(rows, first)
    if np.mean(extent == counts - 1) < 0.9:  # the same time twice in a file is no rounding
        return seconds
    step, usual = float(np.median(np.diff(values))), int(np.median(counts[1:-1]))
    if usual >= 2 and np.mean(counts[1:-1] == usual) >= 0.9:
        place = np.arange(len(seconds)) - np.repeat(first, counts)
        place[: counts[0]] += max(0, usual - int(counts[0]))
        even = seconds + place * step / np.maximum(usual, np.repeat(counts, counts))
        dt = step / usual
    else:
        even, dt = _fit_even_times(seconds, step, (values[-1] - values[1]) / (first[-1] - first[1]))
    if dt > 0.0:
        shared = f"{usual}" if dt * usual == step else f"About {step / dt:.3g}"
        notes.append(f"{shared} rows share each stamp (rounded to {step:g} s): taken as {dt:g} s apart.")
    return even


def _fit_even_times(seconds: NDArray, step: float, dt: float) -> tuple[NDArray, float]:
    """Even times of about `dt` that are the stamps when rounded down to `step`; the stamps and 0 if there are none."""
    place = np.arange(len(seconds))

    def spread(period: float) -> float:
        return float(np.ptp(seconds - period * place))

    low, high = 0.8 * dt, 1.2 * dt
    for _ in range(40):  # the spread is convex in the period
        third = (high - low) / 3.0
        low, high = (low, high - third) if spread(low + third) < spread(high - third) else (low + third, high)
    periods = (*(float(f"{low:.{digits}g}") for digits in range(1, 6)), low)
    period = next((period for period in periods if spread(period) < step), 0.0)
    return (float((seconds - period * place).max()) + period * place if period else seconds), period


def _spread_by_resolution(seconds: NDArray, resolution: float, notes: list[str]) -> NDArray:
    """Make stamps even, gaps kept, whose steps are one of two neighbouring multiples of the resolution [s]."""
    counts = np.bincount(np.clip(np.round(np.diff(seconds) / resolution), 0, 101).astype(np.int64), minlength=102)
    fewer = int(np.argmax(counts[:100] + counts[1:101]))
    if len(seconds) < 30 or not (counts[fewer] and counts[fewer + 1]):
        return seconds
    even, dt = None, 0.0
    if fewer == 0:  # gaps do not show where the period is shorter than the resolution
        even, dt = _fit_even_times(seconds, 1.001 * resolution, float(np.ptp(seconds)) / (len(seconds) - 1))
    low, high = max(fewer, 1.01) * resolution, (fewer + 1) * resolution
    for unit in (60.0, 30.0, 10.0, 5.0, 1.0, 0.5, 0.1, 0.05, 0.01):
        for period in unit * np.arange(np.floor(low / unit) + 1.0, np.ceil(high / unit))[::-1]:
            if even is None:
                even, dt = _even_times_with_gaps(seconds, resolution, period), float(period)
    if even is None or dt == 0.0:
        return seconds
    notes.append(f"The stamps are rounded to {resolution:g} s: taken as {dt:g} s apart.")
    return even


def _even_times_with_gaps(seconds: NDArray, resolution: float, dt: float) -> NDArray | None:
    """Times `dt` apart, with gaps, that are the stamps when rounded to `resolution`; None where there are none."""
    phase = np.sort((seconds - seconds[0]) % dt)
    free = np.diff(phase, append=phase[0] + dt)  # from each phase to the next, round the circle
    if free.max() < dt - 1.001 * resolution:
        return None
    begin = phase[(int(np.argmax(free)) + 1) % len(phase)]  # all phases lie within one resolution from there on
    place = np.floor((seconds - seconds[0] - begin) / dt + 1e-6)
    if np.diff(place).min() < 1.0:
        return None
    off = seconds - dt * place
    low, high = off.max() - 0.5 * resolution, off.min() + 0.5 * resolution
    middle = 0.5 * (low + high)
    return (round(middle) if low <= round(middle) <= high else middle) + dt * place


def has_two_levels(seconds: NDArray[np.float64], values: NDArray[np.float64], *, max_rows: int = 4) -> bool:
    """Whether the rows of one time, two to `max_rows`, come from several levels: series of other loops, not samples.

    The range within a time is five times what its least and its largest value change to the next time; of noise it is
    at most about three times as much.
    """
    known = np.isfinite(seconds) & np.isfinite(values)
    order = np.argsort(seconds[known], kind="stable")
    seconds, values = seconds[known][order], values[known][order]
    first = np.flatnonzero(np.diff(seconds, prepend=np.nan) != 0.0)
    counts = np.diff(first, append=seconds.size)
    extent = np.maximum.reduceat(order, first) - np.minimum.reduceat(order, first) if first.size else first
    if first.size < 10 or not 2 <= np.median(counts) <= max_rows or np.mean(extent == counts - 1) < 0.9:
        return False  # the same time twice in a file is a clock set back
    least, largest = np.minimum.reduceat(values, first), np.maximum.reduceat(values, first)
    change = max(float(np.median(np.abs(np.diff(limit)))) for limit in (least, largest))
    return float(np.median(largest - least)) > 5.0 * change


def shortest_number(value: float, near: float) -> float:
    """Give the number of fewest digits, at most five, no further away than `near`; else the value itself."""
    shorter = (float(f"{value:.{digits}g}") for digits in range(1, 6))
    return next((short for short in shorter if abs(short - value) <= near), value)
