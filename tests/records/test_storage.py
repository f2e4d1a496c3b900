"""What a historian did, read back from numbers that were stored in a known way."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from stiction.records.quality.compression import controller_saw_hold, count_interpolated, exception_deviation
from stiction.records.quality.quantisation import quantisation_step

N = 1500
K = np.arange(N)


def noisy(seed, period=70.3, noise=0.1):
    return np.sin(2 * np.pi * K / period) + noise * np.random.default_rng(seed).normal(size=N)


def by_exception(x, deviation):
    """The last value that had left the one before by more than the deviation."""
    out = [x[0]]
    for value in x[1:]:
        out.append(value if abs(value - out[-1]) > deviation else out[-1])
    return np.array(out)


@settings(deadline=None, max_examples=40)
@given(
    step=some.floats(1e-4, 1e3),
    zero=some.floats(-1e3, 1e3),
    levels=some.lists(some.integers(0, 400), min_size=30, max_size=80),
)
def test_lattice_is_the_greatest_common_divisor_of_the_differences(step, zero, levels):
    rises = np.gcd.reduce(np.diff(sorted({*levels, levels[0] + 1})))  # two neighbours: the divisor is 1
    assert rises == 1
    x = zero + step * np.array([*levels, levels[0] + 1])
    found = quantisation_step(x)
    assert found == pytest.approx(step, rel=1e-6, abs=1e-9 * abs(zero))


def test_no_lattice_in_noise_nor_in_a_straight_line():
    assert quantisation_step(noisy(1)) == 0.0
    assert quantisation_step(0.37 * K) == 0.0
    assert quantisation_step(np.array([3.0, np.nan, 3.0])) == 0.0


@pytest.mark.parametrize("deviation", [0.15, 0.3, 0.6])
def test_exception_deviation_is_found_to_a_quarter(deviation):
    x = by_exception(noisy(2), deviation)
    # Every change is above the deviation, so the estimate is too, by the overshoot of the noise.
    assert deviation < exception_deviation(x, quantisation_step(x)) < 1.25 * deviation


@pytest.mark.parametrize(
    "x",
    [
        noisy(3),
        np.round(noisy(3), 1),
        np.round(noisy(3, noise=0.0) * 4) / 4,
        noisy(3)[K // 4 * 4],
        np.sign(np.sin(2 * np.pi * K / 90)) * (1 - 0.9 ** (K % 45)),
    ],
    ids=["raw", "rounded", "coarse", "slow historian", "steps without noise"],
)
def test_other_signals_have_no_exception_deviation(x):
    assert exception_deviation(x, quantisation_step(x)) == 0.0


def test_rounded_and_stored_by_exception_is_not_taken_for_rounding():
    x = by_exception(np.round(noisy(4), 2), 0.2)
    assert quantisation_step(x) == pytest.approx(0.01)
    assert 0.2 < exception_deviation(x, quantisation_step(x)) < 0.25


def test_a_pv_that_rests_while_op_ramps_was_seen_by_the_controller():
    pv = by_exception(noisy(5), 0.3)
    op = 50 - 2 * pv - 0.05 * np.cumsum(pv)
    assert controller_saw_hold(op, pv, 0.0)
    hidden = noisy(5)
    assert not controller_saw_hold(50 - 2 * hidden - 0.05 * np.cumsum(hidden), pv, 0.0)
    assert not controller_saw_hold(by_exception(op, 1.0), pv, 0.0)


@pytest.mark.parametrize("every", [5, 12, 30])
def test_straight_lines_between_samples_of_a_slow_historian_are_counted(every):
    knots = K[::every]
    x, y = (np.interp(K, knots, noisy(seed)[knots]) for seed in (6, 7))
    drawn = N - len(knots)
    assert count_interpolated(x, y, 0.0, 0.0) == pytest.approx(drawn, rel=0.02)
    assert count_interpolated(x, noisy(7), 0.0, 0.0) == pytest.approx(
        drawn, rel=0.1
    )  # a short piece of noise may look smooth
    assert count_interpolated(np.round(x, 4), np.round(y, 4), 1e-4, 1e-4) == pytest.approx(drawn, rel=0.1)


def test_lines_of_a_coarse_signal_are_counted_with_a_fine_companion():
    # Every 16th sample kept of a transmitter with four steps: the lines between make a lattice sixteen times finer.
    k, kept = np.arange(800), np.arange(0, 800, 16)
    rng = np.random.default_rng(3)
    op, pv = np.interp(k, kept, rng.normal(size=kept.size)), np.interp(k, kept, 16.0 * rng.integers(0, 4, kept.size))
    assert quantisation_step(pv) == pytest.approx(1.0)
    assert count_interpolated(op, pv, quantisation_step(op), quantisation_step(pv)) > 0.5 * k.size
    assert count_interpolated(op, 16.0 * rng.integers(0, 4, k.size), quantisation_step(op), 16.0) == 0


def test_straight_lines_that_a_loop_makes_by_itself_are_not_counted():
    # Stuck without noise: PV stands off the set point, OP ramps.
    pv = np.where(K // 40 % 2, 1.0, -1.0)
    op = 50 - 0.1 * np.cumsum(pv)
    assert count_interpolated(op, pv, quantisation_step(op), quantisation_step(pv)) == 0
    # An integrating process behind it: PV is a triangle, OP a parabola.
    level = np.cumsum(pv) * 0.1
    parabola = 50 - 0.02 * np.cumsum(level - level.mean()) - level
    assert count_interpolated(level, parabola, quantisation_step(level), 0.0) == 0
    assert count_interpolated(parabola, level, 0.0, quantisation_step(level)) == 0
    # The lag of the process equals the integral time: OP is straight while PV dies out.
    dying = np.exp(-(K % 300) / 400.0) * np.where(K // 300 % 2, 1.0, -1.0)
    ramp = np.abs((K % 600) - 300) * 0.01
    assert count_interpolated(ramp, dying, 0.0, 0.0) == 0
    assert count_interpolated(np.round(ramp, 3), np.round(dying, 3), 1e-3, 1e-3) == 0
    # Proportional action alone: OP is the mirror of a level that is a triangle.
    assert count_interpolated(50 - 2 * level, level, 0.0, 0.0) == 0
