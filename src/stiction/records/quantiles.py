"""Quantiles of a signal with gaps, and its robust standard deviation."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["quantiles", "robust_std"]


def quantiles(x: NDArray[np.float64], *shares: float) -> tuple[float, ...]:
    """Quantiles of a signal, NaN left out [unit of `x`]; NaN when all values are missing.

    Much faster than `numpy.nanquantile`.
    """
    known = x[~np.isnan(x)]
    return tuple(np.quantile(known, shares).tolist()) if known.size else (math.nan,) * len(shares)


def robust_std(x: NDArray[np.float64], centre: float | None = None) -> float:
    """Standard deviation of a normal distribution with the same median absolute deviation [unit of `x`].

    It is 1.4826 times the median of the distances from `centre`, by default the median. A few outliers have no effect.
    """
    return 1.4826 * float(np.median(np.abs(x - (np.median(x) if centre is None else centre))))
