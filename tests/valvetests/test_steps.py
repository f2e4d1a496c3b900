from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.valvetests.step_readings import find_no_response


def staircase(turn: float, hold: int = 5) -> np.ndarray:
    """0.1 % steps from 0 up to `turn` and down again, each held `hold` samples."""
    n = round(turn / 0.1)
    return np.repeat(np.round(0.1 * np.r_[0 : n + 1, n - 1 : -1 : -1], 9), hold)


def test_the_synthetic_isa_check():
    # N22a and G: S = 3, J = 1, moves at 1.1, 2.2 ... 7.7; turned at 7.9, the first move back comes at 4.6.
    record = st.stroke(st.Kano(S=3.0, J=1.0), staircase(7.9), 1.0, mv_start=-1.0)
    test = st.analyse_steps(record)
    moved = [round(step.op_after, 6) for step in test.steps if step.responded]
    assert moved[:8] == [1.1, 2.2, 3.3, 4.4, 5.5, 6.6, 7.7, 4.6]
    assert test.resolution.value == pytest.approx(1.1)
    assert test.S.value == pytest.approx(3.1)
    assert test.reversal_travel.value == pytest.approx(3.3)
    # S - J = 2, from two readings that are each rounded up to 0.1 %.
    assert test.deadband.value == pytest.approx(2.0)
    assert test.deadband.low == pytest.approx(1.9)
    assert test.deadband.high == pytest.approx(2.1)
    low, high = test.reversal_range
    assert low == pytest.approx(3.0)
    assert 4.0 <= high <= 4.0 + 2 * 0.1 + 1e-9
    assert test.verdict == "beyond limit"


@pytest.mark.parametrize("turn", [7.7, 8.0, 8.3, 8.7])
def test_the_travel_from_the_turning_point_lies_within_the_range(turn):
    test = st.analyse_steps(st.stroke(st.Kano(S=3.0, J=1.0), staircase(turn), 1.0, mv_start=-1.0))
    assert test.S.value == pytest.approx(3.1)
    assert test.reversal_travel.value == pytest.approx(3.1 + turn - 7.7)
    low, high = test.reversal_range
    assert low <= test.reversal_travel.value <= high + 0.1


def test_steps_cannot_tell_the_rate():
    # science 1.2: on held steps the stem is the same for every r, so the test must not claim one.
    tests = [
        st.analyse_steps(st.stroke(st.Srinivasan(2.0, 1.0, r), staircase(7.9), 1.0)) for r in (0.0, 0.02, math.inf)
    ]
    assert tests[0].quantities() == tests[1].quantities() == tests[2].quantities()
    assert all("A step test cannot measure r. Use a ramp test." in test.unknown for test in tests)
    assert "r" not in tests[0].quantities()


def first_order(op: np.ndarray, tau: float, dead: int, dt: float) -> np.ndarray:
    """Closed form sample by sample: y' = (u(t - dead dt) - y) / tau for an input held between samples."""
    keep = math.exp(-dt / tau)
    out = np.empty_like(op)
    y = op[0]
    for k in range(op.size):
        if k:
            y = keep * y + (1.0 - keep) * op[max(k - 1 - dead, 0)]
        out[k] = y
    return out


def test_response_times_of_a_first_order_valve():
    # T63 = Td + tau, T86 = Td + 2 tau, T98 = Td + tau ln 50 in closed form.
    dt, tau, dead = 0.05, 1.5, 10
    op = np.repeat([50.0, 55.0, 50.0, 45.0, 50.0, 52.0], 400)
    test = st.analyse_steps(st.LoopRecord("first order", dt, op=op, mv=first_order(op, tau, dead, dt)))
    # A step at sample k is answered from k + dead on: the hold of the closed form starts one sample later.
    assert test.t63.value == pytest.approx(dead * dt + tau, abs=2 * dt)
    assert test.t86.value == pytest.approx(dead * dt + 2 * tau, abs=2 * dt)
    assert test.t98.value == pytest.approx(dead * dt + tau * math.log(50.0), abs=3 * dt)
    assert test.dead_time.value == pytest.approx(dead * dt, abs=2 * dt)
    assert test.overshoot.value == 0.0


def test_overshoot():
    dt = 0.1
    t = np.arange(0.0, 60.0, dt)
    zeta, omega = 0.5, 1.0
    damped = omega * math.sqrt(1 - zeta**2)
    rise = 1 - np.exp(-zeta * omega * t) * (np.cos(damped * t) + zeta * omega / damped * np.sin(damped * t))
    op = np.concatenate([np.full(t.size, 40.0), np.full(t.size, 45.0)])
    mv = np.concatenate([np.full(t.size, 40.0), 40.0 + 5.0 * rise])
    test = st.analyse_steps(st.LoopRecord("second order", dt, op=op, mv=mv))
    # 100 exp(-pi zeta / sqrt(1 - zeta^2)) = 16.3 %
    assert test.overshoot.value == pytest.approx(16.3, abs=0.5)


def test_large_steps_lose_the_deadband_alone():
    op = np.repeat([50.0, 55.0, 60.0, 55.0, 50.0, 45.0, 50.0, 55.0], 20)
    test = st.analyse_steps(st.stroke(st.Kano(S=3.0, J=1.0), op, 1.0))
    assert test.deadband.value == pytest.approx(2.0, abs=0.01)
    # The model answers in the sample of the step: no time at all, never a negative one.
    assert test.dead_time.value == test.t63.value == test.t86.value == 0.0
    assert any("S below" in line for line in test.unknown)


def test_a_noisy_position_still_tells():
    record = st.stroke(st.Kano(S=3.0, J=1.0), staircase(7.9, hold=20), 1.0, mv_start=-1.0)
    mv = np.round(record.mv + 0.1 * np.random.default_rng(3).standard_normal(len(record)), 1)
    test = st.analyse_steps(replace(record, mv=mv))
    assert test.S.value == pytest.approx(3.1, abs=0.15)
    assert test.resolution.value == pytest.approx(1.1, abs=0.1)
    assert test.smallest_response < 0.5


def test_verdicts():
    plan = st.plan_step_test(50.0, fine_step=0.1, fine_range=2.0, sizes=[])
    good = st.analyse_steps(st.stroke(st.Kano(S=0.35, J=0.15), plan.op, 1.0))
    assert good.verdict == "within limit"
    assert st.analyse_steps(good.record, limit=0.15).verdict == "beyond limit"
    stuck = st.analyse_steps(st.stroke(st.Kano(S=20.0, J=1.0), plan.op, 1.0))
    assert stuck.verdict == "beyond limit"
    assert any("never responded" in line for line in stuck.unknown)
    one_way = st.analyse_steps(st.stroke(st.Kano(S=1.0, J=0.5), np.repeat(np.arange(50.0, 56.0, 0.5), 10), 1.0))
    assert one_way.verdict == "undecided"
    assert not one_way.reversal_travel.known


@pytest.mark.parametrize(
    ("S", "J", "travel", "least"),
    [(3.0, 1.0, 4.0, 2.0), (5.0, 2.0, 5.0, 5.0), (6.0, 1.0, 5.0, 5.0), (8.0, 3.0, 10.0, 5.0), (2.0, 2.0, 4.0, 2.0)],
)
def test_op_travel_without_a_response_bounds_S(S, J, travel, least):
    # 48 to 52 %, within a band of S + J that may be 2 S; or from the 55 % that it answered back to 50 %.
    test = st.analyse_steps(st.stroke(st.Kano(S, J), st.plan_step_test(50.0).op, 1.0))
    assert test.verdict == "beyond limit"
    assert "at least" in test.reason
    still = find_no_response(test.steps, test.smallest_response, is_position=True)
    assert still.travel == pytest.approx(travel)
    assert 0.9 * least < still.sure <= min(least, S)


@pytest.mark.parametrize(
    ("S", "J"), [(0.4, 0.4), (0.6, 0.5), (0.8, 0.3), (0.9, 0.05), (1.2, 0.1), (1.2, 1.1), (1.6, 0.6)]
)
@pytest.mark.parametrize("model", ["Kano", "Choudhury", "He"])
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_ramp_and_steps_judge_one_valve_alike(model, S, J, noise):
    """By S: deadband and resolution as steps read them would count the jump twice, S + J for a limit on S."""
    valve = st.He(0.5 * (S + J), 0.5 * (S - J)) if model == "He" else getattr(st, model)(S, J)
    verdicts = set()
    for plan, analyse in (
        (st.plan_ramp_test(low=40.0, high=60.0, threshold=0.05), st.analyse_ramp),
        (st.plan_step_test(50.0, fine_step=0.05), st.analyse_steps),
    ):
        run = st.stroke(valve, plan.op, plan.dt)
        test = analyse(replace(run, mv=run.mv + noise * np.random.default_rng(1).standard_normal(len(run))))
        assert pytest.approx(S, abs=0.06) == test.S.value
        verdicts.add(test.verdict)
    # What OP travels in a sample may be in the S of a ramp: so near to the limit it may leave it open.
    near = {"undecided"} if abs(S - 1.0) <= 0.1 else set()
    assert verdicts - near == {"within limit" if S <= 1.0 else "beyond limit"}


@pytest.mark.parametrize(("S", "J"), [(1.6, 0.6), (3.0, 1.0), (5.0, 4.0)])
def test_a_word_means_one_quantity_in_both_tests(S, J):
    ramp, step = st.plan_ramp_test(40.0, 60.0, threshold=0.05), st.plan_step_test(50.0, fine_step=0.05, fine_range=8.0)
    tests = [
        analyse(st.stroke(st.Kano(S, J), plan.op, plan.dt))
        for plan, analyse in ((ramp, st.analyse_ramp), (step, st.analyse_steps))
    ]
    for test in tests:
        form = test.to_dict()
        assert form["deadband"]["value"] == pytest.approx(S - J, abs=0.12)
        assert form["S"]["value"] == pytest.approx(S, abs=0.12)
        assert form["deadband"]["value"] < form["S"]["value"]
    assert "lost_motion" not in tests[1].summary()


@pytest.mark.parametrize("signal", ["mv", "pv"])
@pytest.mark.parametrize("noise", [0.05, 0.2, 0.5, 1.0])
def test_noise_turns_no_verdict_about(noise, signal):
    plan = st.plan_step_test(50.0)
    wrong = {True: "beyond limit", False: "within limit"}
    for S, J in ((0.0, 0.0), (0.3, 0.1), (0.5, 0.4), (0.8, 0.4), (1.2, 0.4), (3.0, 1.0), (5.0, 2.0)):
        record = st.stroke(st.Kano(S, J) if S else st.Ideal(), plan.op, plan.dt)
        for seed in range(3):
            stem = record.mv + noise * np.random.default_rng(seed).standard_normal(len(record))
            seen = {"mv": stem} if signal == "mv" else {"mv": None, "pv": 2.0 * stem + 3.0}
            test = st.analyse_steps(replace(record, **seen))
            assert test.verdict != wrong[S <= 1.0], (S, J, seed, test.reason)
            assert find_no_response(test.steps, test.smallest_response, signal == "mv").sure <= S


def test_a_reversal_counts_without_a_resolution():
    op = np.repeat([50.0, 54.0, 52.0, 50.0], 20)
    test = st.analyse_steps(st.stroke(st.Kano(S=3.0, J=1.0), op, 1.0))
    assert not test.resolution.known
    assert test.reversal_travel.low == pytest.approx(2.0)
    assert test.verdict == "beyond limit"
    assert find_no_response(test.steps, 0.0, is_position=True).sure == pytest.approx(test.reversal_travel.low)


def test_a_fine_range_that_was_too_narrow_is_to_be_widened():
    test = st.analyse_steps(st.stroke(st.Kano(S=3.0, J=1.0), st.plan_step_test(50.0).op, 1.0), limit=4.0)
    assert test.verdict == "undecided"
    for line in (test.reason, *(line for line in test.unknown if "below" in line)):
        assert "widen the fine range (--fine-range)" in line
        assert "finer steps" not in line.lower()
    # With steps of 5 % alone it is the steps that are too large.
    coarse = st.analyse_steps(
        st.stroke(st.Kano(S=3.0, J=1.0), st.plan_step_test(50.0, fine_range=0.0, sizes=[5.0]).op, 1.0)
    )
    assert any("Use finer steps" in line for line in coarse.unknown)


@pytest.mark.parametrize(("S", "J"), [(3.0, 1.0), (2.0, 2.0), (3.8, 0.1), (2.5, 1.4)])
def test_the_plan_says_which_valve_its_fine_range_cannot_move(S, J):
    # From the middle of its stick band a stem breaks loose (S + J) / 2 away.
    plan = st.plan_step_test(50.0, fine_range=2.0, sizes=[])
    moves = np.ptp(st.stroke(st.Kano(S, J), plan.op, plan.dt).mv) > 0.0
    assert moves == ((S + J) / 2 < 2.0)
    assert any("(S + J) / 2 is 2 % or more" in note and "--fine-range" in note for note in plan.notes)
    assert not any("fine range" in note for note in st.plan_step_test(50.0, fine_range=0.0).notes)


@pytest.mark.parametrize(("S", "J"), [(3.0, 1.0), (1.0, 1.0), (4.0, 0.5)])
def test_the_fine_range_that_reads_both(S, J):
    # From the top of the staircase, 2 R down: a travel of up to S + J, then a resolution of J.
    plan = st.plan_step_test(50.0, fine_range=S / 2 + J + 0.2, sizes=[])
    test = st.analyse_steps(st.stroke(st.Kano(S, J), plan.op, plan.dt))
    assert test.reversal_travel.known
    assert test.resolution.known


def test_step_of_zero_is_not_a_step():
    op = np.repeat([50.0, 55.0, 50.0, 50.0, 45.0, 50.0], 20)
    op[60:62] = 50.6, 49.7
    test = st.analyse_steps(st.stroke(st.Kano(S=1.0, J=0.5), op, 1.0))
    assert all(abs(step.op_after - step.op_before) > 0.1 for step in test.steps)


def test_records_without_steps_are_refused():
    with pytest.raises(st.RecordError, match="has no step"):
        st.analyse_steps(st.stroke(st.Kano(1.0, 1.0), np.full(200, 50.0), 1.0))
    ramp = st.plan_ramp_test(5.0, 15.0, rates=[0.05], wait=10.0)
    with pytest.raises(st.RecordError, match="analyse_ramp"):
        st.analyse_steps(st.stroke(st.Kano(1.0, 1.0), ramp.op, 1.0))
    noise = np.random.default_rng(0).standard_normal(500)
    with pytest.raises(st.RecordError, match="in automatic"):
        st.analyse_steps(st.stroke(st.Kano(1.0, 1.0), 50.0 + 4.0 * noise, 1.0))
    record = st.stroke(st.Kano(1.0, 1.0), staircase(5.0), 1.0)
    lost = record.mv.copy()
    lost[lost.size // 2 :] = np.nan
    with pytest.raises(st.RecordError, match=r"of MV .* missing"):
        st.analyse_steps(replace(record, mv=lost))


def test_before_and_after_a_repair():
    plan = st.plan_step_test(50.0, fine_step=0.1, fine_range=6.0, sizes=[])
    old, new = (st.analyse_steps(st.stroke(st.Kano(S=S, J=J), plan.op, 1.0)) for S, J in ((3.0, 1.0), (0.5, 0.2)))
    comparison = st.compare_tests(old, new)
    verdicts = {change.name: change.verdict for change in comparison.changes}
    assert verdicts["S"] == verdicts["resolution"] == "smaller"
    same = st.compare_tests(old, old)
    assert {c.verdict for c in same.changes} <= {"no change seen", "cannot tell"}
    json.dumps(comparison.to_dict(), allow_nan=False)
    ramp = st.plan_ramp_test(20.0, 40.0, threshold=0.05)
    other = st.analyse_ramp(st.stroke(st.Kano(3.0, 1.0), ramp.op, 1.0))
    with pytest.raises(st.ParameterError, match="cannot be compared"):
        st.compare_tests(old, other)


def test_plan_returns_to_its_start():
    plan = st.plan_step_test(50.0)
    assert plan.op[0] == plan.op[-1] == 50.0
    assert plan.upset == 5.0
    with pytest.raises(st.ParameterError, match="would leave 0 to 100"):
        st.plan_step_test(97.0)
    with pytest.raises(st.ParameterError, match="5 samples"):
        st.plan_step_test(50.0, hold=3.0)


def test_what_is_no_test_does_not_compare():
    with pytest.raises(st.ParameterError, match="before is of type str; give what analyse_ramp or"):
        st.compare_tests("before.csv", "after.csv")
