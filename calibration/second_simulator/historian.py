"""Transmitter faults, and the ways in which a plant's historian stores a signal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["MODES", "add_spikes", "quantise", "store_by_exception", "store_by_swinging_door", "store_slower"]

MODES = ("average", "hold", "quantised", "exception", "swinging_door")


def quantise(x: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Round to multiples of a step [unit of the signal]."""
    return np.round(x / step) * step


def add_spikes(rng: np.random.Generator, x: NDArray[np.float64], size: float) -> NDArray[np.float64]:
    """Add single wrong samples, one in 300, of about the given size [unit of the signal]."""
    out = x.copy()
    hit = np.flatnonzero(rng.random(x.size) < 1.0 / 300.0)
    out[hit] += size * rng.choice((-1.0, 1.0), hit.size) * rng.uniform(0.5, 1.5, hit.size)
    return out


def store_slower(x: NDArray[np.float64], every: int, *, average: bool) -> NDArray[np.float64]:
    """Store one value for each block of samples: its mean, or the last sample."""
    blocks = x[: x.size // every * every].reshape(-1, every)
    return blocks.mean(axis=1) if average else blocks[:, -1].copy()


def store_by_exception(x: NDArray[np.float64], deviation: float, longest: int) -> NDArray[np.float64]:
    """Store a value that is more than the deviation off the last stored one, or after `longest` samples; hold it."""
    out, last, age = np.empty_like(x), x[0], 0
    for i, value in enumerate(x.tolist()):
        age += 1
        if abs(value - last) > deviation or age >= longest:
            last, age = value, 0
        out[i] = last
    return out


def store_by_swinging_door(x: NDArray[np.float64], deviation: float, longest: int) -> NDArray[np.float64]:
    """Compress by the swinging door (Bristol 1990) and interpolate between the stored values.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        The signal.
    deviation : float
        Largest error of the compression [unit of the signal].
    longest : int
        Samples between two stored values at most.

    Returns
    -------
    ndarray, shape (n_samples,)
        The signal as a trend display shows it.

    Examples
    --------
    >>> ramp = np.arange(6.0)
    >>> store_by_swinging_door(ramp, 0.1, 100).tolist() == ramp.tolist()
    True
    """
    values = x.tolist()
    places, start, low, high = [0], 0, -np.inf, np.inf
    for i in range(1, len(values)):
        span = i - start
        low = max(low, (values[i] - deviation - values[start]) / span)
        high = min(high, (values[i] + deviation - values[start]) / span)
        if (low > high or span >= longest) and i - 1 > start:
            start = i - 1
            places.append(start)
            low, high = values[i] - deviation - values[start], values[i] + deviation - values[start]
    if places[-1] != len(values) - 1:
        places.append(len(values) - 1)
    return np.interp(np.arange(x.size), places, x[places])
