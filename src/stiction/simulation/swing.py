"""What a trend needs of a signal: its swing, and where it rises."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Swing", "find_first_rise", "measure_swing"]

SMOOTHING_SHARE = 24.0
"""Length of a period over that of the moving average that takes the noise out of an amplitude [-]."""
MIN_AMPLITUDE = 1e-6
"""Amplitude of OP below which the loop is at rest [% of span]."""


@dataclass(frozen=True, slots=True)
class Swing:
    """How a signal swings about its middle."""

    period: float
    """Mean period [s]; NaN with less than two rises through the middle."""
    amplitude: float
    """Half peak to peak."""
    middle: float
    """Middle between the lowest and the highest value."""


def find_first_rise(x: NDArray[np.float64]) -> int:
    """Return the sample at which a signal first rises through the middle of its range; 0 where it does not."""
    rises = _find_rises(x)
    return int(rises[0]) if rises.size else 0


def measure_swing(x: NDArray[np.float64], dt: float, *, noisy: bool = False) -> Swing:
    """Return period, amplitude and middle of a signal of shape (n_samples,) with sampling period `dt` [s].

    A noisy signal is averaged over a 24th of its period before its amplitude is taken.

    Examples
    --------
    >>> wave = measure_swing(50.0 + 2.0 * np.sin(2.0 * np.pi * np.arange(1000) / 100.0), dt=0.5)
    >>> round(wave.period, 2), round(wave.amplitude, 2), round(wave.middle, 2)
    (50.0, 2.0, 50.0)
    """
    rises = _find_rises(x)
    samples = float(np.mean(np.diff(rises))) if rises.size > 1 else float("nan")
    window = round(samples / SMOOTHING_SHARE) if noisy and rises.size > 1 else 1
    calm = np.convolve(x, np.full(window, 1.0 / window), "valid") if window > 1 else x
    low, high = float(np.nanmin(calm)), float(np.nanmax(calm))
    return Swing(samples * dt, (high - low) / 2.0, (high + low) / 2.0)


def _find_rises(x: NDArray[np.float64]) -> NDArray[np.intp]:
    """Samples at which `x` first stands above its middle after having been in its lowest quarter."""
    low, high = np.nanmin(x), np.nanmax(x)
    if not high - low > MIN_AMPLITUDE:
        return np.empty(0, dtype=np.intp)
    level = np.where(x > (low + high) / 2.0, 1, np.where(x < low + (high - low) / 4.0, -1, 0))
    known = np.flatnonzero(level)
    return known[1:][np.diff(level[known]) > 0]
