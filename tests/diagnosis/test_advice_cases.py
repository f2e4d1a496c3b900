"""Advice on the kinds of loops on which it was wrong in the field, each drawn five times."""

from __future__ import annotations

import pytest

import stiction as st

from . import advice_cases as case

SEEDS = range(300, 305)
OPEN = {"cause_unknown", "cannot_tell"}
UNMOVED = {*OPEN, "valve_not_responding"}
RIGHT = {
    case.load_sine: ({"external"}, 2),
    case.slow_load: ({"external"}, 3),
    case.load_on_a_slow_loop: ({"external"}, 3),
    case.rate_limit: ({"rate_limit", "tuning"}, 4, 1),
    case.unstable: ({"tuning"}, 4),
    case.stuck: (UNMOVED, 5),
    case.quiet_sticky: (UNMOVED, 5),
    case.quiet_level: (UNMOVED, 5),
    case.white_noise: ({*OPEN, "nothing_found"}, 5),
    case.sine_set_point: ({"follows"}, 5),
    case.ratio: ({"follows"}, 5),
    case.time_proportioned: (OPEN, 4, 1),
    case.pulses_logged: ({"not_in_command", "no_data"}, 5),
    case.hunting: ({"external"}, 3),
    case.position_as_op: ({*OPEN, "no_data"}, 4, 1),
    case.sticky_secondary: ({"sticks", "probably_sticks", "follows"}, 5),
}
"""Kind -> the findings that are right, in how many of the five at least, and how many may be wrong (else none); the
others leave the cause open."""
NOT_GOOD = (case.stuck, case.quiet_sticky, case.quiet_level, case.sticky_secondary)
"""Kinds in which the valve sticks."""


@pytest.mark.parametrize("kind", RIGHT, ids=lambda kind: kind.__name__)
def test_advice(kind):
    found = [st.diagnose(kind(seed), methods=False) for seed in SEEDS]
    right, least, *wrong = RIGHT[kind]
    assert sum(one.finding not in right | OPEN for one in found) <= sum(wrong)
    assert sum(one.finding in right for one in found) >= least
    assert kind not in NOT_GOOD or all(one.verdict != "no_stiction" for one in found)
