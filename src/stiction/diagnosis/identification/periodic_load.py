"""A load that repeats in every period: its period, and signals without it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["fundamental_period", "remove_harmonics"]


def fundamental_period(x: NDArray[np.float64], period: float, harmonics: int) -> float:
    """Period from 4/5 to 5/4 of a given one whose harmonics carry most of a signal about its mean [samples].

    Examples
    --------
    >>> x = np.sin(2.0 * np.pi * np.arange(600) / 41.3)
    >>> round(fundamental_period(x, 40.0, 3), 1)
    41.3
    """
    size = 1 << (64 * x.size - 1).bit_length()
    spectrum = np.fft.rfft(x, size)
    low, high = size / (1.25 * period), size / (0.8 * period)
    places = np.arange(int(np.ceil(low)), min(int(high), (spectrum.size - 1) // harmonics) + 1)
    power = sum(np.abs(spectrum[h * places]) ** 2 for h in range(1, harmonics + 1))
    return size / float(places[np.argmax(power)])


def remove_harmonics(signals: NDArray[np.float64], period: float, harmonics: int) -> NDArray[np.float64]:
    """Take the constant and the harmonics of a period [samples] out of signals, by least squares; shape of `signals`.

    Examples
    --------
    >>> k = np.arange(200)
    >>> bool(np.abs(remove_harmonics(np.sin(2.0 * np.pi * k / 20.0)[np.newaxis], 20.0, 2)).max() < 1e-9)
    True
    """
    angle = 2.0 * np.pi / period * np.outer(np.arange(1, harmonics + 1), np.arange(signals.shape[1]))
    waves = np.vstack([np.ones(signals.shape[1]), np.cos(angle), np.sin(angle)])
    weights, *_ = np.linalg.lstsq(waves @ waves.T, waves @ signals.T, rcond=None)
    return signals - weights.T @ waves
