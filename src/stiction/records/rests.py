"""Where a signal rests: runs of samples, gaps that are held over."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "BRIDGE",
    "FROZEN",
    "MOST_RESTS",
    "SELDOM",
    "bridged",
    "filled",
    "hardly_rests",
    "lengths_of",
    "moves_in",
    "repeats",
    "runs",
]

BRIDGE = 5
"""Missing samples in a row over which the last value may be held."""
FROZEN = 12
"""Samples for which PV must rest to be frozen, or OP to be in manual, where it hardly ever repeats a value."""
SELDOM = 0.02
"""Share of a record that shorter rests take where a signal hardly ever repeats a value [-]."""
MOST_RESTS = 5
"""Rests above which a signal rests as a habit."""


def runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and one past the last sample of every stretch of True.

    Examples
    --------
    >>> runs(np.array([True, False, True, True]))
    [(0, 1), (2, 4)]
    """
    within = np.zeros(mask.size + 2, dtype=bool)
    within[1:-1] = mask
    edges = np.flatnonzero(within[1:] != within[:-1]).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def repeats(x: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark where a signal repeats its last value, shape (n_samples,)."""
    return np.concatenate([[False], np.diff(bridged(x)) == 0.0])


def lengths_of(rests: list[tuple[int, int]]) -> NDArray[np.int64]:
    """Samples that each rest takes."""
    return np.array([last - first for first, last in rests], dtype=np.int64)


def hardly_rests(lengths: NDArray[np.int64], samples: int) -> bool:
    """Whether a signal hardly ever rests, but for a few rests that are long."""
    return bool(lengths[lengths < FROZEN].sum() < SELDOM * samples and np.sum(lengths >= FROZEN) <= MOST_RESTS)


def bridged(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Hold the last value over up to `BRIDGE` missing samples: a rest is one rest though some of it was lost.

    Examples
    --------
    >>> bridged(np.array([1.0, np.nan, 2.0, *6 * [np.nan]]))[:4]
    array([ 1.,  1.,  2., nan])
    """
    if np.isfinite(x).all():
        return x
    out = filled(x)
    for first, last in runs(~np.isfinite(x)):
        if last - first > BRIDGE:
            out[first:last] = np.nan
    return out


def filled(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Hold the last value over what is missing, in the signal's unit, shape (n_samples,).

    Examples
    --------
    >>> filled(np.array([1.0, np.nan, 2.0]))
    array([1., 1., 2.])
    """
    last = np.maximum.accumulate(np.where(np.isfinite(x), np.arange(len(x)), 0))
    return x[last]


def moves_in(x: NDArray[np.float64] | None, first: int, last: int) -> bool:
    """Whether a signal takes more than a few values within a stretch and moves by a visible part of its swing."""
    if x is None:
        return False
    part = x[first:last]
    part = part[np.isfinite(part)]
    swing = float(np.nanmax(x) - np.nanmin(x)) if part.size else 0.0
    return part.size > 0 and len(np.unique(part)) > 2 and float(part.max() - part.min()) > 0.05 * swing
