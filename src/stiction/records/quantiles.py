"""Quantiles of a signal with gaps, several times faster than numpy.nanquantile."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["quantiles"]


def quantiles(x: NDArray[np.float64], *shares: float) -> tuple[float, ...]:
    """Quantiles of a signal, NaN left out; equal to `numpy.nanquantile` [unit of `x`], NaN when all values are missing.

    Examples
    --------
    >>> quantiles(np.array([4.0, np.nan, 1.0, 2.0]), 0.0, 0.25, 1.0)
    (1.0, 1.5, 4.0)
    """
    known = x[~np.isnan(x)]
    last = known.size - 1
    if last < 0:
        return (math.nan,) * len(shares)
    places = [last * share for share in shares]
    below = [min(int(place), last) for place in places]
    above = [min(one + 1, last) for one in below]
    known.partition(sorted({*below, *above}))
    return tuple(
        _between(float(known[low]), float(known[high]), place - low)
        for place, low, high in zip(places, below, above, strict=True)
    )


def _between(low: float, high: float, share: float) -> float:
    """Value on the line from `low` to `high`, computed from the nearer end as numpy does."""
    step = high - low
    return high - step * (1.0 - share) if share >= 0.5 else low + step * share
