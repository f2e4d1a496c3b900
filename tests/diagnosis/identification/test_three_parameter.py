"""(sb, sj, r) of the paper's eq. 5 from OP and PV, with intervals."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import naive
import stiction as st
from stiction.diagnosis.identification.three_parameter import op_moves, three_parameter_positions
from stiction.models.parameter_conversion import convert_bands

from .staircases import drawn

LOOPS = 9


@cache
def found(seed):
    valve, record, _, period = drawn(seed, "three_parameter")
    return valve, st.identify(record, "three_parameter", period=period)


@settings(deadline=None, max_examples=50)
@given(
    seed=some.integers(0, 10_000), sb=some.floats(0.2, 4.0), ratio=some.floats(0.0, 1.0),
    r=some.one_of(some.floats(0.0, 3.0), some.just(np.inf)),
)  # fmt: skip
def test_the_search_simulates_eq_5_repaired(seed, sb, ratio, r):
    op = 50.0 + np.cumsum(np.random.default_rng(seed).normal(0.0, 1.0, 100))
    sj = ratio * sb
    S = 2.0 * sb - sj
    found = three_parameter_positions(op, 1, np.array([[S, sj / S, r, 0.0]]))[0]
    np.testing.assert_allclose(found, naive.srinivasan(op.tolist(), sb, sj, r, 1.0), atol=1e-9)
    blocks = three_parameter_positions(op, 5, np.array([[S, sj / S, r, 0.0]]))[0]
    np.testing.assert_allclose(blocks, found.reshape(20, 5).mean(axis=1))


@pytest.mark.parametrize("seed", [2, 6, 8, 14])
def test_the_truth_is_found(seed):
    valve, result = found(seed)
    assert result.model == "three_parameter"
    assert result.parameters["sb"] == pytest.approx(valve.sb, rel=0.03)
    assert result.parameters["sj"] == pytest.approx(valve.sj, rel=0.1)
    assert result.parameters["r"] == pytest.approx(valve.r, rel=0.15, abs=0.01)
    bands = convert_bands(result.parameters["sb"], result.parameters["sj"], "sb, sj", "S, J")
    assert bands == pytest.approx((result.S, result.J))


def test_most_intervals_hold_the_truth():
    inside = {"sb": [], "sj": [], "r": []}
    for seed in range(LOOPS):
        valve, result = found(seed)
        for name, hits in inside.items():
            low, high = result.parameter_intervals[name]
            assert low <= result.parameters[name] <= high
            hits.append(low - 1e-9 <= getattr(valve, name) <= high)
    shares = {name: np.mean(hits) for name, hits in inside.items()}
    assert all(share >= 0.7 for share in shares.values()), shares


def test_r_is_open_where_every_r_moves_the_stem_alike():
    """OP goes in steps that are held."""
    rng = np.random.default_rng(1)
    op = np.repeat(50.0 + np.cumsum(rng.choice([-1.0, 1.0], 60) * rng.uniform(1.0, 4.0, 60)), 10)
    stem = st.stroke(st.Srinivasan(2.0, 1.0, 0.5), op, dt=1.0).mv
    pv = np.convolve(stem - stem[0], np.exp(-np.arange(60) / 8.0) / 8.0)[: op.size] + rng.normal(0.0, 0.02, op.size)
    result = st.identify(st.LoopRecord("FC1", 1.0, op=op, pv=pv), "three_parameter")
    assert result.parameter_intervals["r"] == (0.0, np.inf)
    assert "r cannot be determined" in result.reason
    assert result.parameters["sb"] == pytest.approx(2.0, rel=0.1)
    assert json.loads(json.dumps(result.to_dict()))["parameter_intervals"]["r"] == [0.0, None]


def test_the_units_of_the_pv_and_of_time_do_not_matter():
    _, record, _, period = drawn(6, "three_parameter")
    plain = found(6)[1].parameters
    other = replace(record, pv=4.0 + 30.0 * record.pv, sp=4.0 + 30.0 * record.sp, dt=0.5)
    scaled = st.identify(other, "three_parameter", period=0.5 * period).parameters
    assert scaled["sb"] == pytest.approx(plain["sb"], rel=5e-3)
    assert scaled["sj"] == pytest.approx(plain["sj"], rel=2e-2)
    assert scaled["r"] == pytest.approx(2.0 * plain["r"], rel=0.05, abs=1e-9)


def test_with_the_position_recorded_the_valve_is_fitted_to_it():
    valve, record, mv, period = drawn(6, "three_parameter")
    result = st.identify(replace(record, mv=mv), "three_parameter", period=period)
    assert result.by_position
    assert result.parameters["sb"] == pytest.approx(valve.sb, rel=0.03)
    assert result.parameters["sj"] == pytest.approx(valve.sj, rel=0.1)
    low, high = result.parameter_intervals["r"]
    assert low <= valve.r <= high
    assert result.process.gain == pytest.approx(2.0, rel=0.1)


def test_moves_of_op_that_turn_do_not_count():
    assert op_moves(np.array([1.0, 1.0, 3.0, 2.0, 6.0])).tolist() == [0.0, np.inf]
    assert op_moves(np.array([1.0, 2.0, 4.0, 4.5, 4.0])).tolist() == [0.0, 0.5, 2.0, np.inf]


def test_position_and_pv_lie_on_the_record():
    _, record, mv, _ = drawn(2, "three_parameter")
    result = found(2)[1]
    assert result.mv.shape == result.pv.shape == record.op.shape
    assert np.isfinite(result.pv).mean() > 0.7
    inside = slice(200, -50)
    assert np.sqrt(np.mean((result.mv - mv)[inside] ** 2)) < 0.2 * np.std(mv)
    compared = np.isfinite(result.pv)
    assert np.var((record.pv - result.pv)[compared]) < 0.05 * np.var(record.pv)
