"""Parts of the valve that the shop looks at: parts that stick or have play, what points to each, how to check.

Field practice, not a published table. The record shows only whether the stem jumps: J / S above `MAX_PLAY_RATIO` means
friction, below it play. The order of the list follows J / S where its interval decides.
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
    """One part of the valve, and what would show it guilty."""

    part: str
    """The part."""
    sign: str
    """The observation that points to it."""
    check: str
    """How to look."""


FRICTION = (
    SuspectPart(
        "Packing (too tight, dried out, wrong kind)",
        "The stem jumps after every reversal, about alike at all positions and in both directions; worse since the "
        "gland was last tightened or repacked.",
        "Gland torque against the maker's figure; friction from actuator pressure opening and closing at the same "
        "travel: (P_opening - P_closing) x area / 2.",
    ),
    SuspectPart(
        "Seat, plug, cage or ball seal (galling, deposits, swollen seal)",
        "Sticks at some positions only, most near the seat, or only with the line at temperature or pressure.",
        "Repeat the ramp test at three positions; compare cold and in service; open the body.",
    ),
)
ACTUATOR = (
    SuspectPart(
        "Actuator (undersized, low supply, leaking diaphragm or piston seal, broken spring)",
        "Actuator pressure runs to the supply or to zero before the stem moves; slow one way; worse at high pressure "
        "drop.",
        "Supply pressure while stroking; bench set; leak test; sizing against packing and seat friction.",
    ),
)
POSITIONER = (
    SuspectPart(
        "Positioner or I/P (sticking pilot, low gain, slipped feedback arm, dirty or wet air)",
        "OP changes and the actuator pressure does not; or the stem hunts with the OP held in manual.",
        "Record positioner output and stem in the step test; feedback arm, air filter, calibration.",
    ),
)
PLAY_PARTS = (
    SuspectPart(
        "Linkage (stem clamp, coupling, key, lever or pin worn)",
        "The actuator moves and the stem or shaft does not; play in the hand on reversal; lost motion without a jump.",
        "Dial gauge on both sides of each joint while the OP reverses.",
    ),
)


def rank_suspects(found: Identification | None, unit: str = "%") -> tuple[tuple[SuspectPart, ...], str]:
    """List the parts to look at, likeliest first, and say what the order rests on.

    Parameters
    ----------
    found : Identification or None
        The valve found; without one the order is that of the field.
    unit : str
        Unit of J, as it stands behind a number.

    Returns
    -------
    tuple of SuspectPart
        The parts.
    str
        Why in this order, in a sentence.

    Examples
    --------
    >>> parts, why = rank_suspects(None)
    >>> parts[0].part, why
    ('Packing (too tight, dried out, wrong kind)', 'The record does not tell friction from play.')
    """
    rubs_first = FRICTION + POSITIONER + ACTUATOR + PLAY_PARTS
    if found is None or not found.S > 0.0:
        return rubs_first, "The record does not tell friction from play."
    if found.J_low > MAX_PLAY_RATIO * found.S:
        return rubs_first, f"The stem jumps (J is {found.J_low:.2g} {unit} or more): look for friction before play."
    if found.J_high < MAX_PLAY_RATIO * found.S:
        return (
            PLAY_PARTS + POSITIONER + FRICTION + ACTUATOR,
            f"The stem hardly jumps (J is at most {found.J_high:.2g} {unit}): look for play before friction.",
        )
    return rubs_first, (
        f"J may be anything from {found.J_low:.2g} to {found.J_high:.2g} {unit}: no telling friction from play."
    )
