"""The work order: findings, order of suspects, and tests that do show what they are planned to show."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import stiction as st
from report.diagnoses import diagnosis, identification, record
from stiction.compensation.repair import residual_stiction
from stiction.compensation.shop_tests import acceptance_criteria, plan_acceptance_test, plan_staircase
from stiction.compensation.suspect_parts import rank_suspects
from stiction.compensation.work_order import work_order
from stiction.diagnosis.oscillation import find_oscillation
from stiction.errors import ParameterError
from stiction.records import LoopRecord
from stiction.simulation.confirming_tests import plan_confirming_ramp


@pytest.fixture(scope="module")
def run():
    return record(900)


def stroked(plan, S, J, noise=0.02):
    """The planned test on a Kano valve, its position measured with some noise."""
    mv = st.stroke(st.Kano(S, J), plan.op, dt=plan.dt, mv_start=plan.start).mv
    return LoopRecord("FV-101", plan.dt, op=plan.op, mv=mv + np.random.default_rng(1).normal(0.0, noise, mv.size))


@pytest.mark.parametrize(("S", "J"), [(1.5, 0.6), (3.0, 1.0), (5.0, 2.0), (9.0, 3.0), (14.0, 14.0)])
def test_the_tests_before_show_the_stiction_they_are_planned_for(S, J):
    ramp, steps = plan_confirming_ramp(40.0, S), plan_staircase(40.0, S)
    by_ramp, by_steps = st.analyse_ramp(stroked(ramp, S, J)), st.analyse_steps(stroked(steps, S, J))
    assert by_ramp.verdict == by_steps.verdict == "beyond limit"
    assert by_ramp.quantities()["S"].value == pytest.approx(S, rel=0.05)
    assert by_ramp.quantities()["sj"].value == pytest.approx(J, rel=0.1)
    assert by_steps.quantities()["S"].value == pytest.approx(S, abs=1.001 * steps.settings["fine_step"])


@pytest.mark.parametrize(
    ("S", "J", "verdict"), [(0.3, 0.1, "within limit"), (0.6, 0.2, "within limit"), (2.0, 0.5, "beyond limit")]
)
def test_the_test_after_accepts_a_good_valve_and_no_other(S, J, verdict):
    assert st.analyse_steps(stroked(plan_acceptance_test(50.0), S, J)).verdict == verdict


@pytest.mark.parametrize(("S", "J"), [(0.5, 0.5), (0.8, 0.4), (1.6, 0.3)])
def test_the_test_after_does_not_accept_a_small_S_as_it_was(run, S, J):
    limit = sum(residual_stiction(S))
    assert f"deadband plus stickband, S, at most {limit:.2g} % of span (half" in acceptance_criteria(S)[0]
    for share, refused in ((1.0, True), (0.3, False)):
        record = stroked(plan_acceptance_test(50.0, S), share * S, share * min(J, 0.4 * S), noise=0.005)
        assert (st.analyse_steps(record, limit=limit).verdict == "beyond limit") == refused
    found = replace(diagnosis(run=run), identification=identification(run, S, J))
    page = work_order(found).to_text()
    assert f"Pass: {acceptance_criteria(S)[0]}." in page
    assert f"Staircase of {plan_acceptance_test(50.0, S).settings['fine_step']:g} % steps" in page


@given(op=some.floats(0.0, 100.0), S=some.floats(0.01, 80.0))
@settings(max_examples=60)
def test_planned_tests_stay_within_the_span_and_reach_far_enough(op, S):
    stairs = plan_staircase(op, S)
    plans = (plan_confirming_ramp(op, S), *([stairs] if stairs else []), plan_acceptance_test(op, S))
    for plan in plans:
        assert plan.op.min() >= 0.0
        assert plan.op.max() <= 100.0
        assert plan.op[0] == plan.op[-1] == plan.start
    assert np.ptp(plans[0].op) >= min(2.0 * S, 99.9)
    if len(plans) == 3:
        ignored, followed = plans[1].settings["sizes"]
        assert plans[1].settings["fine_range"] >= 2.0 * S * (1.0 - 1e-9)
        assert ignored < S < followed or S <= 0.125
        assert plans[1].duration < 2.5 * 3600.0


def test_a_sticky_valve(run):
    order = work_order(diagnosis(run=run))
    page = order.to_text()
    for said in (
        "# Work order: control valve of FIC-101, repair",
        "plant.csv, from 2026-03-02 06:30, 15 min, sampled every 1 s",
        "probability of stiction 0.94",
        "S = 3.0 % of span (95 % 2.7 to 3.3)",
        "J = 1.0 % of span (95 % 0.7 to 1.4)",
        "Packing",
        "Ramp test:",
        "Staircase of 0.1 % steps over 2 % up and down",
        "deadband plus stickband, S, at most 1 % of span",
        "Stroke in mm (S is 0.03, J 0.01 of the stroke): ____",
        "Work done, by / date: ____",
    ):
        assert said in page
    assert "nan" not in page.lower()
    assert len(page.splitlines()) < 70, "one page"
    assert order.suspects[0].part.startswith("Packing")
    assert order.after[1] == order.before[0], "the same ramp test before and after"
    title, findings = order.summary().splitlines()
    assert title in page.splitlines()[0]
    assert "the valve sticks; probability of stiction 0.94" in findings


def test_reversals_a_day_follow_from_the_period(run):
    told = diagnosis(run=run, oscillation=replace(find_oscillation(run), oscillating=True, period=60.0))
    assert "about 2900 reversals of the stem a day" in work_order(told).to_text()


@pytest.mark.parametrize(
    ("J", "J_low", "J_high", "first", "why"),
    [
        (1.0, 0.7, 1.4, "Packing", "friction before play"),
        (0.05, 0.0, 0.2, "Linkage", "play before friction"),
        (0.5, 0.0, 2.0, "Packing", "it can be friction or play"),
    ],
)
def test_the_jump_orders_the_suspects(run, J, J_low, J_high, first, why):
    parts, says = rank_suspects(replace(identification(run, 3.0, J), J_low=J_low, J_high=J_high))
    assert parts[0].part.startswith(first)
    assert why in says
    assert len({part.part for part in parts}) == 5


@pytest.mark.parametrize(("J_low", "jumps"), [(0.35, False), (0.37, True)])
def test_what_is_said_of_an_open_J_agrees_with_the_order_of_the_suspects(run, J_low, jumps):
    found = replace(identification(run, 3.0, 2.9), J_low=J_low, J_high=3.0)
    assert ("The stem jumps" in rank_suspects(found)[1]) is jumps
    assert ("the valve jumps" in found.J_remark) is jumps
    assert ("cannot be determined" in found.J_remark) is not jumps


def test_what_is_not_known_is_left_to_fill_in(run):
    bare = replace(run, start=None, mv=None)
    order = work_order(diagnosis(run=bare, found=False))
    page = order.to_text()
    assert "date ____" in page
    assert "S and J in % of span (not identified; the tests are planned for S up to 5 %): ____" in page
    assert "Where to read the valve position" in page
    assert "does not show whether it is friction or play" in page
    assert math.isnan(order.S)
    assert order.to_dict()["S"] is None
    assert "Where to read the valve position" not in work_order(diagnosis(run=replace(run, mv=run.op))).to_text()


def test_undecided_asks_for_tests_not_for_a_repair(run):
    order = work_order(diagnosis(run=run, verdict="undecided"))
    assert order.title.endswith("test before any repair")
    assert "Verdict: cannot tell" in order.findings[0]


def test_a_good_valve_gets_no_order(run):
    with pytest.raises(ParameterError, match=r"FIC-101.*no stiction.*Lower the controller gain"):
        work_order(diagnosis(run=run, verdict="no_stiction"))


@pytest.fixture(scope="module")
def trial():
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    return st.compensate(loop, seeds=2)


def test_what_runs_meanwhile_is_named_with_its_settings(run, trial):
    page = work_order(diagnosis(run=run), replace(trial, recommended="knocker")).to_text()
    chosen = trial["knocker"]
    assert f"Recommended until the repair: knocker. {chosen.remedy.words}" in page
    assert f"Settings: amplitude {chosen.remedy.compensator.amplitude:.3g} %, width 2 s, interval 5 s." in page
    assert f"stem travel x {chosen.behaviour.travel / trial['do nothing'].behaviour.travel:.2f}" in page
    assert "ENABLE to FALSE" in page
    assert len(page.splitlines()) < 70


def test_without_a_remedy_nothing_is_switched_off(run, trial):
    nothing = work_order(
        diagnosis(run=run), replace(trial, recommended="do nothing", reason="It costs more.")
    ).to_text()
    refused = work_order(diagnosis(run=run), replace(trial, recommended=None, reason="No twin.")).to_text()
    untried = work_order(diagnosis(run=run)).to_text()
    assert "do nothing. Leave the loop as it is." in nothing
    assert "It costs more." in nothing
    assert "No remedy is recommended. No twin." in refused
    assert "No remedy was simulated" in untried
    assert not any("ENABLE to FALSE" in page for page in (nothing, refused, untried))


def test_json_holds_the_whole_order(run):
    told = json.loads(json.dumps(work_order(diagnosis(run=run)).to_dict(), allow_nan=False))
    assert told["S"] == 3.0
    assert told["before"][0]["kind"] == "ramp test"
    assert told["after"][0]["kind"] == "step test"
    assert told["suspects"][0]["part"].startswith("Packing")


def test_an_op_in_another_unit_is_said(run):
    page = work_order(diagnosis(run=replace(run, op=run.op - 60.0))).to_text()
    assert "not in % of span" in page
    assert "planned near 50 %" in page
    assert "Usual OP" not in page
    assert "`" not in page


def test_an_order_is_made_of_a_diagnosis_only(run):
    for other in (run, [run], None):
        with pytest.raises(ParameterError, match=r"diagnosis is of type .*; give the result of st\.diagnose"):
            work_order(other)
