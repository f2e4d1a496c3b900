"""(sb, sj, r) of the paper's eq. 5 from OP and PV, with intervals, and which model a record speaks for."""

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
from stiction.diagnosis.identification.comparison import ModelComparison, ModelShare
from stiction.diagnosis.identification.model_signals import rates_of, signals_of
from stiction.diagnosis.identification.valve_trials import stem_of
from stiction.errors import ParameterError, RecordError
from stiction.models.dialects import stick_to_jump

from .staircases import drawn

LOOPS = 30


@cache
def found(seed):
    valve, record, _, period = drawn(seed, "three_parameter")
    return valve, st.identify(record, "three_parameter", period=period)


@settings(deadline=None, max_examples=50)
@given(seed=some.integers(0, 10_000), sb=some.floats(0.2, 4.0), ratio=some.floats(0.0, 1.0), r=some.floats(0.0, 3.0))
def test_the_search_strokes_eq_5_repaired(seed, sb, ratio, r):
    op = 50.0 + np.cumsum(np.random.default_rng(seed).normal(0.0, 1.0, 100))
    mv = np.array(naive.srinivasan(op.tolist(), sb, ratio * sb, r, 1.0))
    if np.ptp(mv) > 0.0:
        signals = signals_of(st.LoopRecord("FC1", 1.0, op=op, pv=mv, mv=mv), None)
        np.testing.assert_allclose(stem_of(signals, np.array([sb, ratio * sb, r])), mv, atol=1e-12)


@pytest.mark.parametrize("seed", [2, 6, 8, 14])
def test_the_truth_is_found(seed):
    valve, result = found(seed)
    assert result.model == "three_parameter"
    assert result.parameters["sb"] == pytest.approx(valve.sb, rel=0.03)
    assert result.parameters["sj"] == pytest.approx(valve.sj, rel=0.1)
    assert result.parameters["r"] == pytest.approx(valve.r, rel=0.15, abs=0.01)
    assert stick_to_jump(result.parameters["sb"], result.parameters["sj"]) == pytest.approx((result.S, result.J))


def test_the_intervals_hold_the_truth():
    inside = {"sb": [], "sj": [], "r": []}
    for seed in range(LOOPS):
        valve, result = found(seed)
        for name, hits in inside.items():
            low, high = result.parameter_intervals[name]
            assert low <= result.parameters[name] <= high
            hits.append(low - 1e-9 <= getattr(valve, name) <= high)
    shares = {name: np.mean(hits) for name, hits in inside.items()}
    assert all(0.85 <= share <= 1.0 for share in shares.values()), shares


def test_where_r_cannot_be_told_the_interval_says_so():
    """OP goes in steps that are held: every r moves the stem alike."""
    rng = np.random.default_rng(1)
    op = np.repeat(50.0 + np.cumsum(rng.choice([-1.0, 1.0], 60) * rng.uniform(1.0, 4.0, 60)), 10)
    valve = st.Srinivasan(2.0, 1.0, 0.5)
    stem = st.stroke(valve, op, dt=1.0).mv
    pv = np.convolve(stem - stem[0], np.exp(-np.arange(60) / 8.0) / 8.0)[: op.size] + rng.normal(0.0, 0.02, op.size)
    record = st.LoopRecord("FC1", 1.0, op=op, pv=pv, mv=stem)
    result = st.identify(record, "three_parameter")
    assert result.parameter_intervals["r"] == (0.0, np.inf)
    assert "r cannot be told" in result.reason
    assert result.parameters["sb"] == pytest.approx(2.0, rel=0.1)
    assert json.loads(json.dumps(result.to_dict()))["parameter_intervals"]["r"] == [0.0, None]


def test_a_cycle_that_repeats_exactly_leaves_r_open():
    loop = st.Loop(st.PID(0.2, 10.0), st.Srinivasan(2.0, 1.0, 0.05), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    record = replace(st.simulate(loop, sp=10.0, duration=2000.0).window(500, 2000), mv=None)
    low, high = st.identify(record, "three_parameter", period=237.0).parameter_intervals["r"]
    fastest = float(np.abs(np.diff(record.op)).max())
    assert low <= 0.05 <= high
    assert high - low > 0.5 * fastest


def test_the_units_of_the_pv_and_of_time_do_not_matter():
    _, record, _, period = drawn(6, "three_parameter")
    plain = found(6)[1].parameters
    other = replace(record, pv=4.0 + 30.0 * record.pv, sp=4.0 + 30.0 * record.sp, dt=0.5)
    scaled = st.identify(other, "three_parameter", period=0.5 * period).parameters
    assert scaled["sb"] == pytest.approx(plain["sb"], rel=5e-3)
    assert scaled["sj"] == pytest.approx(plain["sj"], rel=2e-2)
    assert scaled["r"] == pytest.approx(2.0 * plain["r"], rel=0.05, abs=1e-9)


def test_with_the_stem_recorded_the_valve_is_fitted_to_it():
    valve, record, mv, period = drawn(1, "three_parameter")
    result = st.identify(replace(record, mv=mv), "three_parameter", period=period)
    assert result.parameters["sb"] == pytest.approx(valve.sb, rel=0.03)
    assert result.parameters["r"] == pytest.approx(valve.r, rel=0.1)
    low, high = result.parameter_intervals["r"]
    assert low <= valve.r <= high < np.inf
    assert result.process.gain == pytest.approx(2.0, rel=0.1)


def test_r_is_tried_where_op_moves():
    record = st.LoopRecord("FC1", 2.0, op=np.array([1.0, 1.0, 3.0, 2.0, 6.0]), pv=np.zeros(5))
    assert rates_of(record).tolist() == [0.0, 0.5, 1.0, 2.0, np.inf]


def test_stem_and_pv_lie_on_the_record():
    _, record, mv, _ = drawn(2, "three_parameter")
    result = found(2)[1]
    assert result.mv.shape == result.pv.shape == record.op.shape
    seen = np.isfinite(result.pv)
    assert seen.mean() > 0.7
    inside = slice(200, -50)
    apart = (result.mv - mv)[inside]
    assert np.sqrt(np.mean((apart - np.median(apart)) ** 2)) < 0.2 * np.std(mv)
    assert len(result.stretches) >= 1
    assert all(stretch.fit > 90.0 for stretch in result.stretches)


@pytest.mark.parametrize(
    ("model", "valve"),
    [
        ("kano", st.Kano(3.0, 1.0)),
        ("stenman", st.Stenman(2.0)),
        ("three_parameter", st.Srinivasan(2.0, 1.0, 0.05)),
        ("good", st.Ideal()),
    ],
)
def test_the_record_speaks_for_the_model_that_made_it(model, valve):
    sp = np.repeat(np.random.default_rng(0).uniform(7.0, 13.0, 60), 35)
    loop = st.Loop(st.PID(0.2, 10.0), valve, st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.1)
    record = replace(st.simulate(loop, sp, 2100.0, seed=3), mv=None)
    found = st.compare_models(record, period=130.0)
    assert (found.best, found.decided) == (model, True), found.summary()
    shares = {one.model: one.fit for one in found.models}
    # What contains another model explains as much.
    assert shares["three_parameter"] >= max(shares["kano"], shares["stenman"]) - 1e-9
    assert json.loads(json.dumps(found.to_dict()))["best"] == model


def test_a_bad_value_of_op_turns_no_comparison():
    sp = np.repeat(np.random.default_rng(0).uniform(7.0, 13.0, 60), 35)
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    record = replace(st.simulate(loop, sp, 2100.0), mv=None)
    op = record.op.copy()
    op[1000] = 9999.0
    found = st.compare_models(replace(record, op=op), period=130.0)
    assert (found.best, found.decided) == ("kano", True), found.summary()


def comparison(**bics):
    free = {"good": 0, "stenman": 1, "kano": 2, "three_parameter": 3}
    shares = [ModelShare(name, free[name], {}, 90.0, bic) for name, bic in bics.items()]
    return ModelComparison(tuple(sorted(shares, key=lambda one: one.bic)), 20.0, "pv", 6.0)


@pytest.mark.parametrize(
    ("bics", "best", "decided"),
    [
        ((90.0, 80.0, 10.0, 13.0), "kano", True),
        ((90.0, 10.0, 80.0, 5.0), "stenman", True),
        ((90.0, 12.0, 10.0, 15.0), "stenman", False),
        ((90.0, 30.0, 20.0, 10.0), "three_parameter", True),
        ((12.0, 11.0, 10.0, 15.0), "good", False),
        ((10.0, 11.0, 12.0, 15.0), "good", True),
    ],
)
def test_the_simplest_model_that_is_enough_is_named(bics, best, decided):
    found = comparison(**dict(zip(("good", "stenman", "kano", "three_parameter"), bics, strict=True)))
    assert (found.best, found.decided) == (best, decided)
    assert ("does not tell" in found.summary()) is not decided


def test_bad_input_is_named():
    _, record, mv, _ = drawn(0, "stenman")
    with pytest.raises(ParameterError, match="three_parameter"):
        st.identify(record, "lugre")
    with pytest.raises(RecordError, match="MV does not vary"):
        st.identify(replace(record, mv=np.full(mv.size, 50.0)), "three_parameter")
