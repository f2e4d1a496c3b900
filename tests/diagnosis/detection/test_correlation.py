"""Methods on two signals against closed forms: phase offsets, symbol counts, still time, chance levels."""

from __future__ import annotations

import math

import numpy as np
import pytest

from stiction.diagnosis.detection.damarla_regression import CHANCE, stuck_windows
from stiction.diagnosis.detection.horch_correlation import correlation_offsets, cross_correlation
from stiction.diagnosis.detection.kano_patterns import LINEAR, still_time
from stiction.diagnosis.detection.yamashita import still_shares, symbols


@pytest.mark.parametrize(("psi", "d_rho", "d_tau"), [(0, 0, 0), (30, 0.0718, 1 / 3), (60, 1 / 3, 2 / 3), (90, 1, 1)])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("side", [1, -1])
def test_horch_limits_are_thirty_and_sixty_degrees(psi, d_rho, d_tau, sign, side):
    """d_rho = (1 - cos psi) / (1 + cos psi), d_tau = 2 psi / pi: the published limits are these two angles."""
    t = np.arange(40_000)
    op = np.sin(2 * np.pi * t / 400)
    pv = sign * np.sin(2 * np.pi * t / 400 + side * math.radians(psi))
    rho, tau = correlation_offsets(cross_correlation(op, pv, 400))
    assert rho == pytest.approx(d_rho, abs=0.02)
    assert tau == pytest.approx(d_tau, abs=0.01)


def test_cross_correlation_is_the_slow_sum():
    rng = np.random.default_rng(0)
    x, y = rng.standard_normal((2, 50))
    x0, y0 = x - x.mean(), y - y.mean()
    slow = []
    for lag in range(-20, 21):
        pairs = [x0[k] * y0[k + lag] for k in range(50) if 0 <= k + lag < 50]
        slow.append(np.mean(pairs))
    np.testing.assert_allclose(cross_correlation(x, y, 20), slow, atol=1e-12)


def test_yamashita_limit_is_chance_level():
    """Independent, equally likely symbols: rho_1 = 2/8; five of nine successors are barred, so rho_3 = 2/8 * 4/9."""
    rng = np.random.default_rng(0)
    rho_1, rho_3 = still_shares(*rng.integers(-1, 2, (2, 400_000)))
    assert rho_1 == pytest.approx(0.25, abs=0.003)
    assert rho_3 == pytest.approx(1 / 9, abs=0.003)


def test_noise_makes_three_equally_likely_symbols():
    steps = symbols(np.cumsum(np.random.default_rng(0).standard_normal(200_000)))
    assert [np.mean(steps == s) for s in (-1, 0, 1)] == pytest.approx([1 / 3] * 3, abs=0.005)


def test_yamashita_counts_a_sticking_valve_and_not_a_good_one():
    up = np.array([1, 1, 1, 1, -1, -1, -1, -1] * 50)
    stuck = np.array([0, 0, 0, 1, 0, 0, 0, -1] * 50)
    assert still_shares(up, stuck) == pytest.approx((0.75, 0.75))
    assert still_shares(up, up) == (0.0, 0.0)
    wrong = np.array([0, -1] * 200)  # moves against OP after standing still: no valve
    assert still_shares(np.ones(400, dtype=int), wrong)[1] < 0.01
    assert math.isnan(still_shares(np.zeros(9, dtype=int), np.zeros(9, dtype=int))[0])


def test_a_linear_loop_is_rarely_still_whatever_its_phase():
    t = np.arange(20_000) / 500
    for psi in np.linspace(0, math.pi, 13):
        assert still_time(np.sin(2 * np.pi * t), np.sin(2 * np.pi * t + psi)) <= LINEAR + 0.02
    assert pytest.approx(2 * math.acos(0.8) / math.pi, abs=0.005) == LINEAR


def test_still_time_is_the_share_of_the_cycle_in_which_the_valve_sticks():
    """OP a triangle, the valve a trapezium that moves for 20 % of each half period: 80 % still."""
    phase = np.arange(20_000) % 1000 / 1000
    op = 4 * np.abs(phase - 0.5) - 1
    valve = np.interp(phase, [0, 0.4, 0.5, 0.9, 1.0], [1, 1, -1, -1, 1])
    assert still_time(op, valve) == pytest.approx(0.8, abs=0.05)


def test_damarla_chance_level_holds_for_noise_and_for_quadrature():
    rng = np.random.default_rng(0)
    assert pytest.approx(0.1257, abs=1e-4) == CHANCE
    assert stuck_windows(*rng.standard_normal((2, 600_000))) == pytest.approx(CHANCE, abs=0.004)
    t = np.arange(600_000) / 4801.0
    assert stuck_windows(np.sin(t), np.cos(t)) == pytest.approx(CHANCE, abs=0.004)
    assert stuck_windows(np.sin(t), -np.sin(t)) == 0.0
