"""What a diagnosis says first: a code, the grade of its words, and the cheapest next step."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np

from stiction.diagnosis.verdict.causes import cause_models
from stiction.display.duration_format import format_seconds

if TYPE_CHECKING:
    from stiction.diagnosis.identification.result import Identification
    from stiction.diagnosis.result import Verdict
    from stiction.diagnosis.segment import JudgedSegment
    from stiction.diagnosis.verdict.causes import OscillationCause

__all__ = ["FINDINGS", "GRADES", "Finding", "Findings", "explain_next_step", "find_code", "grade", "is_backlash"]

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


MIN_SAMPLES, MAX_SETTLING = 10.0, 600.0
"""Fewest samples at a step of a test [-], and longest wait there [s]."""
RAMP_TIMES = 5.0
"""Duration of a ramp over the time in which the process settles [-]."""
NEXT_STEPS = {
    "tuning": "Halve the controller gain for three periods: the oscillation dies out if tuning is the cause.",
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


def explain_next_step(found: Findings) -> str:
    """Name the cheapest test that decides what is open, with its size and duration; empty where nothing is open.

    Where the test moves OP, its plan is the command line of `stiction valve-test plan` that writes it.
    """
    code, oscillation = found.finding, found.segment.oscillation
    if not found.segment.loop_state.in_control:
        return ""
    period = oscillation.period if oscillation.oscillating else float("nan")
    test = f"Put the controller in manual for {_minutes(TEST_PERIODS * period)}" if period > 0.0 else ""
    if code in ("cause_unknown", "cannot_tell") and test:
        inside = "the tuning" if found.verdict == "no_stiction" else "the valve or the tuning"
        text = f"{test}: if PV keeps swinging, the cause is outside; if it stops, it is {inside}."
        return text if found.S_detectable is not None else f"{text} {_step(found)}"
    if code == "external":
        stem = "a stem that still moves with OP held is a positioner that hunts"
        return f"{test}: PV keeps swinging if the cause is outside; {stem}." if test else ""
    if code == "tuning" and test and found.oscillation_cause.tuning < GRADES[0][0]:
        return f"{test}: if PV stops swinging, lower the controller gain; if it keeps swinging, the cause is outside."
    if code in ("sticks", "probably_sticks"):
        S = _size(found)
        return (
            f"Ramp OP up and down by {3.0 * S:.0f} % in manual and compare stem or PV with OP. {_ramp_plan(found, S)}"
        )
    if code in NEXT_STEPS or found.verdict != "undecided":
        return NEXT_STEPS.get(code, "")
    return _step(found) if oscillation.oscillating else f"Not urgent: the loop does not oscillate. {_step(found)}"


def _minutes(seconds: float) -> str:
    return f"three periods ({format_seconds(seconds)})"


def _size(found: Findings) -> float:
    S = 0.0 if found.identification is None else found.identification.S
    return max(S if math.isfinite(S) else 0.0, 0.5 * MIN_TEST_STEP)


def _step(found: Findings) -> str:
    """A step of OP that a sticky valve would have to follow."""
    op, size = found.segment.op, max(MIN_TEST_STEP, 2.0 * found.smallest_S)
    if found.S_detectable is None:
        moved = float(np.ptp(op)) if op.size else 0.0
        missing = f"OP moved {moved:.1f} %, but the record does not show that the valve followed."
    else:
        missing = f"Stiction below {found.S_detectable:.1f} % of span would not show."
    ask = f"Step OP by {size:g} % each way in manual, or send a record with a set point or load change."
    start = _between(found, size)
    plan = f"step --start {start:.1f} --fine-range 0 --sizes {size:g} --wait {_settling(found):.0f}"
    return f"{missing} {ask} Plan: stiction valve-test plan {plan} --dt {found.segment.dt:g}"


def _ramp_plan(found: Findings, S: float) -> str:
    """Ramps over three bands, slow enough for the process to follow."""
    middle = _between(found, 1.5 * S)
    rate = 3.0 * S / (RAMP_TIMES * _settling(found))
    plan = f"--low {middle - 1.5 * S:.1f} --high {middle + 1.5 * S:.1f} --rates {rate:.2g}"
    return f"Plan: stiction valve-test plan ramp {plan} --dt {found.segment.dt:g}"


def _between(found: Findings, half: float) -> float:
    """Mean of OP, so far from 0 and 100 % that a test of plus and minus `half` fits [% of span]."""
    op = found.segment.op
    return min(max(float(op.mean()) if op.size else 50.0, half), 100.0 - half)


def _settling(found: Findings) -> float:
    """Time in which the identified process settles, at least some samples and at most ten minutes [s]."""
    valve, dt = found.identification, found.segment.dt
    settling = 0.0 if valve is None else valve.linear.dead_time + 3.0 * valve.linear.time_constant
    return max(MIN_SAMPLES * dt, min(settling if math.isfinite(settling) else 0.0, MAX_SETTLING))
