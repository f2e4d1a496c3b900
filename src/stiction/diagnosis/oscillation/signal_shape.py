"""Shapes of OP, PV and SP in a record, as numbers: lines, limits, noise, and what goes with the set point."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Signal = NDArray[np.float64]

__all__ = [
    "largest_pole", "line_share", "noise_share", "share_at_limits", "share_at_rate", "share_by_lags",
]  # fmt: skip

FEW = 3.0
"""Samples at an end of OP's range that are no stay at a limit [-]."""


def line_share(x: Signal, per_period: float) -> float:
    """Share of the power from 2/3 to 3/2 of the main frequency that stands in one line [-].

    `per_period` are the samples in a period.
    """
    n = x.size
    size = 1 << (4 * n - 1).bit_length()
    power = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(n), size)) ** 2
    turns = np.arange(power.size) * (per_period / size)
    near = np.flatnonzero((turns > 0.8) & (turns < 1.25))
    if near.size == 0:
        return math.nan
    i, width = int(near[np.argmax(power[near])]), max(round(2.0 * size / n), 1)
    around = power[(turns > turns[i] / 1.5) & (turns < turns[i] * 1.5)]
    return float(power[max(i - width, 0) : i + width + 1].sum() / max(float(around.sum()), 1e-300))


def share_by_lags(x: Signal, y: Signal, per_period: float) -> float:
    """Share of the variance of `y` that lags of `x` explain, less what as many lags of chance would [-]."""
    if not float(np.ptp(x)) > 0.0:
        return 0.0
    scale = per_period / 8.0 if per_period > 0.0 else 5.0
    x, y = (block_means(z, int(np.clip(scale, 1, max(y.size // 100, 1)))) for z in (x, y))
    x, y = x - x.mean(), y - y.mean()
    n, lags = y.size, min(12, y.size // 8)
    rows = np.array([np.ones(n - lags), *(x[lags - k : n - k] for k in range(lags))]).T
    target = y[lags:] - y[lags:].mean()
    left = target - rows @ np.linalg.lstsq(rows, target, rcond=1e-8)[0]
    ratio = float(left @ left) / max(float(target @ target), 1e-300)
    return max(1.0 - ratio * (n - lags) / max(n - 2 * lags, 1), 0.0)


def share_at_limits(op: Signal, step: float) -> float:
    """Share of the samples with OP at its largest and smallest values, without single ones.

    `step` is the quantisation step of OP [% of span].
    """
    near, single = 0.6 * step + 0.002 * float(np.ptp(op)), FEW / op.size
    at_ends = (op >= op.max() - near) | (op <= op.min() + near)
    return max(float(np.mean(at_ends)) - 2.0 * single, 0.0)


def share_at_rate(op: Signal, step: float) -> float:
    """Share of the moves of OP that are as fast as its fastest, 3 % off at most; `step` as in `share_at_limits`."""
    moves = np.abs(np.diff(op))
    fast = float(np.quantile(moves, 0.97))
    near = np.abs(moves - fast) <= 0.03 * fast + 1.01 * step
    return float(np.mean(near)) if fast > 3.0 * step else 0.0


def block_means(x: Signal, size: int) -> Signal:
    """Means of blocks of `size` samples."""
    return x[: x.size // size * size].reshape(-1, size).mean(axis=1)


def noise_share(x: Signal, size: int) -> float:
    """Variance of the moves of block means over twice their variance: 1 of white noise, 0 of a slow wave [-]."""
    y = block_means(x, size)
    return float(np.var(np.diff(y)) / max(2.0 * float(np.var(y)), 1e-300))


def largest_pole(x: Signal, size: int, lags: int = 16) -> float:
    """-lg(1 - r) with r the largest pole of block means predicted from themselves alone [-]."""
    y = block_means(x, size)
    y = (y - y.mean()) / max(float(y.std()), 1e-300)
    products = np.array([y[: y.size - k] @ y[k:] for k in range(lags + 1)]) / y.size
    products[0] *= 1.0 + 1e-6
    number = np.arange(lags)
    correlations = products[np.abs(np.subtract.outer(number, number))]
    poles = np.roots(np.r_[1.0, -np.linalg.solve(correlations, products[1:])])
    return -math.log10(max(1.0 - float(np.abs(poles).max()), 1e-4)) if poles.size else 0.0
