"""Sentences of a diagnosis: what is said, and what never is."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import pytest

from stiction.diagnosis.loop_state import LoopState, StateStretch
from stiction.diagnosis.verdict.decision import Costs
from stiction.diagnosis.verdict.explanation import ALTERNATIVE_TEXT, feature_label
from stiction.diagnosis.verdict.features import FEATURES
from stiction.records.record import Provenance

from .results import RATIOS, make_diagnosis, make_identification, make_segment, make_zone


@pytest.mark.parametrize("oscillating", [True, False])
@pytest.mark.parametrize("probability", [0.02, 0.5, 0.97])
def test_no_action_is_said_only_of_a_good_valve_without_a_cause(probability, oscillating):
    plain = make_diagnosis(probability, oscillating=oscillating, S_detectable=0.5)
    assert ("No action" in plain.action) == (plain.finding == "nothing_found")
    for cause in ("tuning", "external", "set_point", "rate_limit", "sensor", "dead_zone"):
        assert "No action" not in make_diagnosis(probability, causes={cause: 0.9}).action


def test_both_are_said_where_it_sticks_and_something_else_moves_the_loop():
    found = make_diagnosis(0.95, causes={"valve": 0.95, "external": 0.9, "tuning": 0.8})
    assert "The valve sticks, and something else" in found.reason
    assert "load from outside" in found.reason
    assert "limit of stability" in found.reason
    assert found.action.startswith("Check packing")
    assert "upstream" in found.action
    assert "Lower the controller gain" in found.action


@pytest.mark.parametrize(
    ("probability", "start"),
    [(0.95, "A valve with"), (0.02, "Without a sticky valve the PV is"), (0.5, "The evidence")],
)
def test_the_verdict_and_the_closest_alternative(probability, start):
    found = make_diagnosis(probability)
    assert found.reason.startswith(start)
    assert found.strongest_alternative == ("relay_load", 80.0)
    compared = "A good valve with a load that switches predicts it less well."
    assert (compared in found.reason) == (found.verdict != "no_stiction")


@pytest.mark.parametrize(
    ("ratio", "fits"),
    [(-129.0, "better."), (-1.9, "about as well."), (1.9, "about as well."), (2.1, "less well.")],
)
def test_a_better_or_equal_explanation_is_called_so(ratio, fits):
    found = make_diagnosis(0.95, identification=make_identification(likelihood_ratios={"good": ratio}))
    assert f"A good valve predicts it {fits}" in found.reason


def test_no_stiction_says_how_much_is_excluded():
    assert "Stiction above 0.6 % would have shown." in make_diagnosis(0.02, S_detectable=0.6).reason
    assert "would have shown" not in make_diagnosis(0.95, S_detectable=0.6).reason


def test_costs_change_the_verdict_and_not_the_evidence():
    found = make_diagnosis(0.92, costs=Costs(100.0, 1.0, 1.0))
    assert found.verdict == "no_stiction"
    assert found.reason.startswith("A valve with a stiction band S of")
    assert "With these costs the verdict is 'no stiction' at this probability." in found.reason
    assert "With" not in make_diagnosis(0.92, costs=Costs(2.0, 1.0, 0.2)).reason


def test_the_prior_changes_the_probability_and_not_the_evidence():
    found = make_diagnosis(0.02, prior=0.01)
    assert found.reason.startswith("The evidence does not decide")
    sure = make_diagnosis(0.15, prior=0.01)
    assert (sure.verdict, sure.reason.startswith("A valve with a stiction band S of")) == ("no_stiction", True)
    assert "With a prior of 0.01 the probability of stiction is 0.15." in sure.reason


def test_every_alternative_has_a_sentence():
    ratios = dict(RATIOS)
    for name in ("good", "dead_zone", "relay_load", "periodic_load"):
        found = make_diagnosis(identification=make_identification(likelihood_ratios={**ratios, name: -5.0}))
        assert found.strongest_alternative == (name, -5.0)
        assert ALTERNATIVE_TEXT[name][1:] in found.reason


def test_a_dead_zone_is_named_with_its_range():
    clear = make_diagnosis(0.3, causes={"dead_zone": 0.9}, identification=make_identification(dead_zone=make_zone()))
    assert "between 47.0 and 53.0 %" in clear.reason
    assert "split range" in clear.reason
    once = make_identification(dead_zone=make_zone(op_reversals=1))
    unclear = make_diagnosis(0.3, causes={"dead_zone": 0.9}, identification=once, oscillating=False)
    assert "between 44.0 and 56.0 %" in unclear.reason
    assert "too few times" in unclear.reason
    assert "split-range" in unclear.action


def test_parts_left_out_are_said():
    stretch = StateStretch("pv_frozen", 100, 300, 100.0, 300.0)
    state = LoopState("in_control", 0.0, 1000.0, 0.8, stretches=(stretch,))
    assert "Left out: 20 % of the record (pv frozen)." in make_diagnosis(segment=make_segment(loop_state=state)).reason


def test_the_analysed_share_is_said_where_it_is_small():
    stretch = StateStretch("pv_frozen", 560, 630, 560.0, 630.0)
    state = LoopState("in_control", 0.0, 1000.0, 0.93, stretches=(stretch,))
    found = make_diagnosis(segment=make_segment(loop_state=state))
    assert "Analysed" not in found.reason
    quality = replace(found.quality, first=630, last=1000)
    part = make_diagnosis(segment=make_segment(loop_state=state, quality=quality))
    assert "Left out: 7 % of the record (pv frozen). Analysed: 37 % of the record, samples 630 to 999." in part.reason


def test_the_inner_loop_of_a_cascade_is_said():
    found = make_diagnosis()
    record = replace(found.record, provenance=replace(Provenance(), secondary_tag="FIC-102"))
    assert "set point of FIC-102" in make_diagnosis(segment=make_segment(record=record)).reason


def test_the_position_is_named_where_it_was_compared():
    found = make_diagnosis(identification=make_identification(by_position=True))
    assert "predicts the valve position better" in found.reason


def test_json_agrees_with_the_sentences():
    for probability, causes in product((0.02, 0.5, 0.97), ({}, {"external": 0.9})):
        found = make_diagnosis(probability, causes=causes)
        data = found.to_dict()
        assert (data["reason"], data["action"], data["verdict"]) == (found.reason, found.action, found.verdict)
        assert found.summary().startswith(f"FIC-101: {found.verdict}")


def test_every_feature_has_a_label():
    labels = {feature_label(feature.name) for feature in FEATURES}
    assert len(labels) == len(FEATURES)
