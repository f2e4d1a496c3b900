"""Find stretches that occur twice in a record, value for value: copied data."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["replayed"]

_LENGTH = 30
_CHANGES = 15


def replayed(op: NDArray[np.float64], pv: NDArray[np.float64]) -> tuple[float, bool]:
    """Share of samples that repeat an earlier stretch, and whether the whole record is exactly periodic.

    Every stretch of 30 samples, at least half of them changes of both signals, gets a number by a rolling hash (after
    Karp and Rabin); equal numbers are equal stretches.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        Signals in any unit.

    Examples
    --------
    >>> x = np.random.default_rng(1).normal(size=200)
    >>> replayed(x, x)[0], replayed(np.tile(x, 2), np.tile(x, 2))
    (0.0, (0.5, True))
    """
    n = len(op) - _LENGTH + 1
    if n < 2:
        return 0.0, False
    mix = np.uint64(0x9E3779B97F4A7C15)
    codes = (op + 0.0).view(np.uint64) * mix ^ ((pv + 0.0).view(np.uint64) >> np.uint64(7)) * mix
    codes ^= codes >> np.uint64(29)
    hashes = np.zeros(n, dtype=np.uint64)
    for k in range(_LENGTH):
        hashes = hashes * np.uint64(0x100000001B3) + codes[k : k + n]
    changes = np.concatenate([[0], np.cumsum((np.diff(op) != 0.0) & (np.diff(pv) != 0.0))])
    lively = np.flatnonzero(changes[_LENGTH - 1 :] - changes[:n] >= _CHANGES)
    order = lively[np.argsort(hashes[lively], kind="stable")]
    again = np.flatnonzero(hashes[order][1:] == hashes[order][:-1])
    if again.size == 0:
        return 0.0, False
    starts, lags = order[again + 1], np.diff(order)[again]
    covered = np.zeros(len(op) + 1, dtype=np.int64)
    np.add.at(covered, starts, 1)
    np.add.at(covered, starts + _LENGTH, -1)
    share = float(np.mean(np.cumsum(covered)[:-1] > 0))
    # A loop simulated without noise repeats at one lag from some sample to the end.
    lag = int(np.median(lags))
    tail = int(starts.min())
    periodic = bool(np.mean(lags == lag) > 0.9) and share > 0.9 * (len(op) - tail) / len(op) and share >= 0.3
    return share, periodic
