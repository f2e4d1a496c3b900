"""Stenman's d from OP and PV, and what it has to do with S and J."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import naive
import stiction as st
from stiction.diagnosis.identification.model_signals import signals_of
from stiction.diagnosis.identification.processes import Processes
from stiction.diagnosis.identification.valve_trials import answer_of, stem_of, try_valves

from .staircases import drawn
from .twin import about_local_mean, lag, least_squares, shifted

LOOPS = 24
STENMAN = [2.0, 2.0, np.inf]


@cache
def found(seed):
    valve, record, _, period = drawn(seed, "stenman")
    return valve, st.identify(record, "stenman", period=period)


def whole(op, mv, **changes):
    """A record compared by its stem."""
    return signals_of(st.LoopRecord("FC1", 1.0, op=op, pv=mv, mv=mv, **changes), None)


@settings(deadline=None, max_examples=50)
@given(seed=some.integers(0, 10_000), d=some.floats(0.1, 5.0))
def test_the_search_strokes_the_sliding_rule(seed, d):
    op = 50.0 + np.cumsum(np.random.default_rng(seed).normal(0.0, 1.0, 100))
    mv = np.array(naive.stenman(list(op), d))
    if np.ptp(mv) > 0.0:
        np.testing.assert_allclose(stem_of(whole(op, mv), np.array([d, d, np.inf])), mv, atol=1e-12)


@settings(deadline=None, max_examples=50)
@given(seed=some.integers(0, 10_000), d=some.floats(0.1, 5.0))
def test_kanos_valve_with_S_and_J_of_d_is_the_same_where_no_small_move_follows_a_slip(seed, d):
    """Every move is larger than 2 d or turns back, so that Kano's stem never slides where Stenman's rests."""
    rng = np.random.default_rng(seed)
    sizes = np.where(rng.random(60) < 0.5, rng.uniform(2.1, 4.0, 60), rng.uniform(0.0, 0.99, 60)) * d
    op = 50.0 + np.cumsum(sizes * np.where(np.arange(60) % 2, 1.0, -1.0))
    assert naive.kano(list(op), d, d) == pytest.approx(naive.stenman(list(op), d))


@settings(deadline=None, max_examples=50)
@given(seed=some.integers(0, 10_000), d=some.floats(0.1, 5.0))
def test_else_they_are_never_more_than_d_apart(seed, d):
    op = list(50.0 + np.cumsum(np.random.default_rng(seed).normal(0.0, 1.0, 200)))
    apart = np.subtract(naive.kano(op, d, d), naive.stenman(op, d))
    assert np.abs(apart).max() <= d * (1.0 + 1e-9)


def test_on_a_slow_ramp_they_part():
    op = np.arange(0.0, 10.0, 0.25)
    assert np.ptp(np.subtract(naive.kano(list(op), 2.0, 2.0), naive.stenman(list(op), 2.0))) > 1.0


@pytest.mark.parametrize("integrates", [False, True])
def test_what_the_kernel_leaves_is_what_least_squares_leaves(integrates):
    rng = np.random.default_rng(3)
    op = 50.0 + np.cumsum(rng.normal(0.0, 0.7, 300))
    record = st.LoopRecord("FC1", 1.0, op=op, pv=rng.normal(0.0, 1.0, 300) + 0.3 * op)
    signals = signals_of(record, 40.0)
    assert len(signals.windows) == 1
    assert signals.width == 1
    process = Processes(np.array([np.inf if integrates else 6.0]), np.array([2.0]), np.array([3, 4]))
    trials = try_valves(signals._replace(sign=0.0), np.array([STENMAN]), process)
    mv = np.array(naive.stenman(list(op), 2.0))
    decay = 1.0 if integrates else np.exp(-1.0 / 6.0)
    z = about_local_mean(lag(lag(mv - mv.mean(), decay), np.exp(-0.5)), signals.half)
    begin, end = (int(x) for x in signals.windows[0])
    target = about_local_mean(record.pv, signals.half)[begin:end]
    one, two = shifted(z, 3, begin, end), shifted(z, 4, begin, end)
    left = [least_squares(columns, target) for columns in ([one], [two], [one, two])]
    allowed = [squares for weights, squares in left if np.all(weights > 0.0) or np.all(weights < 0.0)]
    assert trials.error[0] == pytest.approx(min(allowed) / np.sum(target**2), rel=1e-9)
    answer = answer_of(signals, mv, trials.process[0])[begin:end]
    assert np.sum((target - answer) ** 2) == pytest.approx(min(allowed), rel=1e-9)


def test_d_is_found():
    apart, fit, better = [], [], []
    for seed in range(LOOPS):
        valve, result = found(seed)
        assert result.model == "stenman"
        assert pytest.approx(result.parameters["d"]) == result.S == result.J
        apart.append(abs(result.parameters["d"] / valve.d - 1.0))
        fit.append(result.fit)
        better.append(result.fit - result.fit_linear)
    assert np.median(apart) < 0.01
    assert np.mean(np.less(apart, 0.03)) >= 0.75
    assert np.median(fit) > 99.5
    assert min(better) > 2.0


def test_the_intervals_hold_d():
    inside = []
    for seed in range(LOOPS):
        valve, result = found(seed)
        low, high = result.parameter_intervals["d"]
        assert low <= result.parameters["d"] <= high
        inside.append(low <= valve.d <= high)
    assert 0.85 <= np.mean(inside) <= 1.0


def test_the_units_of_the_pv_and_of_time_do_not_matter():
    _, record, _, period = drawn(5, "stenman")
    plain = found(5)[1]
    other = replace(record, pv=4.0 - 3.0 * record.pv, sp=4.0 - 3.0 * record.sp, dt=60.0)
    scaled = st.identify(other, "stenman", period=60.0 * period)
    # Rounding decides between neighbours of the search where they leave nearly the same.
    assert scaled.parameters["d"] == pytest.approx(plain.parameters["d"], rel=5e-3)
    assert scaled.process.gain == pytest.approx(-3.0 * plain.process.gain / 60.0, rel=0.02)
    assert scaled.process.dead_time == pytest.approx(60.0 * plain.process.dead_time, rel=0.02, abs=3.0)


def test_with_the_stem_recorded_d_is_exact():
    valve, record, mv, period = drawn(4, "stenman")
    result = st.identify(replace(record, mv=mv), "stenman", period=period)
    assert result.parameters["d"] == pytest.approx(valve.d, rel=0.01)
    assert result.fit > 99.9
    assert np.ptp(result.mv - mv) < 0.3 * valve.d
