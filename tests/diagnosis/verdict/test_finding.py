"""What is said first of a loop, and the next step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.apps import cli
from stiction.diagnosis.verdict.finding import FINDINGS, grade
from stiction.display.duration_format import format_seconds
from stiction.records.conditioned import condition
from stiction.report.labels import FINDINGS as FINDING_LINES
from stiction.report.labels import headline

from .results import make_diagnosis, make_identification, make_segment

PLAY, SMALL_PLAY = make_identification(J=0.1), make_identification(S=0.4, J=0.0)


@pytest.mark.parametrize(
    ("changes", "finding"),
    [
        ({"probability": 0.95}, "sticks"),
        ({"probability": 0.75}, "probably_sticks"),
        ({"probability": 0.1, "causes": {"tuning": 0.9}, "S_detectable": 0.5}, "tuning"),
        ({"probability": 0.1, "causes": {"set_point": 0.9}, "S_detectable": 0.5}, "follows"),
        ({"probability": 0.1, "causes": {"rate_limit": 0.9, "tuning": 0.6}}, "rate_limit"),
        ({"probability": 0.1, "causes": {"external": 0.9}, "S_detectable": 0.5}, "external"),
        ({"probability": 0.1, "causes": {"external": 0.9, "tuning": 0.8}, "S_detectable": 0.5}, "tuning"),
        ({"probability": 0.1, "causes": {"valve": 0.9}, "identification": PLAY}, "backlash"),
        ({"probability": 0.1, "causes": {"valve": 0.9}}, "cannot_tell"),
        (
            {"probability": 0.1, "causes": {"valve": 0.9}, "identification": SMALL_PLAY, "oscillating": False},
            "nothing_found",
        ),
        ({"probability": 0.1, "stuck": True, "verdict": "undecided"}, "valve_not_responding"),
        ({"probability": 0.1, "stuck": True, "S_detectable": 0.5}, "nothing_found"),
        ({"probability": 0.1, "op_is_position": True, "verdict": "undecided", "stuck": True}, "not_in_command"),
        ({"probability": 0.95, "op_is_position": True}, "sticks"),
        ({"probability": 0.1, "S_detectable": 0.5, "causes": {"tuning": 0.5}}, "cause_unknown"),
        ({"probability": 0.4}, "cause_unknown"),
        ({"probability": 0.1, "oscillating": False, "S_detectable": 0.5}, "nothing_found"),
        ({"probability": 0.1, "oscillating": False, "verdict": "undecided"}, "cannot_tell"),
        ({"probability": 0.25, "state": "valve_not_responding"}, "valve_not_responding"),
        ({"probability": 0.25, "state": "manual"}, "not_in_command"),
        ({"probability": 0.25, "state": "bad_data"}, "no_data"),
    ],
)
def test_finding(changes, finding):
    found = make_diagnosis(**changes)
    assert found.finding == finding
    assert found.finding in FINDINGS
    assert found.to_dict()["finding"] == finding


def test_five_grades():
    words = [grade("stiction", 0.95), grade("stiction", 0.75), grade("undecided", 0.5), grade("no_stiction", 0.2),
             grade("no_stiction", 0.02)]  # fmt: skip
    assert words == ["sticks", "probably sticks", "cannot tell", "probably does not stick", "does not stick"]


def test_manual_test_lasts_three_periods():
    """The period of the test loop is 60 s."""
    found = make_diagnosis(0.1, causes={"external": 0.5, "tuning": 0.5}, S_detectable=0.5, verdict="undecided")
    assert "in manual for three periods (3 min" in found.next_step
    assert found.action == found.next_step


def test_an_op_that_is_the_position_of_the_valve_is_asked_about():
    found = make_diagnosis(0.1, op_is_position=True, verdict="undecided")
    assert "not the position of the valve" in found.next_step
    assert found.action == found.next_step
    assert "OP moves as no controller of SP - PV would" in found.reason


def test_step_is_twice_the_smallest_stiction_that_matters():
    found = make_diagnosis(0.1, oscillating=False, verdict="undecided", smallest_S=3.0)
    assert "A step of OP would show whether its valve sticks: by 6 % each way in manual" in found.next_step


def test_headline_leads_with_the_finding():
    tuning = make_diagnosis(0.02, causes={"tuning": 0.9}, S_detectable=0.5)
    assert headline(tuning).startswith("Controller tuning; the valve does not stick above S\u00a0=\u00a00.5")
    assert headline(make_diagnosis(segment=make_segment("manual"))).endswith("cannot tell whether the valve sticks")
    assert set(FINDING_LINES) == set(FINDINGS)


def test_json_tells_play_from_stiction():
    assert make_diagnosis(0.1, identification=PLAY).to_dict()["stiction"]["kind"] == "backlash"
    assert make_diagnosis(0.95).to_dict()["stiction"]["kind"] == "stiction"


@pytest.mark.parametrize(
    ("changes", "size"),
    [
        ({"probability": 0.95}, 12.0),  # 3 S
        ({"probability": 0.1, "oscillating": False, "verdict": "undecided"}, 4.0),  # 2 % each way
        ({"probability": 0.4, "S_detectable": None}, 4.0),
        ({"probability": 0.1, "stuck": True, "verdict": "undecided"}, 4.0),
    ],
)
def test_one_plan_is_written_said_and_ordered(changes, size, tmp_path):
    """Next step, command and work order are of one plan, with its size and time."""
    found = make_diagnosis(**changes)
    plan = found.valve_test
    assert plan is not None
    assert cli.main([*plan.command.split()[1:], "--out", str(tmp_path / "plan.csv")]) == 0
    op = np.loadtxt(tmp_path / "plan.csv", delimiter=",", skiprows=1)[:, 1]
    np.testing.assert_allclose(op, plan.op, atol=1e-6)
    assert np.ptp(op) == pytest.approx(size)
    assert format_seconds(plan.duration) in found.next_step
    assert found.manual_time >= plan.duration
    assert st.work_order(found).before[0] == plan


def test_open_question_of_a_quiet_loop_asks_nobody_to_act():
    found = make_diagnosis(0.1, oscillating=False, verdict="undecided")
    assert found.next_step.startswith("Nothing to do now: the loop does not oscillate.")
    assert found.action == found.next_step


def test_tests_stay_within_the_span():
    segment = make_segment()
    low = replace(segment, signals=condition(replace(segment.record, op=segment.record.op - 49.0)))
    plan = make_diagnosis(0.95, segment=low).valve_test
    assert (plan.settings["low"], plan.settings["high"]) == (0.0, 12.0)
