"""Parts of the valve for the shop to check: parts that stick or have play, the symptoms of each, and how to check it.

This is field practice, not a published table. The record shows only whether the stem jumps: J / S above
`MAX_PLAY_RATIO` means friction, below it play. The order of the list follows J / S if its interval lies on one side
of that value.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from stiction.diagnosis.identification.result import MAX_PLAY_RATIO

if TYPE_CHECKING:
    from stiction.diagnosis import Identification

__all__ = ["SuspectPart", "rank_suspects"]


@dataclass(frozen=True, slots=True)
class SuspectPart:
    """One part of the valve, its symptom and its check."""

    part: str
    """The part."""
    sign: str
    """Observation that points to it."""
    check: str
    """How to check it."""


FRICTION_PARTS = (
    SuspectPart(
        "Packing (too tight, dried out, wrong kind)",
        "The stem jumps after every reversal, by about the same amount at all positions and in both directions; worse "
        "since the gland was last tightened or repacked.",
        "Gland torque against the maker's figure; friction from actuator pressure opening and closing at the same "
        "travel: (P_opening - P_closing) x area / 2.",
    ),
    SuspectPart(
        "Seat, plug, cage or ball seal (galling, deposits, swollen seal)",
        "The stem sticks only at some positions, mostly near the seat, or only with the line at temperature or "
        "pressure.",
        "Repeat the ramp test at three positions; compare cold and in service; open the body.",
    ),
)
ACTUATOR_PARTS = (
    SuspectPart(
        "Actuator (undersized, low supply, leaking diaphragm or piston seal, broken spring)",
        "The actuator pressure reaches the supply pressure or zero before the stem moves; slow in one direction; worse "
        "at a high pressure drop.",
        "Supply pressure while stroking; bench set; leak test; sizing against packing and seat friction.",
    ),
)
POSITIONER_PARTS = (
    SuspectPart(
        "Positioner or I/P (sticking pilot, low gain, slipped feedback arm, dirty or wet air)",
        "OP changes and the actuator pressure does not; or the stem oscillates with a constant OP in manual.",
        "Record positioner output and stem in the step test; feedback arm, air filter, calibration.",
    ),
)
PLAY_PARTS = (
    SuspectPart(
        "Linkage (stem clamp, coupling, key, lever or pin worn)",
        "The actuator moves and the stem or shaft does not; play is felt at a reversal; lost motion without a jump.",
        "Dial gauge on both sides of each joint while the OP reverses.",
    ),
)


def rank_suspects(identification: Identification | None, unit: str = "%") -> tuple[tuple[SuspectPart, ...], str]:
    """List the parts to check, the most likely first, and give the reason for the order.

    `identification`: the identified valve; None gives the customary order. `unit`: unit of J, as written after a
    number. Returns the parts, and the reason for the order as a sentence.

    Examples
    --------
    >>> parts, why = rank_suspects(None)
    >>> parts[0].part, why
    ('Packing (too tight, dried out, wrong kind)', 'The record does not show whether it is friction or play.')
    """
    friction_first = FRICTION_PARTS + POSITIONER_PARTS + ACTUATOR_PARTS + PLAY_PARTS
    if identification is None or not identification.S > 0.0:
        return friction_first, "The record does not show whether it is friction or play."
    if identification.J_low > MAX_PLAY_RATIO * identification.S:
        return (
            friction_first,
            f"The stem jumps (J is {identification.J_low:.2g} {unit} or more): check for friction before play.",
        )
    if identification.J_high < MAX_PLAY_RATIO * identification.S:
        return (
            PLAY_PARTS + POSITIONER_PARTS + FRICTION_PARTS + ACTUATOR_PARTS,
            f"The stem hardly jumps (J is at most {identification.J_high:.2g} {unit}): check for play before friction.",
        )
    return friction_first, (
        f"J is between {identification.J_low:.2g} and {identification.J_high:.2g} {unit}: it can be friction or play."
    )
