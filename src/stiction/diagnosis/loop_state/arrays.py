"""Runs, averages and the regular oscillation of plain arrays, as the checks of the loop state need them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.records.correlation import previous_fast_length
from stiction.records.runs import run_bounds, run_lengths

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "LONG_REST",
    "LONG_SHARE",
    "OP_LIMITS",
    "about_line",
    "block_means",
    "find_rests",
    "keep_long_runs",
    "moving_average",
    "oscillation_period",
]

OP_LIMITS = (0.0, 100.0)
"""Output limits [% of span]."""
LONG_REST = 60
"""Shortest rest at one value that counts [samples]."""
LONG_SHARE = 0.05
"""Shortest rest that counts, as a share of the record [-]."""


def keep_long_runs(mask: NDArray[np.bool_], min_samples: int) -> NDArray[np.bool_]:
    """Keep the runs of True that are at least `min_samples` long."""
    kept = np.zeros(mask.size, dtype=bool)
    bounds = run_bounds(mask)
    for first, last in bounds[run_lengths(bounds) >= min_samples].tolist():
        kept[first:last] = True
    return kept


def find_rests(x: NDArray[np.float64]) -> NDArray[np.int64]:
    """First and one past the last sample of each stretch of two or more equal values, shape (n_stretches, 2)."""
    return run_bounds(np.diff(x) == 0.0) - (0, -1)


def moving_average(x: NDArray[np.float64], width: int) -> NDArray[np.float64]:
    """Centred mean over `width` samples, over fewer at both ends."""
    width = max(1, min(width, x.size))
    total = np.concatenate([[0.0], np.cumsum(x)])
    first = np.maximum(np.arange(x.size) - (width - 1) // 2, 0)
    last = np.minimum(np.arange(x.size) + width // 2 + 1, x.size)
    return (total[last] - total[first]) / (last - first)


def block_means(x: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Means of `count` successive blocks of nearly equal length."""
    return np.array([block.mean() for block in np.array_split(x, count)])


def about_line(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Signals less their least-squares straight line along the last axis [unit of `x`]."""
    t = np.arange(x.shape[-1]) - 0.5 * (x.shape[-1] - 1.0)
    level = x - x.mean(axis=-1, keepdims=True)
    # Not by @: the threads of a BLAS cost more than these sums where other work shares the cores.
    slope = np.einsum("...i,i->...", level, t) / max(float(np.einsum("i,i->", t, t)), 1.0)
    return level - slope[..., np.newaxis] * t


def oscillation_period(
    x: NDArray[np.float64], *, min_share: float = 0.7, min_cycles: float = 4.0, min_correlation: float = 0.5
) -> float:
    """Period of a regular oscillation [samples], NaN when there is none.

    The oscillation is regular when one peak of the spectrum, its two neighbours on either side and its second and third
    harmonic hold at least `min_share` of the variance about a straight line, and the signal correlates with itself
    three periods later by at least `min_correlation`.
    """
    if x.size < 32 or not np.ptp(x) > 0.0:
        return float("nan")
    x = x[: previous_fast_length(x.size)]
    detrended = about_line(x)
    power = np.abs(np.fft.rfft(detrended * np.hanning(x.size))) ** 2
    power[0] = 0.0
    peak = int(np.argmax(power))
    if peak < min_cycles or peak > x.size / 5:
        return float("nan")
    near = {k for harmonic in (1, 2, 3) for k in range(harmonic * peak - 2, harmonic * peak + 3) if 0 < k < power.size}
    share = power[sorted(near)].sum() / power.sum()
    period = x.size / peak
    lag = round(min(3.0, peak - 1.0) * period)
    correlation = float(np.corrcoef(detrended[lag:], detrended[:-lag])[0, 1])
    return period if share >= min_share and correlation >= min_correlation else float("nan")
