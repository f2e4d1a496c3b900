"""The best process behind a stem that is known: every pair of lags with every dead time, in one kernel.

The error is that of `search`, from the other side: with one stem it is the lags' answers that stand side by side, and
each is multiplied with the target at every dead time. Nothing is filtered backwards.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.lanes import about_mean, products
from stiction.diagnosis.identification.search import best_dead_time, windows
from stiction.models.compiled import kernel, summing

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["best_behind"]

ROUNDING = 1e-12
"""Share of the stem's position up to which an answer is rounding [-]."""


def best_behind(
    stem: NDArray[np.float64],
    target: NDArray[np.float64],
    half: int,
    first: NDArray[np.float64],
    second: NDArray[np.float64],
    delays: NDArray[np.int64],
    begin: int,
    sign: float,
) -> tuple[float, float, NDArray[np.float64]]:
    """Find the process that answers the stem most like the target.

    Parameters
    ----------
    stem : ndarray, shape (n_samples,)
        Stem position [% of span].
    target : ndarray, shape (n_samples,)
        PV without its local mean [PV units].
    half : int
        Half width of the local mean [samples]; 0 for the mean of all.
    first, second : ndarray, shape (n_lags,)
        Decays per sample of two lags in series [-]; a `first` of 1 integrates.
    delays : ndarray, shape (n_delays,)
        Dead times, increasing [samples]; -1 where the PV sees the stem within the sample.
    begin : int
        First sample compared.
    sign : float
        Sign that the gain must have; 0 for any.

    Returns
    -------
    error, gain : float
        Sum of squares that the process leaves, and its gain [PV units per % of span].
    best : ndarray, shape (3,)
        Its lag pair, -1 where none answers; its whole dead time and the fraction of a sample to add.
    """
    n, pairs = target.size, first.size
    lanes = -(-pairs // 8) * 8
    marks, opens, closes = windows(n, half, delays, begin)
    error, gain, best = np.empty(1), np.empty(1), np.empty((1, 3))
    decays = np.zeros((2, lanes))
    decays[0, :pairs], decays[1, :pairs] = first, second
    _best_behind(
        stem, target, half, decays, pairs, delays, begin, sign, error, gain, best, np.empty((1, delays.size)),
        marks, opens, closes, np.empty((2, n, 1)), np.empty((n, lanes)), np.empty((n, delays.size)),
        np.empty((5, lanes)), np.empty((lanes, delays.size)), np.empty((marks.size, 2, lanes)),
    )  # fmt: skip
    return float(error[0]), float(gain[0]), best[0]


@kernel
def _best_behind(
    stem, target, half, decays, pairs, delays, begin, sign, error, gain, best, by_delay, marks, opens, closes,
    about, answer, late, lane, cross, square,
):  # fmt: skip
    """Fill `error`, `gain` (1,), `best` (1, 3) and `by_delay` (1, n_delays) as `search` does for a valve.

    `pairs` of the lanes hold lags.

    The last six are work space, `about` (2, n_samples, 1) the stem about its mean and about its local mean, `answer`
    (n_samples, n_lanes) what the lags make of it, and `late` (n_samples, n_delays) the target as an answer meets it
    before its dead time.
    """
    n = target.shape[0]
    end = n - half
    centre = largest = 0.0
    for k in range(n):
        centre += stem[k] / n
        largest = max(largest, abs(stem[k]))
    for k in range(n):
        about[0, k, 0] = stem[k] - centre
    rounding = n * (ROUNDING * largest) ** 2
    energy = 0.0
    for k in range(begin, end):
        energy += target[k] * target[k]
    for d in range(delays.shape[0]):
        shift = 1 + delays[d]
        for i in range(n):
            k = i + shift
            late[i, d] = target[k] if begin <= k < end and half <= i < end else 0.0
    about_mean(about[0], half, lane[0], about[1])
    _answers(about[1], decays[0], decays[1], half, lane[0], lane[1], answer)
    products(answer, late, pairs, cross)
    _squares(answer, half, marks, lane[2], lane[3], lane[4], square)
    error[0], gain[0] = energy, 0.0
    best[0, 0], best[0, 1], best[0, 2] = -1.0, 0.0, 0.0
    by_delay[:] = energy
    for q in range(pairs):
        best_dead_time(
            q, 0, q, delays, sign, energy, rounding, error, gain, best, by_delay, cross[q], square, opens, closes
        )  # fmt: skip


@kernel
def _answers(about, first, second, half, u, y, out):
    """Fill `out` (n_samples, n_lanes) with the answers of the lags, a pair a lane, about their local mean.

    Row i of `about` belongs to sample i - half, see `about_mean`; samples that no local mean reaches are left zero.
    """
    n, lanes = out.shape
    for v in range(lanes):
        u[v] = y[v] = 0.0
    for k in range(n):
        m, row = about[k, 0], out[max(k - half, 0)]
        for v in range(lanes):
            u[v] = first[v] * u[v] + (1.0 - first[v] if first[v] < 1.0 else 1.0) * m
            y[v] = second[v] * y[v] + (1.0 - second[v]) * u[v]
            row[v] = y[v]
    for k in range(n - half, n):
        for v in range(lanes):
            out[k, v] = 0.0
    if half == 0:
        for v in range(lanes):
            u[v] = 0.0
        for k in range(n):
            for v in range(lanes):
                u[v] += out[k, v]
        for k in range(n):
            for v in range(lanes):
                out[k, v] -= u[v] / n


@summing
def _squares(answer, half, marks, last, power, mixed, out):
    """Fill `out` (n_marks, 2, n_lanes): sums of z[k]**2 and of z[k] z[k - 1] over half <= k < mark of each lane."""
    lanes = answer.shape[1]
    for v in range(lanes):
        last[v] = power[v] = mixed[v] = 0.0
    k = half
    for s in range(marks.shape[0]):
        while k < marks[s]:
            z = answer[k]
            for v in range(lanes):
                power[v] += z[v] * z[v]
                mixed[v] += z[v] * last[v]
                last[v] = z[v]
            k += 1
        for v in range(lanes):
            out[s, 0, v] = power[v]
            out[s, 1, v] = mixed[v]
