"""Stamps rounded to the minute, the second or a few decimals of a day: the even times that they stand for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["spread_rounded_stamps"]


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

    The period is the shortest number between the two multiples on which all stamps lie.
    """
    counts = np.bincount(np.clip(np.round(np.diff(seconds) / resolution), 0, 101).astype(np.int64), minlength=102)
    fewer = int(np.argmax(counts[:100] + counts[1:101]))
    if len(seconds) < 30 or not (counts[fewer] and counts[fewer + 1]):
        return seconds
    low, high = max(fewer, 1.01) * resolution, (fewer + 1) * resolution
    for unit in (60.0, 30.0, 10.0, 5.0, 1.0, 0.5, 0.1, 0.05, 0.01):
        for dt in unit * np.arange(np.floor(low / unit) + 1.0, np.ceil(high / unit))[::-1]:
            even = _even_times_with_gaps(seconds, resolution, float(dt))
            if even is not None:
                notes.append(f"The stamps are rounded to {resolution:g} s: taken as {dt:g} s apart.")
                return even
    return seconds


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
