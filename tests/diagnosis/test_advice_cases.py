"""Advice on the kinds of loops on which it was wrong in the field, each drawn five times."""

from __future__ import annotations

import pytest

import stiction as st

from . import advice_cases as case

SEEDS = range(300, 305)
OPEN = {"cause_unknown", "cannot_tell"}
UNMOVED = {*OPEN, "valve_not_responding", "no_data"}
RIGHT = {
    case.load_sine: {"external"},
    case.load_sine_400: {"external"},
    case.load_sine_500: {"external"},
    case.load_on_a_slow_loop: {"external"},
    case.pressure_of_a_pair: {"external"},
    case.flow_of_a_pair: {"external"},
    case.primary_with_load: {"external"},
    case.secondary_that_follows: {"follows"},
    case.rate_limit: {"rate_limit", "tuning"},
    case.slower_rate_limit: {"rate_limit", "tuning"},
    case.unstable: {"tuning"},
    case.very_unstable: {"tuning"},
    case.unstable_at_35: {"tuning"},
    case.unstable_at_20: {"tuning"},
    case.unstable_from_10_to_90: {"tuning"},
    case.stuck: UNMOVED,
    case.stuck_120: UNMOVED,
    case.stuck_600: UNMOVED,
    case.stuck_900: UNMOVED,
    case.quiet_sticky: UNMOVED,
    case.motor_valve: UNMOVED,
    case.quiet_level: UNMOVED,
    case.quiet_pressure: UNMOVED,
    case.white_noise: {*OPEN, "nothing_found"},
    case.sine_set_point: {"follows"},
    case.ratio: {"follows"},
    case.time_proportioned: OPEN,
    case.pulses_logged: {"not_in_command", "no_data"},
    case.hunting: {"external"},
    case.position_as_op: {*OPEN, "not_in_command", "no_data"},
    case.sticky_secondary: {"sticks", "probably_sticks", "follows"},
}
"""Kind -> the findings that are right."""
LEFT_OPEN = {case.load_sine: 1, case.pressure_of_a_pair: 1, case.primary_with_load: 1, case.hunting: 1}
"""Kind -> how many of the five may leave the cause open."""
WRONG = {case.stuck_600: 2, case.stuck_900: 1, case.time_proportioned: 2}
"""Kind -> how many of the five still name a false cause, or nothing where something is."""
NOT_GOOD = (case.stuck, case.stuck_120, case.stuck_600, case.stuck_900, case.quiet_sticky, case.quiet_level,
            case.quiet_pressure, case.sticky_secondary, case.position_as_op)  # fmt: skip
"""Kinds in which the valve sticks."""


@pytest.mark.parametrize("kind", RIGHT, ids=lambda kind: kind.__name__)
def test_advice(kind):
    found = [st.diagnose(kind(seed), methods=False) for seed in SEEDS]
    missed = [one.finding for one in found if one.finding not in RIGHT[kind]]
    wrong = [finding for finding in missed if finding not in OPEN]
    assert len(wrong) <= WRONG.get(kind, 0), wrong
    assert len(missed) - len(wrong) <= LEFT_OPEN.get(kind, 0), missed
    assert kind not in NOT_GOOD or all(one.verdict != "no_stiction" for one in found)
