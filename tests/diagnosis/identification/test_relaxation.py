"""A good valve beside a relaxation oscillation from outside: what turns at levels of the PV is not the valve's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

import stiction as st
from stiction.diagnosis.identification.relaxation import relays


def filled_and_emptied(n, size, seed, slowest=0.02, fastest=0.12):
    """A level that goes up and down between two limits, each way at another speed."""
    rng = np.random.default_rng(seed)
    level, way, speed, out = 0.0, 1.0, 0.05, np.empty(n)
    for k in range(n):
        level += way * speed * size
        if abs(level) >= size and level * way > 0.0:
            level, way, speed = way * size, -way, rng.uniform(slowest, fastest)
        out[k] = level
    return out


def surging(seed, valve=None, n=3000):
    """A flow loop with a PV that such a level moves."""
    loop = st.Loop(st.PID(0.2, 10.0), valve or st.Ideal(), st.FOPDT(1.0, 5.0, 2.0), dt=1.0, noise=0.05)
    wave = filled_and_emptied(n, 3.0, seed)
    record = st.simulate(loop, 50.0, float(n), pv_disturbance=wave, seed=seed, pv_start=50.0, op_start=50.0)
    return replace(record, mv=None)


@pytest.mark.parametrize("seed", range(4))
def test_turns_at_levels_of_the_pv_are_not_the_valves(seed):
    found = st.identify(surging(seed))
    assert found.over("good").likelier > 200.0
    assert found.over("relaxation").likelier < 0.3 * found.over("good").likelier
    assert found.likelier_than_any <= found.over("relaxation").likelier
    assert found.beats_any <= found.over("relaxation").beats


@pytest.mark.parametrize("seed", range(4))
def test_slips_at_levels_of_op_are_the_valves(seed):
    """A load wanders, so that OP comes to a level where the PV does not."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(4.0, 1.5), st.FOPDT(1.0, 5.0, 2.0), dt=1.0, noise=0.05)
    wander = np.cumsum(np.random.default_rng(seed).normal(0.0, 0.15, 3000))
    record = st.simulate(loop, 50.0, 3000.0, wander - wander.mean(), seed=seed, pv_start=50.0, op_start=50.0)
    found = st.identify(replace(record, mv=None))
    assert found.over("relaxation").likelier > 0.7 * found.over("good").likelier > 100.0


@given(
    y=some.lists(some.floats(-5.0, 5.0), min_size=1, max_size=60),
    low=some.floats(-4.0, 4.0),
    width=some.floats(0.0, 4.0),
)
def test_a_relay_is_where_its_last_level_left_it(y, low, width):
    high = low + width
    told = []
    for k in range(len(y)):
        last = next((value for value in reversed(y[: k + 1]) if value >= high or value <= low), None)
        told.append(y[0] >= 0.5 * (low + high) if last is None else last >= high)
    np.testing.assert_array_equal(relays(np.array(y), np.array([low]), np.array([high]))[0] > 0.0, told)
