"""The name of what is wrong, and what to do about it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from stiction.diagnosis.verdict.steadiness import amplitude_spread

if TYPE_CHECKING:
    from stiction.diagnosis.result import Identification, Oscillation
    from stiction.records.quality import Quality
    from stiction.records.record import LoopRecord

__all__ = ["Cause", "other_cause", "sticky_cause"]

PLAY = 0.12
"""J over S below which a valve has play and does not jump [-]: simulated loops with J = 0 stay below 0.03."""
STEADY, NOISE_WIDTHS = 0.025, 2.0
"""Spread of the amplitude from period to period over its median below which an oscillation is steady [-], and how
many standard deviations of what the noise alone makes of it come on top."""


class Cause(NamedTuple):
    """A named cause."""

    name: str
    """stiction, deadband, tight tuning, external disturbance, sensor, saturation, none or unknown."""
    reason: str
    """Why, in a sentence."""
    action: str
    """What to do, in a sentence."""


def sticky_cause(found: Identification) -> Cause:
    """Tell a valve that sticks from one that only has play.

    Parameters
    ----------
    found : Identification
        The valve and process found.

    Returns
    -------
    Cause
        Deadband where the stem does not jump and the process integrates (a self-regulating loop under PI cannot
        cycle on deadband alone), else stiction.
    """
    width = found.S_high - found.S_low
    places = min(max(1 - math.floor(math.log10(width)), 0), 3) if width > 0.0 else 3
    size = f"S = {found.S:.{places}f} % (95 % {found.S_low:.{places}f} to {found.S_high:.{places}f})"
    fits = f"explains {found.fit:.0f} % of the PV's movement, a good valve {found.fit_linear:.0f} %"
    if found.process.integrating and found.J < PLAY * found.S:
        return Cause(
            "deadband",
            f"A valve with {found.S:.2g} % deadband and no slip jump {fits}.",
            "Look for play in linkage, actuator and positioner; integral action on this level cycles on any deadband.",
        )
    return Cause(
        "stiction",
        f"A sticky valve with {size} {fits}.",
        "Check packing, actuator and positioner of the valve; confirm with a ramp or step test in manual. "
        "Retuning will not cure it.",
    )


def other_cause(
    record: LoopRecord, found: Identification, oscillation: Oscillation, quality: Quality, follows: bool
) -> Cause:
    """Name what makes a loop move when it is not the valve.

    Parameters
    ----------
    record : LoopRecord
        The record as analysed.
    found : Identification
        The best linear process is in it.
    oscillation : Oscillation
        Whether and how the loop oscillates.
    quality : Quality
        Reservations about the data.
    follows : bool
        Whether a good valve explains most of the PV.

    Returns
    -------
    Cause
        The likeliest one.

    Notes
    -----
    A linear loop near its limit of stability rings up or dies out with whatever disturbs it; an amplitude that
    stays the same over many periods is driven from outside.
    """
    doubts = {gate.name for gate in quality.reservations}
    if "pv resolution" in doubts:
        return Cause(
            "sensor",
            "The PV moves in steps of its own resolution, which imitate a sticking valve.",
            "Check range, resolution and filter of the transmitter before the valve.",
        )
    if "saturation" in doubts:
        return Cause(
            "saturation", "The OP lies at its limit for part of the record.", "Check sizing and limits of the valve."
        )
    if not oscillation.oscillating:
        text = f"No regular oscillation; a good valve explains {found.fit_linear:.0f} % of the PV's movement"
        return Cause("none", text + ("." if follows else ", the rest is disturbance."), "No action on the valve.")
    spread, by_noise = amplitude_spread(record, oscillation)
    linear = f"a good valve explains {found.fit_linear:.0f} % of the PV, a sticky one no more than {found.fit:.0f} %"
    if spread < STEADY + NOISE_WIDTHS * by_noise:
        return Cause(
            "external disturbance",
            f"The loop cycles every {oscillation.period:.4g} s with a steady amplitude, and {linear}: "
            "something outside drives it.",
            "Look for the source upstream or in coupled loops with the same period.",
        )
    return Cause(
        "tight tuning",
        f"The loop rings every {oscillation.period:.4g} s with an amplitude that comes and goes, and {linear}: "
        "it is close to its limit of stability.",
        "Lower the controller gain or raise the integral time, then look again.",
    )
