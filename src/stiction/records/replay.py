"""Find stretches that occur twice in a record, value for value: copied data."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["replayed"]

_LENGTH, _UNROUNDED = 30, 8
"""Samples of a stretch that tell a copy: where a signal is rounded, and where neither is."""
_NEAR = 0.002
"""Share of the swing within which a cycle comes back to itself [-]."""


def replayed(
    op: NDArray[np.float64], pv: NDArray[np.float64], op_step: float = 0.0, pv_step: float = 0.0
) -> tuple[float, bool]:
    """Share of samples that repeat an earlier stretch, and whether the record comes back so closely by itself.

    Every stretch of 30 samples, 8 where neither signal is rounded, at least half of them changes of both signals, gets
    a number by a rolling hash (after Karp and Rabin); equal numbers are equal stretches. A cycle without noise, or one
    that noise hardly lifts over the lattice, also comes back where it was not copied: there the rest of the record is
    near itself at the same lag.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        Signals in any unit.
    op_step, pv_step : float
        Their lattices, 0 where there is none.

    Examples
    --------
    >>> x = np.random.default_rng(1).normal(size=200)
    >>> copied = np.concatenate([x, x[20:120]])
    >>> replayed(x, x)[0], replayed(copied, copied), replayed(np.tile(x, 4), np.tile(x, 4))[1]
    (0.0, (0.3333333333333333, False), True)
    """
    length = _LENGTH if op_step or pv_step else _UNROUNDED
    n = len(op) - length + 1
    if n < 2:
        return 0.0, False
    mix = np.uint64(0x9E3779B97F4A7C15)
    codes = (op + 0.0).view(np.uint64) * mix ^ ((pv + 0.0).view(np.uint64) >> np.uint64(7)) * mix
    codes ^= codes >> np.uint64(29)
    hashes = np.zeros(n, dtype=np.uint64)
    for k in range(length):
        hashes = hashes * np.uint64(0x100000001B3) + codes[k : k + n]
    changes = np.concatenate([[0], np.cumsum((np.diff(op) != 0.0) & (np.diff(pv) != 0.0))])
    lively = np.flatnonzero(2 * (changes[length - 1 :] - changes[:n]) >= length)
    order = lively[np.argsort(hashes[lively], kind="stable")]
    again = np.flatnonzero(hashes[order][1:] == hashes[order][:-1])
    if again.size == 0:
        return 0.0, False
    starts, lags = order[again + 1], np.diff(order)[again]
    covered = np.zeros(len(op) + 1, dtype=np.int64)
    np.add.at(covered, starts, 1)
    np.add.at(covered, starts + length, -1)
    again_at = np.cumsum(covered)[:-1] > 0
    share = float(np.mean(again_at))
    values, counts = np.unique(lags, return_counts=True)
    lag = int(values[np.argmax(counts)])
    first = int(starts.min())
    if len(op) - first > 1.5 * lag and again_at[first:].mean() > 0.9:
        return share, True
    near = np.ones(len(op) - lag, dtype=bool)
    for x, step in ((op, op_step), (pv, pv_step)):
        tolerance = max(2.01 * step, _NEAR * float(x.max() - x.min()))
        near &= np.abs(x[lag:] - x[:-lag]) <= tolerance
    rest = near[~again_at[lag:]]
    return share, bool(rest.size and rest.mean() > 0.5)
