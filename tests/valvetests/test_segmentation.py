from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as strategy

from stiction.valvetests.hidden_stairs import find_hidden_stairs
from stiction.valvetests.ramp_split import OpRamp
from stiction.valvetests.segmentation import Segment, noise_std, quantisation_step, segment_penalty, segment_signal

pytestmark = pytest.mark.quick


def price_of(time, signal, sigma, pieces) -> float:
    total = 0.0
    for piece in pieces:
        here = slice(piece.first, piece.last)
        miss = signal[here] - np.array([piece.at(t) for t in time[here]])
        price = segment_penalty(signal.size) * (4.0 / 3.0 if piece.slope else 1.0)
        total += float(miss @ miss) / sigma**2 + price
    return total


def best_price(time, signal, sigma) -> float:
    """Slow twin: every cut by dynamic programming, each piece fitted by numpy's polyfit, no pruning."""
    n, price = signal.size, segment_penalty(signal.size)
    best = [0.0] + [math.inf] * n
    for j in range(1, n + 1):
        for i in range(j):
            t, x = time[i:j], signal[i:j]
            if j - i >= 3:
                best[j] = min(best[j], best[i] + float(np.sum((x - x.mean()) ** 2)) / sigma**2 + price)
            if j - i >= 2:
                miss = x - np.polyval(np.polyfit(t - t.mean(), x, 1), t - t.mean())
                best[j] = min(best[j], best[i] + float(miss @ miss) / sigma**2 + 4.0 / 3.0 * price)
    return best[n]


@settings(deadline=None, max_examples=15)
@given(seed=strategy.integers(0, 10_000), n=strategy.integers(4, 22), sigma=strategy.sampled_from([0.02, 0.1, 0.5]))
@example(seed=6877, n=17, sigma=0.5)
def test_the_cut_is_the_best_of_all(seed, n, sigma):
    chance = np.random.default_rng(seed)
    time = np.cumsum(chance.uniform(1.0, 1.0 + 0.0, n))
    signal = np.cumsum(chance.standard_normal(n) * (chance.uniform(size=n) < 0.3)) + sigma * chance.standard_normal(n)
    pieces = segment_signal(time, signal, sigma)
    assert [p.first for p in pieces[1:]] == [p.last for p in pieces[:-1]]
    assert price_of(time, signal, sigma, pieces) == pytest.approx(best_price(time, signal, sigma), rel=1e-6)


def test_noise_estimate_ignores_ramps_and_stairs():
    chance = np.random.default_rng(0)
    t = np.arange(4000.0)
    white = 0.3 * chance.standard_normal(4000)
    for signal in (white, white + 0.05 * t, white + 2.0 * np.floor(t / 100)):
        assert noise_std(signal) == pytest.approx(0.3, rel=0.08)


def test_resolution():
    chance = np.random.default_rng(0)
    signal = 50.0 + chance.standard_normal(2000)
    assert quantisation_step(np.round(signal, 1), 0.3) == pytest.approx(0.1)
    assert quantisation_step(signal, 0.3) < 1e-3
    assert quantisation_step(np.round(signal), 0.3) == 0.0


def test_hidden_stairs_are_found_and_following_is_not_taken_for_stairs():
    chance = np.random.default_rng(1)
    t = np.arange(600.0)
    op = 10.0 + 0.04 * t
    ramp = OpRamp(Segment(0, 600, 0.0, 599.0, float(op.mean()), 0.04))
    stairs = np.floor(op / 1.0) * 1.0
    found, seen = find_hidden_stairs(ramp, t, stairs + 0.5 * chance.standard_normal(600), 0.5, 1.0)
    assert found is not None
    assert found.jump == pytest.approx(1.0, rel=0.03)
    assert seen < 1.0
    false = [find_hidden_stairs(ramp, t, op + 0.5 * chance.standard_normal(600), 0.5, 1.0)[0] for _ in range(100)]
    assert sum(entry is not None for entry in false) <= 1
