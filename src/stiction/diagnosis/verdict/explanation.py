"""Sentences of a diagnosis: why the verdict is what it is, and what to do."""

from __future__ import annotations

from typing import Protocol

from stiction.diagnosis.loop_state import describe_action, describe_state
from stiction.diagnosis.verdict.decision import Costs, decide, shift_prior
from stiction.diagnosis.verdict.features import FEATURES
from stiction.diagnosis.verdict.finding import Findings
from stiction.diagnosis.verdict.over_time import OverTime, explain_over_time
from stiction.display.duration_format import format_seconds
from stiction.display.number_format import format_interval, format_probability

__all__ = ["explain_action", "explain_reason", "feature_label"]

CAUSE_TEXT = {
    "valve": "The valve drives the oscillation.",
    "tuning": "The controller gain is near the limit of stability, or above it.",
    "external": "A load from outside the loop drives the oscillation.",
    "set_point": "The set point moves, and PV follows it.",
    "rate_limit": "OP moves at a limit of its rate, too slow for the loop.",
    "sensor": "The PV signal is too coarse or has spikes that the controller follows.",
    "dead_zone": "PV does not respond in a range of OP at fixed values, as between two valves in split range.",
}
"""What each cause means, in a sentence."""
CAUSE_ACTION = {
    "tuning": "Lower the controller gain, or lengthen the integral time.",
    "external": "Look for loops and machines upstream with the same period.",
    "set_point": "Look at what moves the set point.",
    "rate_limit": "Raise the rate limit of OP, or lower the controller gain.",
    "sensor": "Check the transmitter, its filter and its resolution.",
    "dead_zone": "Check the split-range calibration and the valve seat at that OP.",
}
"""What to do about each cause other than the valve."""
OPEN_TEXT = {
    "cause_unknown": "The record does not show the cause of the oscillation.",
    "not_in_command": "OP moves as no controller of SP - PV would: it is probably the position of the valve.",
    "valve_not_responding": "Something else moves PV, and PV does not respond to OP: the stem is probably stuck.",
}
"""Findings that a test has to decide, as sentences."""
PLAY_TEXT = "The valve has play (a deadband without slip jump) of about {S:.1f} {unit}."
PLAY_ACTION = "Check linkage, actuator coupling and positioner feedback for play."

MIN_ANALYSED_SHARE = 0.8
"""Share of the record in the analysed part below which the share is said [-]."""


class Explained(Findings, OverTime, Protocol):
    """What the sentences need to know; a `Diagnosis` has it."""

    @property
    def prior(self) -> float:
        """Share of sticky valves assumed before the record is looked at [-]."""
        ...

    @property
    def costs(self) -> Costs:
        """Costs of a wrong call."""
        ...

    @property
    def strongest_alternative(self) -> tuple[str, float] | None:
        """The closest explanation without stiction."""
        ...


def feature_label(name: str) -> str:
    """Name of a feature on screens."""
    return next(feature.label for feature in FEATURES if feature.name == name)


def explain_reason(found: Explained) -> str:
    """Say why the verdict is what it is."""
    if not found.segment.loop_state.in_control:
        return describe_state(
            found.segment.loop_state, found.segment.record.start, found.segment.record.provenance.pv_unit
        )
    sentences = [
        _evidence(found),
        _judgement(found),
        _oscillation(found),
        _causes(found),
        _left_out(found),
        _slave(found),
        explain_over_time(found, found.segment.record.op_unit_short),
    ]
    sentences += [check.why for check in found.segment.quality.rejections[:2]]
    return " ".join(sentence for sentence in sentences if sentence)


def _evidence(found: Explained) -> str:
    one, unit = found.identification, found.segment.record.op_unit_short
    if one is None:
        return "OP or PV does not vary enough to identify a valve."
    size = "{} {} (95 % {} to {})".format(
        format_interval(one.S, one.S_low, one.S_high)[0], unit, *_ends(one.S, one.S_low, one.S_high)
    )
    signal = "valve position" if one.by_position else "PV"
    gain = found.strongest_alternative
    against = "" if gain is None else f" {_alternative_text(*gain)}"
    supported = decide(shift_prior(found.probability, found.prior))
    if supported == "stiction":
        return f"A valve with a stiction band S of {size} predicts the {signal} better than a good valve.{against}"
    if supported == "no_stiction":
        shown = (
            "" if found.S_detectable is None else (f" Stiction above {found.S_detectable:.1f} {unit} would have shown.")
        )
        return f"Without a sticky valve the {signal} is explained about as well.{shown}"
    return f"The evidence does not decide: the most likely sticky valve has S of {size}.{against}"


def _judgement(found: Explained) -> str:
    """Say so where the costs or the prior, and not the evidence, make the verdict."""
    usual, verdict = decide(found.probability), found.verdict.replace("_", " ")
    if found.costs != Costs() and found.verdict != usual:
        return f"With these costs the verdict is '{verdict}' at this probability."
    if usual != decide(shift_prior(found.probability, found.prior)):
        probability = format_probability(found.probability)
        return f"With a prior of {found.prior:g} the probability of stiction is {probability}."
    return ""


def _ends(value: float, low: float, high: float) -> tuple[str, str]:
    _, low_text, high_text = format_interval(value, low, high)
    return low_text, high_text


ALTERNATIVE_TEXT = {
    "good": "a good valve",
    "deadband": "a valve with deadband only",
    "dead_zone": "a good valve with a dead zone",
    "relay_load": "a good valve with a load that switches",
    "periodic_load": "a good valve with a periodic load",
}
"""Explanations without stiction, as sentences name them."""
MAX_EQUAL_FIT = 2.0
"""Twice the log likelihood ratio below which two explanations fit about equally well [-] (kass1995)."""


def _alternative_text(name: str, ratio: float) -> str:
    """Say what the sticky valve was compared with, and with what result."""
    other = ALTERNATIVE_TEXT[name]
    if abs(ratio) < MAX_EQUAL_FIT:
        return f"{other[0].upper()}{other[1:]} predicts it about as well."
    return f"{other[0].upper()}{other[1:]} predicts it {'less well' if ratio > 0.0 else 'better'}."


def _oscillation(found: Explained) -> str:
    one = found.segment.oscillation
    if not one.oscillating:
        return "The loop does not oscillate regularly."
    return f"The loop oscillates with a period of {format_seconds(one.period)}."


def _causes(found: Explained) -> str:
    if found.finding in OPEN_TEXT:
        return OPEN_TEXT[found.finding]
    others = _other_causes(found)
    texts = [_dead_zone(found) if name == "dead_zone" else CAUSE_TEXT[name] for name in others]
    if found.finding == "backlash" and found.identification is not None:
        texts.insert(0, PLAY_TEXT.format(S=found.identification.S, unit=found.segment.record.op_unit_short))
    if found.verdict == "stiction" and texts:
        texts.insert(0, "The valve sticks, and something else affects the loop too:")
    return " ".join(texts)


def _other_causes(found: Explained) -> list[str]:
    """Causes other than the valve that are named."""
    return [name for name in found.oscillation_cause.named if name in CAUSE_ACTION]


def _dead_zone(found: Explained) -> str:
    zone = None if found.identification is None else found.identification.dead_zone
    if zone is None:
        return CAUSE_TEXT["dead_zone"]
    unit = found.segment.record.op_unit_short
    if zone.crossed_rarely:
        return (
            f"PV does not respond in a part of OP's range between {zone.op_low:.1f} and {zone.op_high:.1f} {unit}. OP "
            "crosses it too few times to distinguish a sticky valve from a dead zone at fixed OP, as between two "
            "valves in "
            "split range."
        )
    return (
        f"PV does not respond while OP is between {zone.low:.1f} and {zone.high:.1f} {unit}, in both directions: a "
        "dead zone at fixed OP, as between two valves in split range."
    )


def _left_out(found: Explained) -> str:
    stretches = found.segment.loop_state.stretches
    if not stretches:
        return ""
    names = ", ".join(dict.fromkeys(one.state.replace("_", " ") for one in stretches))
    share = sum(one.last - one.first for one in stretches) / max(len(found.segment.record), 1)
    text = f"Left out: {100.0 * share:.0f} % of the record ({names})."
    first, last = found.segment.quality.first, found.segment.quality.last
    analysed = (last - first) / max(len(found.segment.record), 1)
    if analysed < MIN_ANALYSED_SHARE:
        text += f" Analysed: {100.0 * analysed:.0f} % of the record, samples {first} to {last - 1}."
    return text


def _slave(found: Explained) -> str:
    tag = found.segment.record.provenance.secondary_tag
    return f"OP is the set point of {tag}; the valve belongs to that loop." if tag else ""


def explain_action(found: Explained) -> str:
    """Say what to do, in one or two imperative sentences."""
    if not found.segment.loop_state.in_control:
        return describe_action(found.segment.loop_state)
    if found.finding in OPEN_TEXT:
        return found.next_step
    others = [CAUSE_ACTION[name] for name in _other_causes(found)]
    if found.verdict == "stiction":
        first = "Check packing, actuator and positioner; confirm with a ramp test before the valve is taken out."
        return " ".join([first, *others])
    if found.finding == "backlash":
        return " ".join([PLAY_ACTION, *others])
    if others:
        return " ".join(others)
    return found.next_step or "No action on the valve."
