"""What a diagnosis says first: a code, the grade of its words, and the cheapest next step."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np

from stiction.diagnosis.verdict.causes import cause_models
from stiction.display.duration_format import format_seconds
from stiction.display.finding_words import OPEN, can_wait
from stiction.display.number_format import format_number
from stiction.simulation.confirming_tests import plan_confirming_ramp, plan_confirming_step

if TYPE_CHECKING:
    from stiction.diagnosis.identification.result import Identification
    from stiction.diagnosis.result import Verdict
    from stiction.diagnosis.segment import JudgedSegment
    from stiction.diagnosis.verdict.causes import OscillationCause
    from stiction.simulation.valve_test_plan import TestPlan

__all__ = [
    "FINDINGS", "GRADES", "NOTHING_NOW", "Finding", "Findings", "explain_next_step", "find_code", "grade",
    "is_backlash", "manual_time", "plan_valve_test",
]  # fmt: skip

Finding = Literal[
    "sticks", "probably_sticks", "backlash", "tuning", "follows", "external", "set_point", "rate_limit", "dead_zone",
    "valve_not_responding", "not_in_command", "sensor", "no_data", "cause_unknown", "cannot_tell", "nothing_found",
]  # fmt: skip
FINDINGS: tuple[Finding, ...] = Finding.__args__  # type: ignore[attr-defined]
"""All codes."""
GRADES = ((0.9, "sticks"), (0.5, "probably sticks"), (0.1, "probably does not stick"), (0.0, "does not stick"))
"""Lowest probability of stiction of each grade [-], of a verdict that is a call."""
STATE_FINDINGS: dict[str, Finding] = {
    "valve_not_responding": "valve_not_responding", "not_in_command": "not_in_command", "manual": "not_in_command",
    "saturated": "not_in_command", "pv_frozen": "sensor",
}  # fmt: skip
"""State of a loop that is not in control -> what is said first; `no_data` of any other."""
TEST_PERIODS = 3.0
"""Periods in manual that show whether an oscillation comes from outside [-]."""
MIN_TEST_STEP = 2.0
"""Step of OP that moves a valve which hardly moved [% of span]."""
MAX_SETTLING = 300.0
"""Longest time that a test waits for the process [s]."""
MIDDLE_OP, ASSUMED_S = 50.0, 5.0
"""OP and S of a test where OP is not recorded in % of span [% of span]."""
NOTHING_NOW = "Nothing to do now: the loop does not oscillate."
"""Next step of a loop whose open question can wait."""
NEXT_STEPS = {
    "follows": "Look at what moves the set point: its master loop, ratio station or operator.",
    "rate_limit": "Raise the rate limit of OP, or lower the gain until OP stays below it.",
    "not_in_command": "Check that the OP column is the controller's output and not the position of the valve.",
    "backlash": "Move OP back and forth by twice the band in manual and watch the stem: play shows as lost motion.",
}
"""Finding -> the test that shows whether it is right."""


class Findings(Protocol):
    """What the code and the next step need to know; a `Diagnosis` has it."""

    @property
    def verdict(self) -> Verdict:
        """The verdict."""
        ...

    @property
    def probability(self) -> float:
        """Probability that the valve sticks [-]."""
        ...

    @property
    def oscillation_cause(self) -> OscillationCause:
        """Its causes."""
        ...

    @property
    def stuck(self) -> bool:
        """Whether the stem is stuck while something else moves PV."""
        ...

    @property
    def op_is_position(self) -> bool:
        """Whether the recorded OP is the position of the stem."""
        ...

    @property
    def identification(self) -> Identification | None:
        """Stiction and process."""
        ...

    @property
    def S_detectable(self) -> float | None:
        """Smallest S that would have shown [% of span]."""
        ...

    @property
    def segment(self) -> JudgedSegment:
        """The judged part, with loop state and oscillation."""
        ...

    @property
    def smallest_S(self) -> float:
        """Smallest S that matters [% of span]."""
        ...

    @property
    def finding(self) -> Finding:
        """The code."""
        ...

    @property
    def valve_test(self) -> TestPlan | None:
        """The test that moves OP."""
        ...

    @property
    def next_step(self) -> str:
        """The cheapest test that decides what is open."""
        ...


def grade(verdict: Verdict, probability: float) -> str:
    """Word of a verdict and its probability, one of five grades.

    Examples
    --------
    >>> grade("stiction", 0.95), grade("no_stiction", 0.2), grade("undecided", 0.4)
    ('sticks', 'probably does not stick', 'cannot tell')
    """
    if verdict == "undecided":
        return "cannot tell"
    return next(word for limit, word in GRADES if probability >= limit)


def is_backlash(causes: OscillationCause, identification: Identification | None, smallest_S: float) -> bool:
    """Whether the valve is named as a cause by its play: it moves the loop, has no slip jump, and a band that matters.

    `smallest_S` is the smallest band that matters [% of span].
    """
    if causes.main != "valve" or identification is None:
        return False
    return identification.is_play and smallest_S <= identification.S


def find_code(found: Findings) -> Finding:
    """Choose what is said first.

    The valve leads where it sticks, then an OP that is not the controller's, then a stem that does not move. Else the
    most probable cause that is named does, a load from outside only where no cause inside the loop is named. Nothing is
    found only where the valve is good and any cause is as improbable as a named one is probable.
    """
    causes, valve = found.oscillation_cause, found.identification
    if not found.segment.loop_state.in_control:
        return STATE_FINDINGS.get(found.segment.loop_state.state, "no_data")
    if found.verdict == "stiction":
        return "sticks" if grade(found.verdict, found.probability) == "sticks" else "probably_sticks"
    if found.op_is_position:
        return "not_in_command"
    if found.stuck and found.verdict == "undecided":
        return "valve_not_responding"
    if is_backlash(causes, valve, found.smallest_S):
        return "backlash"
    if causes.main == "valve" and not (valve is not None and valve.is_play):
        return "cannot_tell"
    others = [name for name in causes.named if name != "valve"]
    if others:
        return "follows" if others[0] == "set_point" else others[0]  # type: ignore[return-value]
    if found.verdict == "no_stiction" and replace(causes, valve=0.0).any <= 1.0 - cause_models().named:
        return "nothing_found"
    return "cause_unknown" if found.segment.oscillation.oscillating or found.verdict == "no_stiction" else "cannot_tell"


def plan_valve_test(found: Findings) -> TestPlan | None:
    """Plan the test that moves OP, of which the next step speaks; None where it names none."""
    if not found.segment.loop_state.in_control:
        return None
    op, signals = MIDDLE_OP, found.segment
    if found.segment.record.op_in_percent and signals.op.size:
        op = float(signals.op.mean())
    settling = _settling(found)
    if found.finding in ("sticks", "probably_sticks"):
        S, S_high = _size(found)
        return plan_confirming_ramp(op, S, S_high=S_high, settling=settling, dt=signals.dt)
    shown = signals.oscillation.oscillating and found.S_detectable is not None
    if found.finding == "valve_not_responding" or (found.finding in OPEN and not shown):
        size = max(MIN_TEST_STEP, 2.0 * found.smallest_S)
        return plan_confirming_step(op, size, settling=settling, dt=signals.dt)
    return None


def manual_time(found: Findings) -> float:
    """Time in manual that the next step needs [s]; NaN where it needs none."""
    plan, oscillation = found.valve_test, found.segment.oscillation
    swings = oscillation.oscillating and found.next_step.startswith("Put the controller in manual")
    waiting = TEST_PERIODS * oscillation.period if swings else 0.0
    return (waiting + (plan.duration if plan else 0.0)) or math.nan


def explain_next_step(found: Findings) -> str:
    """Name the cheapest test that decides what is open, with its size and duration; empty where nothing is open."""
    code, oscillation = found.finding, found.segment.oscillation
    if not found.segment.loop_state.in_control:
        return ""
    period = oscillation.period if oscillation.oscillating else float("nan")
    test = f"Put the controller in manual for {_periods(TEST_PERIODS * period)}" if period > 0.0 else ""
    plan = found.valve_test
    if can_wait(code, oscillating=oscillation.oscillating):
        missing = _missing(found)
        return f"{NOTHING_NOW} {missing} A step of OP would show whether its valve sticks{_by(plan)}."
    if code in OPEN and test:
        inside = "the tuning" if found.verdict == "no_stiction" else "the valve or the tuning"
        text = f"{test}: if PV keeps swinging, the cause is outside; if it stops, it is {inside}."
        return f"{text} {_missing(found)} Step OP too{_by(plan)}." if plan else text
    if code == "external":
        stem = "a stem that still moves with OP held is a positioner that hunts"
        return f"{test}: PV keeps swinging if the cause is outside; {stem}." if test else ""
    if code == "tuning" and test and found.oscillation_cause.tuning < GRADES[0][0]:
        return f"{test}: if PV stops swinging, lower the controller gain; if it keeps swinging, the cause is outside."
    if plan is not None and plan.kind == "step test":
        return f"{_missing(found)} Step OP{_by(plan)}."
    if code == "tuning" and test:
        wait = _periods(TEST_PERIODS * period)
        return f"Halve the controller gain for {wait}: the oscillation dies out if tuning is the cause."
    if plan is not None:
        ramp = f"Ramp OP from {plan.settings['low']:g} to {plan.settings['high']:g} % and back in manual"
        return f"{ramp} ({format_seconds(plan.duration)}), and compare stem or PV with OP."
    return NEXT_STEPS.get(code, "")


def _periods(seconds: float) -> str:
    return f"three periods ({format_seconds(seconds)})"


def _by(plan: TestPlan | None) -> str:
    """Size and duration of a step test, for a sentence."""
    return "" if plan is None else f": by {plan.upset:g} % each way in manual, {format_seconds(plan.duration)} in all"


def _missing(found: Findings) -> str:
    """What the record does not show of the valve."""
    if found.S_detectable is not None:
        return f"Stiction below {format_number(found.S_detectable, '% of span', 2)} would not show in the record."
    moved = float(np.ptp(found.segment.op)) if found.segment.op.size else 0.0
    unit = found.segment.record.op_unit_short
    return f"OP moved by {format_number(moved, unit, 2)}, but the record does not show that the valve followed."


def _size(found: Findings) -> tuple[float, float]:
    """S and the upper end of its interval [% of span], assumed where OP is in another unit."""
    valve = found.identification
    if not found.segment.record.op_in_percent:
        return ASSUMED_S, 0.0
    S, high = (0.0, 0.0) if valve is None else (valve.S, valve.S_high)
    return max(S if math.isfinite(S) else 0.0, 0.5 * MIN_TEST_STEP), high if math.isfinite(high) else 0.0


def _settling(found: Findings) -> float:
    """Time in which the identified process settles, at most `MAX_SETTLING` [s]."""
    valve = found.identification
    process = None if valve is None else valve.process if found.verdict == "stiction" else valve.linear
    settling = 0.0 if process is None else process.dead_time + 3.0 * process.time_constant
    return min(settling if math.isfinite(settling) else 0.0, MAX_SETTLING)
