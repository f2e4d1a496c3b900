"""The valve behind a recorded position, against the strokes of the valve models."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy.signal import lfilter

import naive
import stiction as st
from stiction.diagnosis.identification.corrected_stem import CorrectedStems, position_noise
from stiction.diagnosis.identification.position import fit_position
from stiction.diagnosis.identification.position_regression import (
    hold_length,
    is_copy,
    position_regression,
    position_signal,
)

N = 2000


def wandering(seed=2, n=N, noise=0.1):
    """An OP that goes up and down by some per cent, with noise."""
    rng = np.random.default_rng(seed)
    return 50.0 + 4.0 * np.sin(np.cumsum(rng.uniform(0.5, 1.5, n)) / 12.0) + noise * rng.normal(size=n)


def stem(valve, op, noise=0.15, seed=0):
    return st.stroke(valve, op, dt=1.0).mv + noise * np.random.default_rng(seed).normal(size=op.size)


def test_a_sine_shows_the_valve_and_not_a_delay():
    op = 50.0 + 4.0 * np.sin(np.arange(1500.0) / 15.0)
    found = fit_position(op, 4.0 + 0.16 * stem(st.Kano(3.0, 1.5), op, 0.1))
    assert found.kind == "stiction"
    assert pytest.approx(3.0, rel=0.02) == found.valve.S
    assert found.valve.S * found.valve.ratio == pytest.approx(1.5, rel=0.05)
    assert (found.slope, found.level) == pytest.approx((0.16, 4.0), rel=0.02)


@pytest.mark.parametrize(("slope", "level"), [(1.0, 0.0), (0.16, 4.0), (0.01, 0.0), (-1.0, 100.0), (-0.16, 20.0)])
def test_unit_offset_and_direction_of_the_position_do_not_matter(slope, level):
    op = wandering(1)
    found = fit_position(op, level + slope * stem(st.Kano(4.0, 2.0), op))
    assert found.kind == "stiction"
    assert pytest.approx(4.0, rel=0.03) == found.valve.S
    assert found.valve.S * found.valve.ratio == pytest.approx(2.0, rel=0.08)
    assert found.slope == pytest.approx(slope, rel=0.03)


@pytest.mark.parametrize(
    "spoil", ["missing", "coarse", "lag", "held", "late 1", "late 2", "late 3", "late 4", "late 5"]
)
def test_a_position_that_is_not_perfect(spoil):
    op, rng = wandering(), np.random.default_rng(2)
    y = stem(st.Kano(4.0, 2.0), op)
    late = int(spoil[-1]) if spoil.startswith("late") else 0
    y = {
        "missing": np.where(rng.random(N) < 0.2, np.nan, y),
        "coarse": np.round(y),
        "lag": lfilter([0.4], [1.0, -0.6], y, zi=[0.6 * y[0]])[0],
        "held": np.repeat(y[::4], 4),
    }.get(spoil, np.concatenate([y[:late], y[: N - late]]))
    found = fit_position(op, y)
    assert found.kind == "stiction"
    assert pytest.approx(4.0, rel=0.04) == found.valve.S
    assert found.valve.S * found.valve.ratio == pytest.approx(2.0, rel=0.12)
    assert found.S_range[0] <= 4.0 <= found.S_range[1]


@pytest.mark.parametrize(
    ("valve", "S", "J"), [(st.Stenman(3.0), 3.0, 3.0), (st.He(3.0, 1.0), 4.0, 2.0), (st.Kano(1.5, 0.6), 1.5, 0.6)]
)
def test_stems_that_rest_after_every_sample_are_found_too(valve, S, J):
    op = wandering(3, noise=0.05)
    found = fit_position(op, stem(valve, op, 0.05))
    assert found.kind == "stiction"
    assert pytest.approx(S, rel=0.05) == found.valve.S
    assert found.valve.S * found.valve.ratio == pytest.approx(J, rel=0.1)


def test_deadband_alone_is_no_stiction():
    op = wandering(4)
    found = fit_position(op, stem(st.Kano(3.0, 0.0), op))
    assert found.kind == "deadband"
    assert pytest.approx(3.0, rel=0.03) == found.valve.S
    assert found.likelihood_ratio < 12.0 < found.deadband_ratio


@pytest.mark.parametrize("lag", [0.0, 1.44, 5.0])
@pytest.mark.parametrize("noise", [0.05, 0.3])
def test_a_good_valve_is_good(lag, noise):
    op = wandering(5)
    decay = np.exp(-1.0 / lag) if lag else 0.0
    y = lfilter([1.0 - decay], [1.0, -decay], op, zi=[decay * op[0]])[0]
    found = fit_position(op, y + noise * np.random.default_rng(1).normal(size=N))
    assert found.kind == "good"
    assert found.likelihood_ratio < 0.0
    assert found.explained > 95.0


@pytest.mark.parametrize("lag", [0.5, 3.0, 8.0])
@pytest.mark.parametrize("fastest", [0.5, 2.0, 100.0])
def test_a_good_valve_that_follows_steps_of_op_slowly_is_good(lag, fastest):
    rng = np.random.default_rng(2)
    op = np.repeat(rng.uniform(25.0, 75.0, 20), 100) + np.convolve(rng.normal(size=2019), np.ones(20) / 20.0, "valid")
    y = op.copy()
    for k in range(1, op.size):
        y[k] = y[k - 1] + np.clip((op[k] - y[k - 1]) / (lag + 0.5), -fastest, fastest)
    assert fit_position(op, y + 0.02 * rng.normal(size=op.size)).kind == "good"


def no_measurements():
    """Positions that say nothing about the stem."""
    op, rng = wandering(), np.random.default_rng(0)
    return {
        "copy": op,
        "coarse copy, late, in mA": 4.0 + 0.16 * np.round(np.concatenate([op[:1], op[:-1]]) / 0.5) * 0.5,
        "frozen": np.full(N, 43.0),
        "frozen with noise": 43.0 + 0.1 * rng.normal(size=N),
        "unrelated": 50.0 + 5.0 * np.sin(np.arange(N) / 7.3) + 0.1 * rng.normal(size=N),
        "missing": np.where(np.arange(N) < 30, op, np.nan),
    }


@pytest.mark.parametrize("kind", no_measurements())
def test_a_position_that_says_nothing_about_the_stem_is_not_used(kind):
    assert fit_position(wandering(), no_measurements()[kind]) is None


def test_a_good_valve_with_noise_is_no_copy():
    op = wandering()
    assert not is_copy(op, op + 0.05 * np.random.default_rng(0).normal(size=N))
    assert not is_copy(op, stem(st.Kano(2.0, 1.0), op, 0.0))


@given(length=some.integers(1, 12), first=some.integers(0, 11), seed=some.integers(0, 99))
def test_held_values_are_recognised(length, first, seed):
    values = np.random.default_rng(seed).normal(size=100)
    held = np.repeat(values, length)[(length - first % length) % length :]
    assert hold_length(held) == (length, first % length)


def looped(seed):
    """OP and position of a sticky valve in its loop, and its S and J: He's in odd loops, Kano's in even ones."""
    rng = np.random.default_rng(seed)
    fs, ratio, gain, lag, dead_time = rng.uniform((1.0, 0.15, 0.6, 4.0, 2.0), (3.5, 0.85, 2.5, 30.0, 10.0))
    S, J = fs * (1.0 + ratio), fs * (1.0 - ratio)
    valve = st.He(fs, ratio * fs) if seed % 2 else st.Kano(S, J)
    controller = st.PID(0.5 * lag / (gain * (dead_time + 0.5 * lag)), max(lag, 8.0))
    t = np.arange(1500.0)
    load = rng.uniform(0.0, 2.0) * np.sin(2.0 * t / rng.uniform(150.0, 400.0)) + rng.uniform(0.0, 3.0) * (t > 200.0)
    loop = st.Loop(controller, valve, st.FOPDT(gain, lag, dead_time), dt=1.0, noise=0.08 * gain)
    run = st.simulate(loop, 310.0, 1500.0, load, seed=seed, pv_start=310.0, op_start=61.0)
    return run.op, run.mv + (0.005, 0.05, 0.2)[seed % 3] * rng.normal(size=1500), S, J


def test_valves_in_their_loops_are_found():
    S_error, J_error = [], []
    for seed in range(36):
        op, y, S, J = looped(seed)
        valve = fit_position(op, y).valve
        S_error.append(abs(valve.S / S - 1.0))
        J_error.append(abs(valve.S * valve.ratio / J - 1.0))
    assert np.median(S_error) < 0.05
    assert np.mean(np.less(S_error, 0.15)) >= 0.75
    assert np.mean(np.less(J_error, 0.15)) >= 0.7


@settings(deadline=None, max_examples=25)
@given(S=some.floats(0.5, 6.0), ratio=some.floats(0.0, 1.0), seed=some.integers(0, 99), delay=some.integers(0, 5))
def test_the_line_of_the_true_stem_leaves_nothing(S, ratio, seed, delay):
    op = wandering(seed, 400)
    true = np.array(naive.kano(op.tolist(), S, ratio * S))
    position = 4.0 - 0.16 * np.concatenate([true[:1].repeat(delay), true[: op.size - delay]])
    signal = position_signal(op, position)
    if signal is not None:
        line = position_regression(signal).line(true)
        assert (line.slope, line.level, line.lag, line.delay) == pytest.approx((-0.16, 4.0, 0.0, delay), abs=1e-6)
        assert line.explained == pytest.approx(1.0)


def test_costs_equal_those_of_polynomial_fits():
    op = wandering()
    regression = position_regression(position_signal(op, stem(st.Kano(4.0, 2.0), op)))
    stems = regression.positions(np.array([[3.0, 0.4, 0.0, 0.0], [5.0, 1.0, 1.0, 0.2]]))
    index = np.flatnonzero(regression.weight)
    for cost, x in zip(regression.cost_of_positions(stems), stems, strict=True):
        best = np.inf
        for lag in regression.lags:
            decay = np.exp(-1.0 / lag) if lag else 0.0
            z = lfilter([1.0 - decay], [1.0, -decay], x, zi=[decay * x[0]])[0]
            for delay in regression.delays:
                best = min(best, float(np.polyfit(z[index - delay], regression.position[index], 1, full=True)[1][0]))
        assert cost == pytest.approx(index.size * np.log(best / index.size), rel=1e-6)


def test_a_stem_that_never_moves_explains_nothing():
    op = wandering()
    regression = position_regression(position_signal(op, stem(st.Kano(4.0, 2.0), op)))
    index = np.flatnonzero(regression.weight)
    still = index.size * np.log(float(np.var(regression.position[index])))
    for place in (50.0, 46.7, 53.123456789):
        assert regression.cost_of_positions(np.full((1, N), place))[0] == pytest.approx(still)


def test_the_true_valve_leaves_the_least_when_corrected():
    op = wandering(7, noise=0.05)
    observed = stem(st.Kano(4.0, 2.0), op, 0.05)
    problem = CorrectedStems(op, observed, position_noise(observed))
    rows = np.array([[4.0, 0.5, 0.0, 0.0], [3.0, 0.5, 0.0, 0.0], [5.0, 0.5, 0.0, 0.0], [4.0, 0.0, 0.0, 0.0]])
    cost = problem.evaluate(rows).cost
    assert cost[0] < cost[1:].min() - 100.0
    assert np.exp(cost[0] / N) == pytest.approx(0.05**2, rel=0.4)


def test_a_record_takes_little_time():
    op = wandering()
    y = stem(st.Kano(4.0, 2.0), op)
    fit_position(op, y)
    began = time.process_time()
    fit_position(op, y)
    assert time.process_time() - began < 0.3
