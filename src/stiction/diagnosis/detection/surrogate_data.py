"""Surrogates and prediction: what the nonlinearity test compares, and with what.

A surrogate is what a linear loop could have made instead of the record. In a linear loop harmonics and noise know
nothing of the fundamental: what is above it may slide past it, and nothing changes. With a sticking valve they are one
shape, and sliding breaks it. So a surrogate is the record with the part above its fundamental moved in frequency by two
to four cycles over the record, its phase drawn at random.

Surrogates with phases drawn anew (`theiler1992`), also with the values kept by turns (`schreiber1996`), serve noise
but not loops that oscillate: a line falls between the frequencies of a finite record, new phases break it up, and a
sine in noise is nearly always called nonlinear. New phases above the fundamental alone (after `nakamura2006`) do so
to any second line, and spare the harmonics of a regular cycle. Moved in frequency a line stays a line.

Fundamental and the rest are parted by filters with an empty band between: what both held would be in step in the
record and not in its surrogates, which is no nonlinearity either.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.models.numba_compile import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["end_matched", "prediction_error", "split", "surrogates"]

LOW, HIGH = 1.2, 1.8  # edges of the empty band over the fundamental's frequency
REACH = 1.5  # half length of the filters [periods]: a transition as wide as the fundamental's frequency
SLIDE = 2.0, 4.0  # cycles


def split(x: NDArray[np.float64], per_period: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Part up to the fundamental, and part of the harmonics and the noise, each shape (n_samples - 3 per_period,).

    Examples
    --------
    >>> import numpy as np
    >>> low, high = split(np.sin(2 * np.pi * np.arange(200) / 10), 10)
    >>> bool(low.std() > 0.5), bool(high.std() < 0.01)
    (True, True)
    """
    reach = round(REACH * per_period)
    t = np.arange(-reach, reach + 1) / per_period
    low, wide = (np.sinc(2.0 * edge * t) * np.hamming(t.size) for edge in (LOW, HIGH))
    below = np.convolve(x, np.asarray(low / low.sum(), dtype=np.float64), "valid")
    above = x[reach : x.size - reach] - np.convolve(x, np.asarray(wide / wide.sum(), dtype=np.float64), "valid")
    return below, above


def end_matched(x: NDArray[np.float64], reach: int) -> slice:
    """Where to cut up to `reach` samples off each end, so that the ends join best in value and slope."""
    heads, tails = np.arange(reach), x.size - 1 - np.arange(reach)
    value = x[heads][:, None] - x[tails][None, :]
    slope = (x[heads + 1] - x[heads])[:, None] - (x[tails] - x[tails - 1])[None, :]
    head, tail = np.unravel_index(np.argmin(np.abs(value) + np.abs(slope)), value.shape)
    return slice(int(head), x.size - int(tail))


def surrogates(x: NDArray[np.float64], count: int, seed: int) -> NDArray[np.float64]:
    """The series moved up and down in frequency by two to four cycles over its length, shape (count, n_samples).

    Examples
    --------
    >>> import numpy as np
    >>> x = np.sin(2 * np.pi * 20 * np.arange(200) / 200)
    >>> spectrum = np.abs(np.fft.rfft(surrogates(x, 8, seed=0)))
    >>> sorted({abs(int(peak) - 20) for peak in spectrum.argmax(axis=1)} - {2, 3, 4})
    []
    """
    n = x.size
    spectrum = np.fft.fft(x)
    spectrum[1 : (n + 1) // 2] *= 2.0
    spectrum[n // 2 + 1 :] = 0.0
    rng = np.random.default_rng(seed)
    cycles = rng.uniform(*SLIDE, count) * np.where(np.arange(count) % 2, 1.0, -1.0)
    turn = cycles[:, None] * np.arange(n) / n + rng.random((count, 1))
    return (np.fft.ifft(spectrum) * np.exp(2j * np.pi * turn)).real


@kernel
def prediction_error(x, size, ahead, limit, near, value):
    """Mean square error of predicting `ahead` samples on from the neighbours nearest to each stretch of `size` samples.

    Stretches that overlap are no neighbours. The distance of two stretches that start `gap` apart follows from that of
    the two one sample before, by one term in and one out. Room for the work: `limit` of shape (n_samples,), `near` and
    `value` of shape (n_samples, n_neighbours).
    """
    n = x.shape[0] - size - ahead + 1
    neighbours = near.shape[1]
    limit[:] = math.inf
    near[:] = math.inf
    value[:] = 0.0
    for gap in range(size, n):
        distance = 0.0
        for i in range(size):
            distance += (x[i] - x[i + gap]) ** 2
        for i in range(n - gap):
            j = i + gap
            if distance < limit[i]:
                limit[i] = _put(near[i], value[i], neighbours, distance, x[j + size - 1 + ahead])
            if distance < limit[j]:
                limit[j] = _put(near[j], value[j], neighbours, distance, x[i + size - 1 + ahead])
            distance += (x[i + size] - x[j + size]) ** 2 - (x[i] - x[j]) ** 2
    total = 0.0
    for i in range(n):
        guess = 0.0
        for k in range(neighbours):
            guess += value[i, k]
        total += (x[i + size - 1 + ahead] - guess / neighbours) ** 2
    return total / n


@kernel
def _put(near, value, neighbours, distance, follows):
    """Put a neighbour in its place, the nearest first; the distance that the next one must beat."""
    k = neighbours - 1
    while k > 0 and near[k - 1] > distance:
        near[k] = near[k - 1]
        value[k] = value[k - 1]
        k -= 1
    near[k] = distance
    value[k] = follows
    return near[neighbours - 1]
