"""The name of what is wrong, why, and what to do about it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from stiction.diagnosis.verdict.contradiction import NOT_OF_ONE_LOOP
from stiction.diagnosis.verdict.meaning import strongest
from stiction.diagnosis.verdict.probability import UNDECIDED
from stiction.display.duration_format import format_seconds
from stiction.display.number_format import format_interval, format_number, format_probability

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stiction.diagnosis.identified import Explanation, Identification
    from stiction.diagnosis.result import Counted, Oscillation, Verdict

__all__ = ["HIDING", "UNSURE", "Cause", "named_cause", "not_seen", "stuck_or_not"]

PLAINLY = 0.5
"""Probability below which a cause is named as the likeliest of several only [-]."""
FEW_CYCLES = 10.0
"""Periods below which more of them would tell more."""
FEW_SAMPLES = 15.0
"""Samples of a period below which a faster record would tell more."""
UNSURE = 0.25, 0.75
"""Probabilities of stiction between which what would decide is told with any call [-]: no call is of more than low
confidence there (`report.words`)."""
BY_CHANCE = 1.0
"""Twice the log likelihood that one parameter more is worth on average where there is nothing to find [-]."""
PLAY_UNLIKELY = 0.05
"""Probability of play up to which what was found besides J is said to speak against it [-]."""
J_MAY_BE_NONE = 0.05
"""Lower end of J over S up to which the record leaves open whether the valve jumps at all [-]: it chooses words."""
MOSTLY = 80.0
"""Share of the PV that a good valve explains beyond which the rest is not worth a word [%]."""
LITTLE = 10.0
"""OP's swing below which it is told that a wider band would not show [% of span]: what is found of seven of the eight
sticky recorded loops in use is 2.5 at most."""

HIDING = ("deadband", "external disturbance")
"""Causes beside which it is not said from which S on a valve that sticks would have shown: what moves the PV may look
like what such a valve does. Of 168 sticky loops with more than that, recorded at the controller's own samples
(`simulation.population`, its upset, wandering, plant and two-fault loops among them, seeds 9501 to 9505), 144 are told,
19 called one of these, and five are denied."""


class Cause(NamedTuple):
    """A named cause."""

    name: str
    """stiction, deadband, tight tuning, external disturbance, sensor, saturation, none or unknown."""
    reason: str
    """Why, in a sentence."""
    action: str
    """What to do, in a sentence."""


class Seen(NamedTuple):
    """What a cause is told by."""

    found: Identification
    """The valve and process found."""
    rhythm: Oscillation
    """Whether and how the loop oscillates."""
    counted: Sequence[Counted]
    """What each finding did to the probability of stiction."""
    unit: str
    """Unit of OP, S and J, as it stands behind a number."""
    swing: float
    """What OP moves over, in that unit."""
    unsure: bool
    """Whether the valve may well stick (`UNSURE`)."""


def named_cause(
    verdict: Verdict,
    causes: Mapping[str, float],
    found: Identification,
    oscillation: Oscillation,
    dt: float,
    counted: Sequence[Counted] = (),
    *,
    kind_known: bool = True,
    unit: str = "%",
    swing: float = math.inf,
    by_position: bool = False,
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
    counted : sequence of Counted
        What each finding did to the probability of stiction.
    kind_known : bool
        Whether it is known if the process integrates, as the loop's type tells.
    unit : str
        Unit of OP, S and J, as it stands behind a number.
    swing : float
        What OP moves over, in that unit.
    by_position : bool
        Whether S and J are those of the recorded valve position: J is then told with its interval, however long.

    Returns
    -------
    Cause
        Its name, with reason and action; `unknown` where the data do not decide. What would decide is told with that,
        and with a call that is not sure (`UNSURE`).
    """
    likely = sorted((name for name in causes if name != "stiction"), key=lambda name: -causes[name])
    deciding = _deciding(oscillation, dt, kind_known)
    unsure = UNSURE[0] < causes["stiction"] < UNSURE[1]
    if verdict == "stiction":
        return _stiction(found, causes, counted, deciding if unsure else "", unit, by_position=by_position)
    if verdict == "undecided":
        reason = _undecided(likely[0], causes, found, counted) + _rival(found, oscillation)
        return Cause("unknown", reason, deciding)
    name = likely[0]
    reason, action = _OTHERS[name](Seen(found, oscillation, counted, unit, swing, unsure))
    if name == "deadband" and not _speaks(found) and causes[name] >= PLAINLY:
        reason += f" By all that was found play is the likeliest cause ({format_probability(causes[name])})."
    reason += _rival(found, oscillation)
    if name not in HIDING and math.isfinite(found.S_detectable):
        band = f"S of {format_number(found.S_detectable, significant=2)} {unit} or more and jumps by half of it"
        reason += f" A valve that sticks with {band} would most likely have shown, unless its stem never moved."
    if oscillation.sp_cycles:
        reason += " The set point goes through the same cycle: look at what moves it, such as a master loop."
    if causes[name] < PLAINLY:
        first, second = ("no fault" if cause == "none" else cause for cause in likely[:2])
        reason += f" {first.capitalize()} is the likeliest cause ({format_probability(causes[name])}), before {second}."
    return Cause(name, reason, f"{action} {deciding}" if unsure else action)


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
    action = "Look for what else moves the PV; stroke the valve in manual."
    if NOT_OF_ONE_LOOP in why:
        action = f"Check that OP and PV are of one loop. {action}"
    if causes[name] < PLAINLY:
        return Cause("unknown", why, action)
    what = "Nothing else seems wrong with the loop" if name == "none" else f"The likeliest cause is {name}"
    return Cause(name, f"{why} {what} ({format_probability(causes[name])}).", action)


def fits(found: Identification) -> str:
    """How well a sticky valve explains the PV, as part of a sentence; where no better, whether it predicts it so."""
    sticky, good = _percent(found.fit), _percent(found.fit_linear)
    if sticky > good:
        return f"explains {sticky} % of the PV's movement, a good valve {good} %"
    if found.over("good").likelier > BY_CHANCE:
        by = format_number(found.over("good").likelier, significant=2)
        return (
            f"predicts the PV better than a good one, cycle by cycle (twice the log likelihood: {by}), though it "
            f"explains no more of its movement by simulation ({sticky} %, a good valve {good} %)"
        )
    return _no_more(sticky, good)


def _no_more(sticky: int, good: int) -> str:
    return f"explains no more of the PV's movement than a good one ({sticky} %, a good valve {good} %)"


def _percent(fit: float) -> int:
    """A share as it is told: a valve that leaves more than there was explains nothing [%]."""
    return max(round(fit), 0)


def _speaks(found: Identification) -> bool:
    """Whether `fits` says something for a band."""
    return _percent(found.fit) > _percent(found.fit_linear) or found.over("good").likelier > BY_CHANCE


def _for(found: Identification, counted: Sequence[Counted]) -> str:
    """How well a sticky valve explains the PV, and what else counted for it where that says nothing for it."""
    most = "" if _speaks(found) else strongest(counted)
    return f"{fits(found)}; what counted most for it: {most}" if most else fits(found)


def _against(found: Identification, counted: Sequence[Counted]) -> str:
    """How well a sticky valve explains the PV, and what counted against it where it does so better than a good one."""
    sticky, good = _percent(found.fit), _percent(found.fit_linear)
    if sticky <= good:
        return _no_more(sticky, good)
    most = strongest(counted, against=True)
    return f"{fits(found)}; what counted most against it: {most}" if most else fits(found)


def stuck_or_not(causes: Mapping[str, float]) -> Cause:
    """Say that PV does not tell whether a stem moves whose recorded position stands still.

    Parameters
    ----------
    causes : mapping of str to float
        Probability of each cause [-].

    Returns
    -------
    Cause
        `unknown`, with what decides.
    """
    likely = max((name for name in causes if name != "stiction"), key=lambda name: causes[name])
    what = "no fault" if likely == "none" else likely
    return Cause(
        "unknown",
        f"PV speaks for {what} ({format_probability(causes[likely])}), and would move so with a stem that is "
        "stuck fast as well.",
        "Watch the stem while OP moves, or step OP in manual: if the stem follows, mend its transmitter; if not, the "
        "valve sticks.",
    )


def _stiction(
    found: Identification,
    causes: Mapping[str, float],
    counted: Sequence[Counted],
    deciding: str,
    unit: str,
    *,
    by_position: bool,
) -> Cause:
    S, low, high = format_interval(found.S, found.S_low, found.S_high)
    J, J_low, J_high = format_interval(found.J, found.J_low, found.J_high)
    # The interval that a position leaves is made longer than its error, so that it holds an unseen trip as well.
    jump = f" and J = {J} {unit} ({J_low} to {J_high})" if by_position else ""
    reason = f"A sticky valve with S = {S} {unit} (95 % {low} to {high}){jump} {_for(found, counted)}."
    if found.J_told and not by_position:
        reason += f" {found.J_told}"
    if found.J_low <= J_MAY_BE_NONE * found.S:
        play = format_probability(causes["deadband"])
        reason += (
            f" Stiction differs from play (deadband) by J only; the probability of play is {play}."
            if causes["deadband"] > PLAY_UNLIKELY
            else f" J alone does not exclude play (deadband); by all that was found its probability is {play}."
        )
    if deciding:
        action = (
            f"Check packing, actuator and positioner of the valve; if it sticks, retuning will not cure it. {deciding}"
        )
    else:
        action = (
            "Check packing, actuator and positioner of the valve; confirm with a ramp or step test in manual. "
            "Retuning will not cure it."
        )
    return Cause("stiction", reason, action)


def _undecided(other: str, causes: Mapping[str, float], found: Identification, counted: Sequence[Counted]) -> str:
    what = "no fault" if other == "none" else other
    if causes["stiction"] < UNDECIDED[0]:
        cause = f"{what} ({format_probability(causes[other])})"
        return f"A sticky valve {fits(found)}, yet the rest of what was found speaks for {cause}."
    sticks, rest = format_probability(causes["stiction"]), format_probability(causes[other])
    fit = f"a sticky valve {_for(found, counted)}"
    return f"The data do not decide between stiction ({sticks}) and {what} ({rest}): {fit}."


def _deciding(rhythm: Oscillation, dt: float, kind_known: bool) -> str:
    """What would decide whether the valve sticks, in a sentence."""
    wanted = [] if kind_known else ["the loop's type (flow, level, ...), which was not given"]
    if not rhythm.oscillating or rhythm.cycles < FEW_CYCLES:
        wanted.append("a longer record")
    if rhythm.oscillating and rhythm.period < FEW_SAMPLES * dt:
        often = format_seconds(float(f"{rhythm.period / FEW_SAMPLES / 2.0:.2g}"))  # twice those that few are
        wanted.append(f"samples every {often} or faster, without compression")
    wanted.append("the valve stroked by a ramp in manual, or the stem's position")
    return f"What would decide: {'; '.join(wanted)}."


def _rival(found: Identification, rhythm: Oscillation) -> str:
    """The good valve that predicts the PV better than the sticky one though a straight one does not; or nothing."""
    told: dict[Explanation, str] = {
        "wave": f"beside a wave from outside, the same every {format_seconds(rhythm.period)},",
        "bent": f"with a bent characteristic ({found.bent})",
        "gated": "given the past of the PV without its noise as well",
        "relaxation": "beside a disturbance that turns where the PV comes to a level",
    }
    better = [(likelier, what) for name, what in told.items() if (likelier := found.over(name).likelier) < 0.0]
    if not (better and found.over("good").likelier > BY_CHANCE):
        return ""
    return f" A good valve {min(better)[1]} predicts the PV better than a sticky one."


def _deadband(seen: Seen) -> tuple[str, str]:
    S = format_interval(seen.found.S, seen.found.S_low, seen.found.S_high)[0]
    return (
        f"A valve with {S} {seen.unit} deadband and little or no slip jump {fits(seen.found)}.",
        "Look for play in linkage, actuator and positioner; where the process integrates, integral action cycles on "
        "any deadband.",
    )


def _tight_tuning(seen: Seen) -> tuple[str, str]:
    return (
        f"The loop rings every {format_seconds(seen.rhythm.period)} as a loop does that is close to its limit of "
        f"stability; a sticky valve {_against(seen.found, seen.counted)}.",
        f"Lower the controller gain or raise the integral time, then look again.{_not_shown(seen)}",
    )


def _external(seen: Seen) -> tuple[str, str]:
    cycle = f"cycles every {format_seconds(seen.rhythm.period)}, driven" if seen.rhythm.oscillating else "is moved"
    return (
        f"The loop {cycle} from outside. A sticky valve {_against(seen.found, seen.counted)}.",
        f"Look for the source upstream or in coupled loops with the same period.{_not_shown(seen)}",
    )


def _sensor(_: Seen) -> tuple[str, str]:
    return (
        "The PV moves in steps, rests or jumps as the transmitter or the export makes it, which can imitate a sticking "
        "valve.",
        "Check whether the export rounds or filters PV, then range, resolution, filter and wiring of the transmitter, "
        "before the valve.",
    )


def _saturation(_: Seen) -> tuple[str, str]:
    return "The OP lies at its limit for part of the record.", "Check sizing and limits of the valve."


def _none(seen: Seen) -> tuple[str, str]:
    rest = "." if seen.found.fit_linear > MOSTLY else ", the rest is disturbance."
    what = "No fault shows behind the oscillation" if seen.rhythm.oscillating else "No regular oscillation"
    good, sticky = _percent(seen.found.fit_linear), _percent(seen.found.fit)
    more = f" (a sticky one {sticky} %)" if seen.unsure and sticky > good else ""
    return (
        f"{what}; a good valve explains {good} % of the PV's movement{more}{rest}",
        f"No action on the valve{' yet' if seen.unsure else ''}.{_not_shown(seen)}",
    )


def _not_shown(seen: Seen) -> str:
    """What does not show where OP hardly moves.

    A stem that never moves leaves PV to the load, and OP follows PV by the controller's law: OP then explains PV as
    that of a good valve does.
    """
    if seen.unit != "%" or seen.swing >= LITTLE:
        return ""
    swing = format_number(seen.swing, "%", 2)
    return f" A band wider than OP's swing of {swing} would not show; a step of OP in manual shows it."


_OTHERS = {
    "deadband": _deadband,
    "tight tuning": _tight_tuning,
    "external disturbance": _external,
    "sensor": _sensor,
    "saturation": _saturation,
    "none": _none,
}
"""Cause -> its reason and action."""
