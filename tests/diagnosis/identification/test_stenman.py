"""Stenman's d from OP and PV, against loops with a known valve."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import naive
import stiction as st

from .staircases import drawn

LOOPS = 12


@cache
def found(seed):
    valve, record, _, period = drawn(seed, "stenman")
    return valve, st.identify(record, "stenman", period=period)


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
    assert np.abs(np.subtract(naive.kano(op, d, d), naive.stenman(op, d))).max() <= d * (1.0 + 1e-9)


def test_d_is_found_and_its_interval_holds_it():
    apart, inside, fit = [], [], []
    for seed in range(LOOPS):
        valve, result = found(seed)
        low, high = result.parameter_intervals["d"]
        assert result.model == "stenman"
        assert pytest.approx(result.parameters["d"]) == result.S == result.J
        assert low <= result.parameters["d"] <= high
        apart.append(abs(result.parameters["d"] / valve.d - 1.0))
        inside.append(low <= valve.d <= high)
        fit.append(result.fit - result.fit_linear)
    assert np.median(apart) < 0.01
    assert np.mean(np.less(apart, 0.03)) >= 0.85
    assert np.mean(inside) >= 0.8
    assert np.median(fit) > 2.0


def test_the_units_of_the_pv_and_of_time_do_not_matter():
    _, record, _, period = drawn(5, "stenman")
    plain = found(5)[1]
    other = replace(record, pv=4.0 - 3.0 * record.pv, sp=4.0 - 3.0 * record.sp, dt=60.0)
    scaled = st.identify(other, "stenman", period=60.0 * period)
    assert scaled.parameters["d"] == pytest.approx(plain.parameters["d"], rel=5e-3)
    assert scaled.process.gain == pytest.approx(-3.0 * plain.process.gain / 60.0, rel=0.02)
    assert scaled.process.dead_time == pytest.approx(60.0 * plain.process.dead_time, rel=0.02, abs=3.0)


def test_with_the_position_recorded_d_is_found_from_it():
    valve, record, mv, period = drawn(4, "stenman")
    result = st.identify(replace(record, mv=mv), "stenman", period=period)
    assert result.by_position
    assert result.parameters["d"] == pytest.approx(valve.d, rel=0.01)
    assert result.fit > 95.0
    assert np.median(np.abs(result.mv - mv)) < 0.02 * valve.d


def test_the_simulated_position_is_that_of_the_valve_found():
    _, record, _, _ = drawn(6, "stenman")
    result = found(6)[1]
    expected = st.stroke(st.Stenman(result.parameters["d"]), record.op, dt=1.0, mv_start=result.mv[0]).mv
    np.testing.assert_allclose(result.mv[1:], expected[1:], atol=1e-9)
