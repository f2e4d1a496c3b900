"""Surrogates and prediction: what the nonlinearity test compares, and with what.

A surrogate is what a linear process could have made instead of the record: the same power spectrum, phases drawn anew
(`theiler1992`). Here it also keeps the record's values, by turns with the spectrum (`schreiber1996`), so that noise
which is merely not Gaussian is not taken for a nonlinearity.

A regular oscillation is a line between the frequencies of a finite record, and phases drawn anew break it up: with
plain surrogates a sine in noise is nearly always called nonlinear. After `nakamura2006` only the part above the
fundamental gets new phases. Filters cut it out beforehand, because the line leaks into every frequency of a finite
transform. Between both parts lies an empty band: what both held would be in step in the record and not in its
surrogates, which is no nonlinearity either.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.models.compiled import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["end_matched", "prediction_error", "split", "surrogates"]

LOW, HIGH = 1.2, 1.8  # edges of the empty band over the fundamental's frequency
REACH = 1.5  # half length of the filters [periods]: a transition as wide as the fundamental's frequency
TURNS = 5  # spectrum and values set by turns


def split(x: NDArray[np.float64], per_period: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Part up to the fundamental, and part of the harmonics and the noise, each shape (n_samples - 3 per_period,).

    Examples
    --------
    >>> import numpy as np
    >>> wave = np.sin(2 * np.pi * np.arange(200) / 10)
    >>> low, high = split(wave, 10)
    >>> bool(np.abs(low - wave[15:-15]).max() < 0.1), bool(np.abs(high).max() < 0.01)
    (True, True)
    """
    reach = round(REACH * per_period)
    t = np.arange(-reach, reach + 1) / per_period
    low, wide = (np.sinc(2.0 * edge * t) * np.hamming(t.size) for edge in (LOW, HIGH))
    return (
        np.convolve(x, low / low.sum(), "valid"),
        x[reach : x.size - reach] - np.convolve(x, wide / wide.sum(), "valid"),
    )


def end_matched(x: NDArray[np.float64], reach: int) -> slice:
    """Where to cut up to `reach` samples off each end, so that the ends join best in value and slope."""
    heads, tails = np.arange(reach), x.size - 1 - np.arange(reach)
    value = x[heads][:, None] - x[tails][None, :]
    slope = (x[heads + 1] - x[heads])[:, None] - (x[tails] - x[tails - 1])[None, :]
    head, tail = np.unravel_index(np.argmin(np.abs(value) + np.abs(slope)), value.shape)
    return slice(int(head), x.size - int(tail))


def surrogates(x: NDArray[np.float64], count: int, seed: int) -> NDArray[np.float64]:
    """Series with the values of `x`, reordered, and nearly its power spectrum, shape (count, n_samples).

    Examples
    --------
    >>> import numpy as np
    >>> x = np.random.default_rng(1).standard_normal(64)
    >>> bool(np.array_equal(np.sort(surrogates(x, 1, seed=0)[0]), np.sort(x)))
    True
    """
    n = x.size
    values, spectrum = np.sort(x), np.fft.rfft(x)
    power = np.abs(spectrum)
    turn = np.exp(2j * np.pi * np.random.default_rng(seed).random((count, spectrum.size)))
    made = np.fft.irfft(spectrum * turn, n, axis=1)
    rows = np.arange(count)[:, None]
    for again in range(TURNS):
        if again:
            found = np.fft.rfft(made, axis=1)
            found *= power / np.maximum(np.abs(found), 1e-300)
            made = np.fft.irfft(found, n, axis=1)
        made[rows, np.argsort(made, axis=1)] = values
    return made


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
