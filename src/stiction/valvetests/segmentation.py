"""Segmentation of a signal into rests and straight lines, optimal by dynamic programming.

Each segment is a rest (a level) or a line (a level and a slope). The segmentation with the smallest sum of squared
residuals over the noise variance, plus a penalty per segment, is found exactly (optimal partitioning). Starts that can
never become optimal are dropped, so that the work is nearly linear in the number of samples.

References
----------
killick2012, after: optimal partitioning and its pruning.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.models.numba_compile import kernel
from stiction.records.quantiles import robust_std
from stiction.records.straight_line import fit_line

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Segment", "noise_std", "quantisation_step", "segment_penalty", "segment_signal"]


@kernel
def _best_cut(sums, variance, rest_price, line_price, best, origin, line, open_starts, beaten):
    """Fill `best`, `origin` and `line` (n + 1,) from `sums` (5, n + 1): running sums of t, x, tt, tx and xx.

    A rest has three samples or more, a line two. A start that loses against a cut at j can still be optimal until
    a rest fits after j; then it is dropped. `open_starts` and `beaten` (n + 2,) are work space.
    """
    n = best.shape[0] - 1
    count = 1
    open_starts[0] = 0
    beaten[0] = n
    best[0] = 0.0
    for j in range(1, n + 1):
        best[j] = math.inf
        for c in range(count):
            i = open_starts[c]
            m = float(j - i)
            t = sums[0, j] - sums[0, i]
            x = sums[1, j] - sums[1, i]
            tt = sums[2, j] - sums[2, i] - t * t / m
            tx = sums[3, j] - sums[3, i] - t * x / m
            xx = max(sums[4, j] - sums[4, i] - x * x / m, 0.0)
            if j - i >= 3 and best[i] + xx / variance + rest_price < best[j]:
                best[j] = best[i] + xx / variance + rest_price
                origin[j] = i
                line[j] = 0
            if j - i >= 2:
                bent = max(xx - tx * tx / tt, 0.0)
                if best[i] + bent / variance + line_price < best[j]:
                    best[j] = best[i] + bent / variance + line_price
                    origin[j] = i
                    line[j] = 1
        n_open = 0
        for c in range(count):
            i = open_starts[c]
            m = float(j - i)
            t = sums[0, j] - sums[0, i]
            x = sums[1, j] - sums[1, i]
            tt = sums[2, j] - sums[2, i] - t * t / m
            tx = sums[3, j] - sums[3, i] - t * x / m
            xx = max(sums[4, j] - sums[4, i] - x * x / m, 0.0)
            bent = max(xx - tx * tx / tt, 0.0) if j - i >= 2 else 0.0
            at = beaten[c]
            if j - i >= 3 and at == n and best[i] + bent / variance > best[j]:
                at = j
            if j < at + 2:
                open_starts[n_open] = i
                beaten[n_open] = at
                n_open += 1
        open_starts[n_open] = j
        beaten[n_open] = n
        count = n_open + 1


@dataclass(frozen=True, slots=True)
class Segment:
    """One rest or one straight line of a signal."""

    first: int
    """First sample [-]."""
    last: int
    """Sample after the last one [-]."""
    start: float
    """Time of the first sample [s]."""
    end: float
    """Time of the last sample [s]."""
    level: float
    """Mean of the signal over the segment [unit of the signal]."""
    slope: float
    """Slope [unit of the signal / s]; 0 for a rest."""

    def at(self, time: float) -> float:
        """Value of the segment at `time` [s], extended beyond its ends."""
        return self.level + self.slope * (time - 0.5 * (self.start + self.end))

    @property
    def n(self) -> int:
        """Number of samples [-]."""
        return self.last - self.first


def segment_penalty(n: int) -> float:
    """Penalty of a rest among `n` samples [-]: three log n, after the modified Bayesian criterion."""
    return 3.0 * math.log(max(n, 8))


def segment_signal(time: NDArray[np.float64], signal: NDArray[np.float64], sigma: float) -> list[Segment]:
    """Divide a signal into rests and lines.

    `time`: increasing times [s]; gaps are allowed. `signal`: the signal, without missing values. `sigma`: standard
    deviation of its noise [unit of the signal], above 0. Returns in order of time; empty for fewer than two samples.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(40.0)
    >>> [(p.first, p.last, round(p.slope, 6)) for p in segment_signal(t, np.where(t < 20, 0.0, 5.0), 0.1)]
    [(0, 20, 0.0), (20, 40, 0.0)]
    """
    n = signal.shape[0]
    if n < 2:
        return []
    t, x = time - time.mean(), signal - signal.mean()
    sums = np.zeros((5, n + 1))
    for row, term in zip(sums, (t, x, t * t, t * x, x * x), strict=True):
        np.cumsum(term, out=row[1:])
    best, origin, line = np.empty(n + 1), np.zeros(n + 1, np.int64), np.zeros(n + 1, np.int64)
    price = segment_penalty(n)
    _best_cut(sums, sigma * sigma, price, price * 4.0 / 3.0, best, origin, line, *np.empty((2, n + 2), np.int64))
    pieces: list[Segment] = []
    last = n
    while last > 0:
        first = int(origin[last])
        here = slice(first, last)
        slope, level = 0.0, float(signal[here].mean())
        if line[last]:
            fitted = fit_line(time[here], signal[here])
            # A line is read at the middle of its times, which is their mean for even sampling.
            slope, level = fitted.slope, float(fitted.at(0.5 * (time[first] + time[last - 1])))
        pieces.append(Segment(first, last, float(time[first]), float(time[last - 1]), level, slope))
        last = first
    return pieces[::-1]


def quantisation_step(signal: NDArray[np.float64], largest: float) -> float:
    """Step to which a signal is rounded [unit of the signal], 0 when it is not or when the step exceeds `largest`."""
    levels = np.unique(signal[np.isfinite(signal)])
    gaps = np.diff(levels)
    gaps = gaps[gaps > 1e-9 * max(1.0, float(np.abs(levels).max(initial=0.0)))]
    if gaps.size < 2 or not 0.0 < gaps.min() <= largest:
        return 0.0
    step = float(gaps.min())
    whole = np.abs(gaps / step - np.round(gaps / step)) < 0.02
    return step if whole.mean() >= 0.95 else 0.0


def noise_std(signal: NDArray[np.float64]) -> float:
    """Estimate the standard deviation of the noise [unit of the signal], from second differences over 1 and 3 samples.

    Second differences of a ramp are 0, and rare jumps do not change their median absolute deviation; differences over 3
    samples include noise that is correlated from sample to sample.
    """
    spread = 0.0
    for lag in (1, 3):
        bend = signal[2 * lag :] - 2.0 * signal[lag:-lag] + signal[: -2 * lag]
        if bend.size >= 20:
            spread = max(spread, robust_std(bend))
    return spread / math.sqrt(6.0)
