"""Sums of lagged products of signals: the common part of all correlations, computed by Fourier transforms."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["lagged_products", "next_fast_length", "previous_fast_length"]

ODD = tuple(3**threes * 5**fives for threes in range(6) for fives in range(4))
"""Odd parts of the lengths; the rest is a power of two."""


@lru_cache(256)
def next_fast_length(n: int) -> int:
    """Smallest fast length of at least `n` samples."""
    return min(odd << (-(-n // odd) - 1).bit_length() for odd in ODD)


@lru_cache(256)
def previous_fast_length(n: int) -> int:
    """Largest fast length of at most `n` samples."""
    return max(odd << ((n // odd).bit_length() - 1) for odd in ODD if odd <= n)


MIN_BLOCK = 2048
"""Smallest number of samples that are transformed at once [-]."""


def lagged_products(x: NDArray[np.float64], y: NDArray[np.float64], lags: int) -> NDArray[np.float64]:
    """Sum x[k] y[k + lag] over k for `lags` lags from 0 [samples], shape (lags,); signals without gaps [any unit]."""
    n = x.shape[0]
    # Block by block, each with the lags after it: for few lags many times as fast as in one piece.
    size = next_fast_length(min(n, max(MIN_BLOCK, 4 * lags)) + lags)
    step = size - lags

    def cut(z: NDArray[np.float64]) -> NDArray[np.float64]:
        padded = np.zeros(-(-n // step) * step + lags)
        padded[:n] = z
        return np.lib.stride_tricks.sliding_window_view(padded, size)[::step]

    longer = np.fft.rfft(cut(y))
    own = longer if x is y and len(longer) == 1 else np.fft.rfft(cut(x)[:, :step], size)
    return np.fft.irfft((own.conj() * longer).sum(axis=0), size)[:lags]
