"""The explanation shows the numbers of the diagnosis, step by step."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

import stiction as st
from report.diagnoses import diagnosis, identification, record
from stiction.diagnosis.identification.result import ControllerFit, ProcessFit
from stiction.diagnosis.loop_state import LoopState, StateStretch
from stiction.diagnosis.verdict.features import FEATURES
from stiction.diagnosis.verdict.model import log_odds
from stiction.report import labels
from stiction.report.explanation import describe_controller, describe_identification, explanation_steps

DATA, STATE, OSCILLATION = "Are the data good enough?", "Is the loop in control?", "Does the loop oscillate?"
CONTROLLER, VALVE = "Which controller moves OP?", "Which valve and process explain the PV?"
ALTERNATIVES, PROBABILITY = "Which other explanation comes close?", "How probable is stiction?"
CAUSES, METHODS, VERDICT = "What makes the loop oscillate?", "What do published methods say?", "What is the verdict?"


@pytest.fixture(scope="module")
def found():
    return st.diagnose(record())


def steps_of(found):
    return {step.title: step for step in explanation_steps(found)}


def test_a_judged_loop_has_every_step_in_order(found):
    assert list(steps_of(found)) == [
        DATA, STATE, OSCILLATION, CONTROLLER, VALVE, ALTERNATIVES, PROBABILITY, CAUSES, METHODS, VERDICT,
    ]  # fmt: skip
    verdict, reason, action = steps_of(found)[VERDICT].lines
    assert verdict.startswith(labels.headline(found))
    assert (reason, action) == (found.reason, found.action)


def test_the_contributions_add_up_to_the_probability(found):
    step = steps_of(found)[PROBABILITY]
    assert len(step.table.rows) == len(FEATURES) + 1
    assert step.table.rows[-1][0] == "average of all loops"
    total = log_odds(found.prior) + sum(float(row[2]) for row in step.table.rows)
    assert total == pytest.approx(log_odds(found.probability), abs=0.005 * (len(FEATURES) + 1) + 1e-9)
    data = found.to_dict()
    total = log_odds(data["prior"]) + data["average_log_odds"] + sum(one["log_odds"] for one in data["features"])
    assert total == pytest.approx(log_odds(found.probability), abs=0.001)
    assert labels.format_probability(found.probability) in step.lines[0]


def test_the_alternatives_are_those_of_the_identification(found):
    table, ratios = steps_of(found)[ALTERNATIVES].table, found.identification.likelihood_ratios
    assert table.columns[1] == "2 ln(likelihood ratio) [-]"
    assert sorted(row[1] for row in table.rows) == sorted(map(labels.format_number, ratios.values()))
    assert table.rows[0][1] == labels.format_number(found.strongest_alternative[1])
    assert [row[0] for row in steps_of(diagnosis())[ALTERNATIVES].table.rows] == [
        "periodic load", "switching load", "good valve", "apart: sticky valve without slip jump",
    ]  # fmt: skip


def test_a_loop_that_is_not_in_control_has_its_state_and_no_causes():
    state = LoopState("pv_frozen", 60.0, 600.0, 0.9, {"pv": 148.7, "op_start": 50.0, "op_end": 85.0})
    steps = steps_of(diagnosis(verdict="undecided", found=False, loop_state=state, evidence=()))
    assert list(steps) == [DATA, STATE, OSCILLATION, VERDICT]
    assert steps[STATE].lines[0].startswith("PV is frozen: it stays at 148.7")
    assert steps[VERDICT].lines[0].startswith("PV is frozen")


def test_stretches_in_another_state_are_listed():
    stretch = StateStretch("manual", 0, 240, 0.0, 240.0)
    state = LoopState("in_control", 0.0, 2000.0, 0.88, stretches=(stretch,))
    lines = steps_of(diagnosis(loop_state=state))[STATE].lines
    assert lines == ["The loop is in control.", "The controller is in manual from 0\u00a0s to 4\u00a0min."]


def test_five_causes_have_a_row_each(found):
    table = steps_of(found)[CAUSES].table
    assert [row[0] for row in table.rows] == list(labels.CAUSES.values())
    assert [float(row[1]) for row in table.rows] == pytest.approx(
        list(found.oscillation_cause.to_dict().values()), abs=0.005
    )


def test_both_processes_are_described():
    valve = identification(record())
    lines = dict(describe_identification(replace(valve, linear=ProcessFit(1.2, 5.0, 2.0, True)), "%"))
    sticky = "gain 3 PV units per %, time constant 10 s, dead time 10 s."
    assert lines["Process with the sticky valve"].replace("\u00a0", " ") == sticky
    good = "integrating process, gain 1.2 PV units per % and second, dead time 2 s."
    assert lines["Process with a good valve"].replace("\u00a0", " ") == good


@pytest.mark.parametrize(("drift", "error", "shown"), [(math.nan, math.nan, False), (-0.31, 0.12, True)])
def test_a_drift_is_described_where_it_was_estimated(drift, error, shown):
    lines = dict(describe_identification(identification(record(), drift=drift, drift_error=error), "%"))
    assert lines.get("Drift of S") == ("S changes by -0.31 % per hour (standard error 0.12)." if shown else None)


@pytest.mark.parametrize(("low", "high", "limits"), [(0.7, 1.4, None), (0.0, 3.3, "J cannot be determined")])
def test_limits_of_the_estimate_are_described(low, high, limits):
    valve = identification(record(), J_low=low, J_high=high)
    found = dict(describe_identification(valve, "%")).get("Limits")
    assert (found is None) if limits is None else found.startswith(limits)


def test_a_controller_is_described_with_its_settings():
    fit = ControllerFit(0.2, 10.0, 0.97, 1.0, "PI", Kc_error=0.01, Ti_error=0.5)
    text = describe_controller(fit, "%").replace("\u00a0", " ")
    assert text == "PI with Kc 0.2 ± 0.01 % per PV unit, Ti 10 ± 0.5 s: explains 97 % of OP."
    integral = describe_controller(ControllerFit(0.0, 0.0, 1.0, 1.0, "I", Ki=0.02, exact=True), "%")
    assert "I with Ki 0.02 % per PV unit and s" in integral
    assert "every move of the controller" in integral
    assert describe_controller(ControllerFit(math.nan, math.nan, 0.0, 0.0, why="OP rests."), "%").endswith("OP rests.")
