"""The name of what is wrong, why, and what to do about it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from stiction.diagnosis.verdict.probability import UNDECIDED
from stiction.records.digits import chance, interval
from stiction.records.durations import in_seconds

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.diagnosis.identified import Identification
    from stiction.diagnosis.result import Oscillation, Verdict

__all__ = ["Cause", "named_cause", "not_seen"]

PLAINLY = 0.5
"""Probability below which a cause is named as the likeliest of several only [-]."""
FEW_CYCLES = 10.0
"""Periods below which more of them would tell more."""
FEW_SAMPLES = 15.0
"""Samples of a period below which a faster record would tell more."""


class Cause(NamedTuple):
    """A named cause."""

    name: str
    """stiction, deadband, tight tuning, external disturbance, sensor, saturation, none or unknown."""
    reason: str
    """Why, in a sentence."""
    action: str
    """What to do, in a sentence."""


def named_cause(
    verdict: Verdict, causes: Mapping[str, float], found: Identification, oscillation: Oscillation, dt: float
) -> Cause:
    """Put the likeliest cause into words.

    Parameters
    ----------
    verdict : {"stiction", "no_stiction", "undecided"}
        What is called.
    causes : mapping of str to float
        Probability of each cause [-].
    found : Identification
        The valve and process found.
    oscillation : Oscillation
        Whether and how the loop oscillates.
    dt : float
        Sampling period [s].

    Returns
    -------
    Cause
        Its name, with reason and action; `unknown` where the data do not decide, with what would decide.
    """
    if verdict == "stiction":
        return _stiction(found)
    likely = sorted((name for name in causes if name != "stiction"), key=lambda name: -causes[name])
    if verdict == "undecided":
        return _undecided(likely[0], causes, found, oscillation, dt)
    name = likely[0]
    reason, action = _OTHERS[name](found, oscillation)
    if causes[name] < PLAINLY:
        reason += f" {name.capitalize()} is the likeliest cause ({chance(causes[name])}), before {likely[1]}."
    return Cause(name, reason, action)


def not_seen(why: str, causes: Mapping[str, float]) -> Cause:
    """Say what moves the PV where OP does not, and the valve is not seen.

    Parameters
    ----------
    why : str
        That OP does not move PV, in a sentence.
    causes : mapping of str to float
        Probability of each cause [-].

    Returns
    -------
    Cause
        The likeliest cause but stiction, where it is likelier than all others together, else `unknown`: what is wrong
        with a loop can be plain where its valve is not.
    """
    name = max((cause for cause in causes if cause != "stiction"), key=lambda cause: causes[cause])
    action = "Check that OP and PV are of one loop; look for what else moves the PV; stroke the valve in manual."
    if causes[name] < PLAINLY:
        return Cause("unknown", why, action)
    what = "Nothing else seems wrong with the loop" if name == "none" else f"The likeliest cause is {name}"
    return Cause(name, f"{why} {what} ({chance(causes[name])}).", action)


def fits(found: Identification) -> str:
    """How well each valve explains the PV, as part of a sentence."""
    return f"explains {found.fit:.0f} % of the PV's movement, a good valve {found.fit_linear:.0f} %"


def _stiction(found: Identification) -> Cause:
    S, low, high = interval(found.S, found.S_low, found.S_high)
    size = f"S = {S} % (95 % {low} to {high})"
    return Cause(
        "stiction",
        f"A sticky valve with {size} {fits(found)}.",
        "Check packing, actuator and positioner of the valve; confirm with a ramp or step test in manual. "
        "Retuning will not cure it.",
    )


def _undecided(other: str, causes: Mapping[str, float], found: Identification, rhythm: Oscillation, dt: float) -> Cause:
    wanted = []
    if not rhythm.oscillating or rhythm.cycles < FEW_CYCLES:
        wanted.append("a longer record")
    if rhythm.oscillating and rhythm.period < FEW_SAMPLES * dt:
        often = in_seconds(float(f"{rhythm.period / FEW_SAMPLES / 2.0:.2g}"))
        wanted.append(f"samples every {often} or faster, without compression")
    wanted.append("the valve stroked by a ramp in manual, or the stem's position")
    what = "no fault" if other == "none" else other
    if causes["stiction"] < UNDECIDED[0]:
        why = f"A sticky valve {fits(found)}, yet the rest of what was found speaks for {what} ({chance(causes[other])})."
    else:
        why = (
            f"The data do not decide between stiction ({chance(causes['stiction'])}) and {what} ({chance(causes[other])}): "
            f"a sticky valve {fits(found)}."
        )
    return Cause("unknown", why, f"What would decide: {'; '.join(wanted)}.")


def _deadband(found: Identification, rhythm: Oscillation) -> tuple[str, str]:
    del rhythm
    return (
        f"A valve with {found.S:.2g} % deadband and little or no slip jump {fits(found)}.",
        "Look for play in linkage, actuator and positioner; integral action on this level cycles on any deadband.",
    )


def _tight_tuning(found: Identification, rhythm: Oscillation) -> tuple[str, str]:
    return (
        f"The loop rings every {in_seconds(rhythm.period)} as a loop does that is close to its limit of stability; "
        f"a sticky valve {fits(found)}.",
        "Lower the controller gain or raise the integral time, then look again.",
    )


def _external(found: Identification, rhythm: Oscillation) -> tuple[str, str]:
    cycle = f"cycles every {in_seconds(rhythm.period)}" if rhythm.oscillating else "is moved"
    return (
        f"The loop {cycle}, and a sticky valve {fits(found)}: something outside drives it.",
        "Look for the source upstream or in coupled loops with the same period.",
    )


def _sensor(found: Identification, rhythm: Oscillation) -> tuple[str, str]:
    del found, rhythm
    return (
        "The PV moves in steps, rests or jumps as the transmitter makes it, which can imitate a sticking valve.",
        "Check range, resolution, filter and wiring of the transmitter before the valve.",
    )


def _saturation(found: Identification, rhythm: Oscillation) -> tuple[str, str]:
    del found, rhythm
    return "The OP lies at its limit for part of the record.", "Check sizing and limits of the valve."


def _none(found: Identification, rhythm: Oscillation) -> tuple[str, str]:
    rest = "." if found.fit_linear > 80.0 else ", the rest is disturbance."
    what = "The oscillation is weak" if rhythm.oscillating else "No regular oscillation"
    return (
        f"{what}; a good valve explains {found.fit_linear:.0f} % of the PV's movement{rest}",
        "No action on the valve.",
    )


_OTHERS = {
    "deadband": _deadband,
    "tight tuning": _tight_tuning,
    "external disturbance": _external,
    "sensor": _sensor,
    "saturation": _saturation,
    "none": _none,
}
"""Cause -> its reason and action."""
