from __future__ import annotations

import json
import math
import statistics
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as strategy

import stiction as st

LAB_RATES = (0.0667, 0.0167, 0.0125, 0.01)
LAB = st.Srinivasan(sb=3.0, sj=1.2, r=0.0145)


def lab_record(rates=LAB_RATES, valve=LAB, low=5.0, high=15.0) -> st.LoopRecord:
    plan = st.plan_ramp_test(low, high, rates=rates)
    return st.stroke(valve, plan.op, plan.dt)


def test_lab_rates_bracket_r_as_the_paper_says():
    # N25: 0.0667 and 0.0167 %/s follow, 0.0125 and 0.01 %/s go in stairs, so 0.0125 < r < 0.0167 %/s.
    test = st.analyse_ramp(lab_record())
    assert [ramp.behaviour for ramp in test.ramps] == ["follow"] * 4 + ["staircase"] * 4
    assert test.r_low == pytest.approx(0.0125, rel=1e-3)
    assert test.r_high == pytest.approx(0.0167, rel=1e-3)
    assert test.verdict == "beyond limit"
    # The frictionless line of the model is u = x, its deadband 2 (sb - sj).
    assert (test.offset, test.slope) == (pytest.approx(0.0, abs=0.05), pytest.approx(1.0, abs=0.005))
    assert test.deadband.value == pytest.approx(2 * (3.0 - 1.2), rel=0.02)
    # The fitted valve stays within a stair of the record.
    assert test.residual < 0.5 * 1.2


def test_all_rates_followed_or_all_in_stairs_leave_one_side_of_r_open():
    fast = st.analyse_ramp(lab_record(LAB_RATES[:2]))
    assert np.isnan(fast.r_low)
    assert any("Use slower ramps" in line for line in fast.unknown)
    slow = st.analyse_ramp(lab_record(LAB_RATES[2:]))
    assert np.isnan(slow.r_high)
    assert any("Use faster ramps" in line for line in slow.unknown)


def test_the_deadband_is_read_from_the_stairs_where_following_was_left_out():
    # At 0.2 %/s the OP steps over the break by up to 0.2 %: these slips stand out from the finer ones and are dropped.
    test = st.analyse_ramp(lab_record((0.2, 0.05), st.Srinivasan(sb=3.0, sj=1.0, r=0.1), low=30.0, high=60.0))
    assert {ramp.behaviour for ramp in test.ramps} == {"follow", "staircase"}
    assert test.deadband.value == pytest.approx(2 * (3.0 - 1.0), rel=0.02)


def test_one_direction_says_what_was_assumed():
    op = np.concatenate([np.full(30, 5.0), np.arange(5.0, 25.0, 0.01)])
    record = st.stroke(LAB, op, 1.0)
    test = st.analyse_ramp(record)
    assert test.sb.value == pytest.approx(3.0, rel=0.02)
    assert any("one direction" in line for line in test.unknown)
    by_flow = st.analyse_ramp(replace(record, mv=None, pv=4.0 * record.mv + 7.0))
    assert not by_flow.sb.known
    assert by_flow.sj.value == pytest.approx(1.2, rel=0.05)
    assert any("zero of the flow" in line for line in by_flow.unknown)


def test_bands_that_vary_over_the_travel_are_read_there():
    travel = np.array([10.0, 50.0, 90.0])
    band, jump = np.array([3.0, 6.0, 4.0]), np.array([1.5, 3.0, 2.0])
    valve = st.Srinivasan(st.Table(travel, band), st.Table(travel, jump), r=1.0)
    plan = st.plan_ramp_test(10.0, 90.0, rates=[0.05])
    test = st.analyse_ramp(st.stroke(valve, plan.op, 1.0), bins=8)
    slips = [event for event in test.events if event.kind == "slip"]
    assert len(slips) > 30
    for slip in slips:
        assert slip.stick_band == pytest.approx(np.interp(slip.position, travel, band), abs=0.35)
    assert all(b.n > 0 and b.low < b.high for b in test.travel)
    middle = [b.sb for b in test.travel if b.low < 50.0 <= b.high]
    assert min(middle) > 5.0


def test_a_stem_that_never_moves_is_an_answer_not_an_error():
    record = lab_record(valve=st.Srinivasan(20.0, 2.0, 0.0145))
    test = st.analyse_ramp(record)
    assert {ramp.behaviour for ramp in test.ramps} == {"did not slip"}
    assert test.verdict == "beyond limit"
    assert not test.sb.known
    assert test.valve is None
    assert "never moved" in test.unknown[0]


def test_a_good_valve_is_within_the_limit():
    record = lab_record(valve=st.Ideal())
    noisy = replace(record, mv=record.mv + 0.05 * np.random.default_rng(2).standard_normal(len(record)))
    test = st.analyse_ramp(noisy)
    assert test.verdict != "beyond limit"


def test_missing_position_steps_and_loops_in_automatic_are_refused():
    record = lab_record()
    with pytest.raises(st.RecordError, match=r"no mv|no pv"):
        st.analyse_ramp(replace(record, mv=None))
    half = record.mv.copy()
    half[::2] = np.nan
    with pytest.raises(st.RecordError, match=r"50 % of MV .* missing"):
        st.analyse_ramp(replace(record, mv=half))
    few = record.mv.copy()
    few[100:130] = np.nan
    assert st.analyse_ramp(replace(record, mv=few)).sb.value == pytest.approx(3.0, rel=0.02)
    steps = st.plan_step_test(50.0, fine_step=1.0, fine_range=6.0, sizes=[2.0])
    with pytest.raises(st.RecordError, match="analyse_steps"):
        st.analyse_ramp(st.stroke(LAB, steps.op, 1.0))
    with pytest.raises(st.RecordError, match="has no ramp"):
        st.analyse_ramp(replace(record, op=np.full(len(record), 5.0)))
    noise = np.random.default_rng(0).standard_normal(500)
    with pytest.raises(st.RecordError, match="in automatic"):
        st.analyse_ramp(st.stroke(LAB, 50.0 + 4.0 * noise, 1.0))
    with pytest.raises(st.ParameterError, match="signal"):
        st.analyse_ramp(record, signal="stem")


def test_json_and_summary():
    test = st.analyse_ramp(lab_record())
    form = json.loads(json.dumps(test.to_dict(), allow_nan=False))
    assert form["kind"] == "ramp test"
    assert form["sb"]["value"] == pytest.approx(3.0, rel=0.02)
    assert len(form["ramps"]) == 8
    assert "sb = " in test.summary()


@settings(deadline=None, max_examples=15)
@given(
    sb=strategy.floats(1.5, 4.0),
    share=strategy.floats(0.3, 1.0),
    shift=strategy.floats(-20.0, 20.0),
    scale=strategy.floats(0.5, 4.0),
)
def test_zero_and_unit_of_the_flow_do_not_matter(sb, share, shift, scale):
    plan = st.plan_ramp_test(30.0, 60.0, rates=[0.2, 0.025])
    record = st.stroke(st.Srinivasan(sb, share * sb, r=0.1), plan.op, 1.0)
    a = st.analyse_ramp(replace(record, mv=None, pv=record.mv))
    b = st.analyse_ramp(replace(record, mv=None, pv=shift + scale * record.mv))
    assert b.sb.value == pytest.approx(a.sb.value, rel=1e-6)
    assert b.sj.value == pytest.approx(a.sj.value, rel=1e-6)
    assert a.sb.value == pytest.approx(sb, rel=0.05)
    # A slip waits for the next sample: a jump grows by up to one increment of the OP.
    assert a.sj.value == pytest.approx(share * sb, rel=0.02, abs=0.03)


def test_plan_goes_to_a_file_whole_and_comes_back(tmp_path):
    plan = st.plan_ramp_test(5.0, 15.0, threshold=0.05, start=10.0, wait=20.0)
    path = plan.to_csv(tmp_path / "plan.csv")
    assert path.read_text().splitlines()[0] == "time_s,OP"
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[:, 0], plan.time)
    np.testing.assert_allclose(table[:, 1], plan.op, atol=1e-6)
    assert [p.name for p in tmp_path.iterdir()] == ["plan.csv"]
    assert plan.upset == 5.0
    assert plan.op[0] == plan.op[-1] == 10.0
    assert (plan.op.min(), plan.op.max()) == (5.0, 15.0)
    with pytest.raises(st.RecordError, match="cannot be written, because there is no folder"):
        plan.to_csv(tmp_path / "nowhere" / "plan.csv")


def test_a_long_plan_has_no_time_twice(tmp_path):
    plan = st.plan_ramp_test(20.0, 40.0, rates=[0.004], dt=0.05)
    stamps = [line.partition(",")[0] for line in plan.to_csv(tmp_path / "plan.csv").read_text().splitlines()[1:]]
    np.testing.assert_allclose(np.array(stamps, dtype=float), plan.time, atol=1e-6)


@pytest.mark.parametrize("flow", [5.0, np.random.default_rng(0).normal(5.0, 0.1, 3000)], ids=["frozen", "noise"])
def test_flow_without_response_gives_no_stem_estimate(flow):
    plan = st.plan_ramp_test(5.0, 25.0, rates=[0.05])
    run = st.stroke(st.Srinivasan(3.0, 1.5, r=0.05), plan.op, plan.dt)
    dead = replace(run, mv=None, pv=np.resize(flow, plan.op.size))
    for test in (st.analyse_ramp(dead), st.analyse_steps(replace(dead, op=np.round(dead.op)))):
        assert test.verdict == "undecided"
        assert "did not react" in test.reason


@pytest.mark.parametrize("wrong", [0.5, 2.5, 0.0])
def test_what_is_counted_is_whole(wrong):
    plan = st.plan_ramp_test(5.0, 25.0, rates=[0.05])
    run = st.stroke(st.Srinivasan(3.0, 1.5, r=0.05), plan.op, plan.dt)
    with pytest.raises(st.ParameterError, match="repeats"):
        st.plan_ramp_test(5.0, 25.0, rates=[0.05], repeats=wrong)
    with pytest.raises(st.ParameterError, match="bins"):
        st.analyse_ramp(run, bins=wrong)


@pytest.mark.parametrize(
    ("words", "arguments"),
    [
        ("not an increasing range", {"low": 15.0, "high": 5.0, "threshold": 0.01}),
        ("either threshold", {"low": 5.0, "high": 15.0}),
        ("not positive", {"low": 5.0, "high": 15.0, "rates": [-0.1]}),
        ("fewer than 20 samples", {"low": 5.0, "high": 15.0, "rates": [2.0]}),
        ("twice S", {"low": 5.0, "high": 15.0, "rates": [0.01], "S": 8.0}),
    ],
)
def test_a_plan_that_makes_no_sense_is_refused(words, arguments):
    with pytest.raises(st.ParameterError, match=words):
        st.plan_ramp_test(**arguments)


def test_one_rate_or_size_is_a_plan():
    assert st.plan_ramp_test(5.0, 25.0, rates=0.1).op.tolist() == st.plan_ramp_test(5.0, 25.0, rates=[0.1]).op.tolist()
    assert st.plan_step_test(50.0, sizes=2.0).op.tolist() == st.plan_step_test(50.0, sizes=[2.0]).op.tolist()


@pytest.mark.parametrize(("S", "lag", "noise"), [(0.0, 0.0, 0.0), (0.0, 2.0, 0.1), (0.3, 0.0, 0.02), (0.3, 3.0, 0.02)])
def test_a_stem_that_followed_every_ramp_has_the_deadband_between_its_ways(S, lag, noise):
    plan = st.plan_ramp_test(40.0, 60.0, rates=(0.2, 0.0625, 0.04, 0.025))
    air = plan.op.copy()
    for k in range(1, air.size):
        air[k] = plan.op[k] + (np.exp(-plan.dt / lag) if lag else 0.0) * (air[k - 1] - plan.op[k])
    record = st.stroke(st.Kano(S, 0.0), air, plan.dt)
    stem = record.mv + np.random.default_rng(1).normal(0.0, noise, air.size)
    test = st.analyse_ramp(replace(record, op=plan.op, mv=stem))
    assert [ramp.behaviour for ramp in test.ramps] == ["follow"] * 8
    if not test.sb.known:
        assert test.deadband.value == pytest.approx(S, abs=0.05)
        assert any("followed every ramp" in line for line in test.unknown)
    assert test.S.low - 0.02 <= S <= test.S.high
    assert test.verdict == "within limit"


def test_deadband_beyond_the_limit_is_found_without_slips():
    plan = st.plan_ramp_test(40.0, 60.0, rates=(0.2, 0.0625))
    record = st.stroke(st.Kano(3.0, 0.0), plan.op, plan.dt)
    test = st.analyse_ramp(record)
    assert test.verdict == "beyond limit"
    assert test.S.value == pytest.approx(3.0, abs=0.1)


def test_the_spread_in_a_stretch_of_the_travel_is_that_of_its_slips():
    """One stretch of a valve whose band and jump grow with its position, each direction by itself."""
    travel = np.array([10.0, 90.0])
    valve = st.Srinivasan(st.Table(travel, np.array([3.0, 6.0])), st.Table(travel, np.array([1.5, 3.0])), r=1.0)
    plan = st.plan_ramp_test(10.0, 90.0, rates=[0.05])
    test = st.analyse_ramp(st.stroke(valve, plan.op, 1.0), bins=1)
    assert sorted(one.direction for one in test.travel) == [-1, 1]
    for one in test.travel:
        slips = [event for event in test.events if event.kind == "slip" and event.direction == one.direction]
        assert one.n == len(slips) > 10
        assert one.sb_spread == pytest.approx(statistics.stdev(slip.stick_band for slip in slips))
        assert one.sj_spread == pytest.approx(statistics.stdev(slip.jump for slip in slips))
        known = statistics.stdev(float(np.interp(slip.position, travel, [3.0, 6.0])) for slip in slips)
        assert one.sb_spread == pytest.approx(known, rel=0.1)
        assert one.sj_spread == pytest.approx(known / 2.0, rel=0.1)


def test_one_slip_has_no_spread():
    plan = st.plan_ramp_test(30.0, 60.0, rates=[0.05])
    single = [
        one
        for one in st.analyse_ramp(st.stroke(st.Srinivasan(4.0, 2.0, 0.1), plan.op, 1.0), bins=40).travel
        if one.n == 1
    ]
    assert single
    assert all(math.isnan(one.sb_spread) and math.isnan(one.sj_spread) for one in single)
