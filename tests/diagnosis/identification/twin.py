"""Slow, obvious twins of the search, in plain numpy and from its description, not from its source."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

import naive

N = 160
CASES = {
    "no local mean": (0, [0.5, 0.9, 0.0], [0.0, 0.3, 0.0], [0, 2, 4]),
    "local mean": (12, [0.5, 0.9, 0.0, 0.7, 0.2], [0.0, 0.3, 0.0, 0.7, 0.1], [-1, 1, 5]),
    "integrator": (15, [1.0, 1.0, 0.95], [0.0, 0.6, 0.0], [-1, 3, 9]),
    "integrator about the mean": (0, [1.0], [0.4], [-1, 4]),
    "one candidate": (9, [0.8], [0.0], [3]),
    "more lags than a lane holds": (9, np.linspace(0.0, 0.95, 11), np.zeros(11), [0, 3]),
}
"""Half width of the local mean, decays of two lags, dead times without neighbours."""


def walk(seed, n=N):
    """A signal that wanders, turns and rests."""
    rng = np.random.default_rng(seed)
    return 50.0 + np.cumsum(rng.normal(0.0, 1.0, n) * (rng.random(n) > 0.2))


def about_local_mean(x, half):
    """x less its moving average over 2 half + 1 samples; zero where the window does not fit; half 0: less its mean."""
    x = np.asarray(x, dtype=float)
    if half == 0:
        return x - x.mean()
    width = 2 * half + 1
    out = np.zeros(x.size)
    if x.size >= width:
        out[half : x.size - half] = x[half : x.size - half] - np.convolve(x, np.ones(width) / width, "valid")
    return out


def lag(x, decay):
    """First-order lag with unit gain; a decay of 1 adds up."""
    y, out = 0.0, []
    for value in x:
        y = y + value if decay == 1.0 else decay * y + (1.0 - decay) * value
        out.append(y)
    return np.array(out)


def response(op, S, J, first, second, half):
    """Answer of two lags to Kano's valve about its mean, less its local mean; before any dead time."""
    mv = np.array(naive.kano(list(op), S, J))
    return about_local_mean(lag(lag(mv - mv.mean(), first), second), half)


def shifted(y, delay, begin, end):
    """Samples begin <= k < end of y, `delay` + 1 samples late: a stem seen within the sample has delay -1."""
    return y[begin - 1 - delay : end - 1 - delay]


def noisy(y, late, half, rng, sign):
    """A target that answers so many samples late, with a gain of two and noise."""
    return about_local_mean(2.0 * sign * np.roll(y, late) + rng.normal(0.0, np.ptp(y) / 5.0, y.size), half)


def between(y, delay, part, gain, begin, end):
    """A target that answers at a dead time between two samples, without noise; zero outside its window."""
    target = np.zeros(y.size)
    here, late = (shifted(y, delay + k, begin, end) for k in (0, 1))
    target[begin:end] = gain * ((1.0 - part) * here + part * late)
    return target


class Fit(NamedTuple):
    """A process candidate, the squares it leaves and its weights on one or two neighbouring dead times."""

    left: float
    pair: int
    delay: int
    weights: tuple[float, ...]

    @property
    def gain(self):
        return sum(self.weights)

    @property
    def fraction(self):
        return self.weights[1] / self.gain if len(self.weights) == 2 else 0.0


def least_squares(columns, target):
    """Weights and squares left."""
    A = np.stack(columns, axis=1)
    weights, *_ = np.linalg.lstsq(A, target, rcond=None)
    return weights, float(np.sum((target - A @ weights) ** 2))


def candidates(op, target, half, S, J, first, second, delays, begin, sign, fractions=True):
    """Every process that is allowed for one valve."""
    end = len(op) - half
    aim = target[begin:end]
    for pair, (a, b) in enumerate(zip(first, second, strict=True)):
        y = response(op, S, J, a, b, half)
        for d in delays:
            here = shifted(y, d, begin, end)
            if not np.any(np.abs(here) > 1e-9):
                continue
            weights, left = least_squares([here], aim)
            if weights[0] * sign >= 0.0:
                yield Fit(left, pair, int(d), (float(weights[0]),))
            if fractions and d + 1 in delays:
                weights, left = least_squares([here, shifted(y, d + 1, begin, end)], aim)
                if weights[0] * weights[1] > 0.0 and weights[0] * sign >= 0.0:
                    yield Fit(left, pair, int(d), (float(weights[0]), float(weights[1])))


def assert_best(error, gain, best, fits, window):
    """That a kernel found the whole dead time that leaves least, or nothing where nothing answers."""
    slow = min(fits, key=lambda fit: fit.left, default=None)
    if slow is None:
        assert (gain, best[0]) == (0.0, -1.0)
        assert error == pytest.approx(np.sum(window**2))
        return
    assert error == pytest.approx(slow.left, rel=1e-9)
    assert gain == pytest.approx(slow.gain, rel=1e-7)
    assert best.tolist() == [slow.pair, slow.delay, 0.0]
