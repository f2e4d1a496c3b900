"""Stamps rounded to the minute, the second or a few decimals of a day: the even times that they stand for."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.sources.time.time_order import sort_by_time

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.sources.time.stamps import Stamps

__all__ = ["repair_stamps", "spread_rounded_stamps"]

_MAX_RESOLUTIONS = 100
"""Steps of the rounding per sampling period above which rounding does not matter [-]."""
_MIN_EVEN_ROWS = 30
"""Rows without a gap that tell the period of rounded stamps [-]."""


def repair_stamps(stamps: Stamps) -> Stamps:
    """Undo clock changes and spread rounded stamps of a tag that has stamps of its own; the rows stay in their order.

    Examples
    --------
    >>> from stiction.sources.time.stamps import Stamps
    >>> repair_stamps(Stamps(np.repeat([0.0, 60.0, 120.0, 180.0], 2), "relative")).seconds.tolist()
    [0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0, 210.0]
    """
    known = np.flatnonzero(np.isfinite(stamps.seconds))
    if known.size < 2:
        return stamps
    result, notes = sort_by_time(stamps.seconds[known], known, stamps.kind), []
    seconds = np.full(stamps.seconds.size, np.nan)
    seconds[result.rows] = spread_rounded_stamps(result.seconds, result.rows, stamps.resolution, notes)
    return replace(
        stamps, seconds=seconds, notes=[*stamps.notes, *result.notes, *notes],
        clock_jumps=stamps.clock_jumps + result.clock_jumps, dst_changes=stamps.dst_changes + result.dst_changes,
    )  # fmt: skip


def spread_rounded_stamps(
    seconds: NDArray[np.float64], rows: NDArray[np.int64], resolution: float, notes: list[str]
) -> NDArray[np.float64]:
    """Spread rows that share stamps evenly, or move stamps that are rounded to a known `resolution` [s].

    The stamps ascend. Rows apart from one another in the source that have one time are copies and stay.

    Examples
    --------
    >>> notes = []
    >>> spread_rounded_stamps(np.repeat([0.0, 60.0, 120.0, 180.0], 2), np.arange(8), 0.0, notes)[:3], notes[0]
    (array([ 0., 30., 60.]), '2 rows share each stamp (rounded to 60 s): taken as 30 s apart.')
    """
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
    for period in (*(float(f"{low:.{digits}g}") for digits in range(1, 6)), low):
        if spread(period) < step:
            return float((seconds - period * place).max()) + period * place, period
    return seconds, 0.0


def _spread_by_resolution(seconds: NDArray, resolution: float, notes: list[str]) -> NDArray:
    """Replace stamps whose steps are one of two neighbouring multiples of the resolution by even times with their gaps.

    The period is that of the longest stretch without a gap, or else a short number; the stamps must lie on it.
    """
    multiples = np.round(np.diff(seconds) / resolution).astype(np.int64)
    counts = np.bincount(np.clip(multiples, 0, _MAX_RESOLUTIONS + 1), minlength=_MAX_RESOLUTIONS + 2)
    fewer = int(np.argmax(counts[:_MAX_RESOLUTIONS] + counts[1 : _MAX_RESOLUTIONS + 1]))
    if len(seconds) < _MIN_EVEN_ROWS or not (counts[fewer] and counts[fewer + 1]):
        return seconds
    begin, end = _longest_run((multiples == fewer) | (multiples == fewer + 1))
    part = seconds[begin : end + 1]
    _, dt = _fit_even_times(part, 1.001 * resolution, float(part[-1] - part[0]) / (part.size - 1))
    plain = 10.0 ** np.floor(np.log10(resolution)) * np.arange(1.0, 100.0)
    near = plain[(plain > max(fewer * resolution, 1.01 * resolution)) & (plain < (fewer + 1) * resolution)]
    of_stretch = (dt,) if dt > 0.0 and part.size >= _MIN_EVEN_ROWS else ()
    for period in (*of_stretch, *near[::-1]):  # of several short numbers the one that leaves the fewest gaps
        even = _even_times_with_gaps(seconds, resolution, float(period))
        if even is not None:
            notes.append(f"The stamps are rounded to {resolution:g} s: taken as {period:g} s apart.")
            return even
    return seconds


def _longest_run(mask: NDArray[np.bool_]) -> tuple[int, int]:
    """First and one past the last of the longest run of True."""
    edges = np.flatnonzero(np.diff(mask.astype(np.int8), prepend=0, append=0))
    begins, ends = edges[::2], edges[1::2]
    longest = int(np.argmax(ends - begins))
    return int(begins[longest]), int(ends[longest])


def _even_times_with_gaps(seconds: NDArray, resolution: float, dt: float) -> NDArray | None:
    """Times `dt` apart, with gaps, that are the stamps when rounded to `resolution`; None where there are none."""
    place = np.arange(len(seconds))
    off = seconds - seconds[0] - dt * place
    if np.ptp(off) > 1.001 * resolution:
        phase = np.sort((seconds - seconds[0]) % dt)
        free = np.diff(phase, append=phase[0] + dt)  # from each phase to the next, round the circle
        begin = phase[(int(np.argmax(free)) + 1) % len(phase)]
        if free.max() < dt - 1.001 * resolution:
            return None
        # All phases lie within one resolution from there on.
        place = np.floor((seconds - seconds[0] - begin) / dt + 1e-6)
        off = seconds - seconds[0] - dt * place
        if np.diff(place).min() < 1.0:
            return None
    low, high = seconds[0] + off.max() - 0.5 * resolution, seconds[0] + off.min() + 0.5 * resolution
    middle = 0.5 * (low + high)
    whole = round(middle)
    return (float(whole) if low <= whole <= high else middle) + dt * place
