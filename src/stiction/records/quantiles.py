"""Quantiles of a signal with gaps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["quantiles"]


def quantiles(x: NDArray[np.float64], *shares: float) -> tuple[float, ...]:
    """Quantiles of a signal, NaN left out [unit of `x`]; NaN when all values are missing.

    Much faster than `numpy.nanquantile`.

    Examples
    --------
    >>> quantiles(np.array([4.0, np.nan, 1.0, 2.0]), 0.0, 0.25, 1.0)
    (1.0, 1.5, 4.0)
    """
    known = x[~np.isnan(x)]
    return tuple(np.quantile(known, shares).tolist()) if known.size else (math.nan,) * len(shares)
