"""What a diagnosis says first: a code, the grade of its words, and the cheapest next step."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, Protocol

from stiction.diagnosis.verdict.causes import NAMED
from stiction.display.duration_format import format_seconds

if TYPE_CHECKING:
    from stiction.diagnosis.identification.result import Identification
    from stiction.diagnosis.loop_state import LoopState
    from stiction.diagnosis.result import Oscillation, Verdict
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
INSIDE = ("valve", "tuning", "rate_limit", "dead_zone", "sensor")
"""Causes inside the loop."""
EXCLUDED = 0.2
"""Probability of every cause inside below which an oscillation comes from outside, where the valve is good too [-]."""
NAMED_BLINDLY = 0.7
"""Probability from which a cause is named where the record does not show that OP moves PV [-]."""
NOT_OUTSIDE = 0.3
"""Probability of a load from outside below which nothing is found in a loop that does not oscillate [-]."""
TEST_PERIODS = 3.0
"""Periods in manual that show whether an oscillation comes from outside [-]."""
MIN_TEST_STEP = 2.0
"""Step of OP that moves a valve which hardly moved [% of span]."""


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
    def loop_state(self) -> LoopState:
        """The state of the loop."""
        ...

    @property
    def oscillation(self) -> Oscillation:
        """The oscillation."""
        ...

    @property
    def oscillation_cause(self) -> OscillationCause:
        """Its causes."""
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
    def op_range(self) -> float:
        """Range of OP in the judged part [% of span]."""
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


def is_backlash(causes: OscillationCause, identification: Identification | None, probability: float) -> bool:
    """Whether the valve drives the loop by its play: it moves it, has no slip jump, and hardly sticks."""
    named = causes.main == "valve" and identification is not None and identification.is_play
    return named and probability < NAMED


def find_code(found: Findings) -> Finding:
    """Choose what is said first.

    The valve leads where it sticks. Else the most probable cause does. A load from outside leads only where the record
    excludes the inside: where it could have shown stiction.
    """
    state = found.loop_state.state
    if not found.loop_state.in_control:
        return STATE_FINDINGS.get(state, "no_data")
    if found.verdict == "stiction":
        return "sticks" if grade(found.verdict, found.probability) == "sticks" else "probably_sticks"
    causes, hidden = found.oscillation_cause, found.S_detectable is None and found.verdict == "undecided"
    for name in causes.named:
        if hidden and getattr(causes, name) < NAMED_BLINDLY and name != "external":
            continue
        if name == "valve":
            return "backlash" if found.identification is not None and found.identification.is_play else "cannot_tell"
        if name == "set_point":
            return "follows"
        if name == "external":
            return "cause_unknown" if hidden else "external"
        return name  # type: ignore[return-value]
    if found.oscillation.oscillating:
        inside = max(getattr(causes, name) for name in INSIDE)
        return "external" if found.verdict == "no_stiction" and inside < EXCLUDED else "cause_unknown"
    if found.verdict == "no_stiction":
        return "nothing_found" if causes.external < NOT_OUTSIDE else "cause_unknown"
    return "cannot_tell"


def explain_next_step(found: Findings) -> str:
    """Name the cheapest test that decides what is open, with its size and duration; empty where nothing is open."""
    code, oscillation = found.finding, found.oscillation
    if not found.loop_state.in_control:
        return ""
    period = oscillation.period if oscillation.oscillating else float("nan")
    test = f"Put the controller in manual for {_minutes(TEST_PERIODS * period)}" if period > 0.0 else ""
    if code in ("cause_unknown", "cannot_tell") and test:
        text = f"{test}: if PV keeps swinging, the cause is outside; if it stops, it is the valve or the tuning."
        return text if found.S_detectable is not None else f"{text} {_step(found)}"
    if code == "external":
        stem = "a stem that still moves with OP held is a positioner that hunts"
        return f"{test}: PV keeps swinging if the cause is outside; {stem}." if test else ""
    if code == "tuning" and test and found.oscillation_cause.tuning < GRADES[0][0]:
        return f"{test}: if PV stops swinging, lower the controller gain; if it keeps swinging, the cause is outside."
    if code == "tuning":
        return "Halve the controller gain for some periods: the oscillation dies out if tuning is the cause."
    if code == "follows":
        return "Look at what moves the set point: its master loop, ratio station or operator."
    if code == "rate_limit":
        return "Raise the rate limit of OP, or lower the gain until OP stays below it."
    if code == "backlash":
        return "Move OP back and forth by twice the band in manual and watch the stem: play shows as lost motion."
    if code in ("sticks", "probably_sticks"):
        return f"Ramp OP up and down by {2.0 * _size(found):.0f} % in manual and compare stem or PV with OP."
    return _step(found) if found.verdict == "undecided" else ""


def _minutes(seconds: float) -> str:
    return f"three periods ({format_seconds(seconds)})"


def _size(found: Findings) -> float:
    S = 0.0 if found.identification is None else found.identification.S
    return max(S if math.isfinite(S) else 0.0, 0.5 * MIN_TEST_STEP)


def _step(found: Findings) -> str:
    """A step of OP that a sticky valve would have to follow."""
    step = max(MIN_TEST_STEP, 2.0 * found.smallest_S)
    if found.S_detectable is None:
        missing = (
            f"OP moved {found.op_range:.1f} %, and no effect on PV is shown that a sticky or stuck valve would lack."
        )
    else:
        missing = f"Stiction below {found.S_detectable:.1f} % of span would not show."
    return f"{missing} Step OP by {step:g} % each way in manual, or send a record with a set point or load change."
