"""Gaps in signals: where values are missing, and three ways to fill them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.records.runs import runs

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "MAX_BRIDGED_GAP",
    "MAX_BRIDGED_SHARE",
    "MAX_FILLED_GAP",
    "fill_short_gaps",
    "forward_fill",
    "interpolate_gaps",
    "missing_mask",
    "unchanged_mask",
]

MAX_FILLED_GAP = 5
"""Missing samples in a row that the last value may replace [samples]."""
MAX_BRIDGED_GAP = 20
"""Missing samples in a row that do not end the part of a record that is analysed [samples]. Of a longer gap it is not
known what the loop did meanwhile."""
MAX_BRIDGED_SHARE = 0.2
"""Share of the samples in such a part that may be missing [-]; with more, only gaps that can be filled are crossed."""


def missing_mask(op: NDArray[np.float64], pv: NDArray[np.float64] | None = None) -> NDArray[np.bool_]:
    """Mark the samples in which OP or PV is missing, shape (n_samples,)."""
    return ~np.isfinite(op) if pv is None else ~(np.isfinite(op) & np.isfinite(pv))


def forward_fill(x: NDArray[np.float64], *, fill_start: bool = False) -> NDArray[np.float64]:
    """Hold each value over the missing ones after it [unit of `x`]; with `fill_start` the first one before it too."""
    known = np.isfinite(x)
    if known.all():
        return x
    first = int(np.argmax(known)) if fill_start else 0
    return x[np.maximum.accumulate(np.where(known, np.arange(x.size), first))]


def interpolate_gaps(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Replace missing values by lines between their neighbours, and by the nearest value at the ends [unit of `x`]."""
    known = np.flatnonzero(np.isfinite(x))
    return x if known.size in (0, x.size) else np.interp(np.arange(x.size), known, x[known])


def fill_short_gaps(x: NDArray[np.float64], max_gap: int = MAX_FILLED_GAP) -> NDArray[np.float64]:
    """Replace missing values by the last value before them in gaps of at most `max_gap` samples [unit of `x`]."""
    missing = ~np.isfinite(x)
    if not missing.any():
        return x
    filled = forward_fill(x)
    for first, last in runs(missing):
        if last - first > max_gap:
            filled[first:last] = np.nan
    return filled


def unchanged_mask(x: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark the samples in which a signal repeats its last value, short gaps filled, shape (n_samples,)."""
    return np.concatenate([[False], np.diff(fill_short_gaps(x)) == 0.0])
