"""A good valve that is told the past without its noise: it takes from a small band what upsets lend it, not from one
that sticks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

import stiction as st
from stiction.diagnosis.identification.search import follow


def upset(valve, seed, size=2.0, every=300):
    """A flow loop whose load steps every five minutes and that rests in between."""
    load = np.repeat(np.random.default_rng(2000 + seed).normal(0.0, size, 3600 // every), every)
    loop = st.Loop(st.PID(0.2, 10.0), valve, st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.1)
    record = st.simulate(loop, 150.0, 3600.0, load, seed=seed, pv_start=150.0, op_start=50.0, loop_type="flow")
    return replace(record, mv=None)


@pytest.mark.parametrize("seed", range(3))
def test_what_upsets_lend_a_small_band_the_gate_takes_back(seed):
    found = st.diagnose(upset(st.Ideal(), seed)).identification
    assert found.over("good").likelier > 300.0
    assert found.over("gated").likelier < 0.6 * found.over("good").likelier
    assert found.likelier_than_any <= found.over("gated").likelier
    assert found.beats_any <= found.over("gated").beats


@pytest.mark.parametrize("seed", range(3))
def test_what_a_valve_does_that_sticks_no_gate_predicts(seed):
    found = st.diagnose(upset(st.Kano(5.0, 2.0), seed)).identification
    assert found.over("gated").likelier > 0.7 * found.over("good").likelier > 200.0


@given(y=some.lists(some.floats(-50.0, 50.0), min_size=2, max_size=60), width=some.floats(0.01, 20.0))
def test_the_gate_is_the_rule_of_play(y, width):
    told, at = [], y[0]
    for value in y:
        at += np.sign(value - at) * max(abs(value - at) - width, 0.0)
        told.append(at)
    gated = np.empty(len(y))
    follow(np.array(y), 2.0 * width, 0.0, gated)
    np.testing.assert_allclose(gated, told, atol=1e-6 * max(width, 1.0))
