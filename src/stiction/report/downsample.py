"""Downsample long series for plots without losing a peak or a gap."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["MAX_POINTS", "downsample"]

MAX_POINTS = 2000
"""Largest number of points of a series that is drawn [-]."""


def downsample(y: NDArray[np.float64], max_points: int = MAX_POINTS) -> NDArray[np.intp]:
    """Return the samples to draw: all of them, or `max_points` that keep the shape (MinMaxLTTB) and the gaps.

    `y`: Series; NaN is a gap. `max_points`: largest number of points [-].

    Examples
    --------
    >>> downsample(np.zeros(5)).tolist()
    [0, 1, 2, 3, 4]
    >>> len(downsample(np.zeros(100_000))) <= 2000
    True
    """
    if len(y) <= max_points:
        return np.arange(len(y))
    from tsdownsample import NaNMinMaxLTTBDownsampler

    return NaNMinMaxLTTBDownsampler().downsample(np.ascontiguousarray(y), n_out=max_points).astype(np.intp)
