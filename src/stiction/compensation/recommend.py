"""The recommendation in words: when to give none, which remedy to take until the shutdown, and what can go wrong."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.compensation.remedies import FIX, NOTHING
from stiction.diagnosis.loop_state import HEADLINES
from stiction.display.check_text import describe_check

if TYPE_CHECKING:
    from stiction.compensation.result import RemedyTrial
    from stiction.diagnosis import Diagnosis

__all__ = ["choose_remedy", "refusal_reason", "repair_not_worthwhile"]

OPEN_LOOP = ("two-move", "four-move")
"""Remedies that open the loop."""
LEAST_IMPROVEMENT, LEAST_FOUND = 0.10, 0.20
"""Share by which a remedy must lower the PV's deviation to be recommended, on a loop that is given and on the twin of a
record [-]."""
LEAST_REPAIR = 0.10
"""Share by which a good valve must lower it for the valve to be worth compensating [-]."""
FORESEEN = ("knocker", "constant reinforcement")
"""Remedies whose improvement the twin of a record predicts: whether those that rest in a band rest at all, and what
other settings do, hangs on more of valve and process than a record shows (docs/understand/remedies.md)."""
SURE = 0.90
"""PV deviation over that of doing nothing that the remedy must keep to on the twin of a record with S and J off by 30 %
[-]."""
OPTIMISM = 0.9
"""Improvement of the true loop over that of its twin, the median of 300 simulated loops: a remedy set on a twin fits
the twin best [-]."""


def refusal_reason(diagnosis: Diagnosis) -> str:
    """Say why a diagnosis gives nothing to advise on; empty where it does.

    Parameters
    ----------
    diagnosis : Diagnosis
        The diagnosis.

    Returns
    -------
    str
        The reason, or "".
    """
    state = diagnosis.loop_state
    if not state.in_control:
        return f"{HEADLINES[state.state]}, so that nothing is known of the valve. {diagnosis.reason} {diagnosis.action}"
    limited = next((check for check in diagnosis.quality.warnings if check.name == "saturation"), None)
    if limited is not None:
        return f"OP is at its limits, where no compensator has room: {describe_check(limited)}"
    if diagnosis.verdict == "undecided":
        return f"Undecided whether the valve sticks, and a remedy for the wrong fault can hurt. {diagnosis.reason}"
    if diagnosis.verdict == "no_stiction":
        return f"The valve was not found to stick, so that there is nothing to compensate. {diagnosis.action}"
    if diagnosis.identification is None:
        return "No valve and process were identified, so that there is no twin to try a remedy on."
    return ""


def repair_not_worthwhile(fix: RemedyTrial) -> str:
    """Say that a good valve would change nothing; empty where it would."""
    if fix.improvement >= LEAST_REPAIR:
        return ""
    return (
        f"Even a good valve would change the PV's deviation by {_little(-fix.improvement)}: what moves the PV is not "
        "the valve, and there is nothing to compensate. Repair it at the shutdown if it sticks."
    )


def choose_remedy(ranked: tuple[RemedyTrial, ...], *, found: bool = False) -> tuple[str, str, str, float]:
    """Choose the remedy until the shutdown.

    Parameters
    ----------
    ranked : tuple of RemedyTrial
        The trials, the cheapest first.
    found : bool
        Whether they were made on the twin of a record and not on a loop that was given.

    Returns
    -------
    tuple
        Its name, the reason, the risk, and the share by which it is expected to lower the PV's deviation [-].
    """
    fix = next(one for one in ranked if one.name == FIX)
    nothing = next(one for one in ranked if one.name == NOTHING)
    least = LEAST_FOUND if found else LEAST_IMPROVEMENT
    helping = [one for one in ranked if one.at_hand and one.improvement >= least and one.cost < nothing.cost]
    safe = [one for one in helping if not one.hurts and (not found or _foreseen(one))]
    repair = f"Fixing the valve lowers the PV's deviation by {100.0 * fix.improvement:.0f} %"
    if fix.improvement < LEAST_REPAIR:
        repair = f"Fixing the valve changes the PV's deviation by {_little(-fix.improvement)}"
    if not safe:
        why = f"{repair}; until then no remedy lowers it by {100.0 * least:.0f} % at a price worth paying"
        if helping:
            one = helping[0]
            why = f"{repair}; until then the {one.name} would lower it by {100.0 * one.improvement:.0f} %, but "
            why += (
                f"raises it to {one.worst:.2f} times that of doing nothing where S and J are off by 30 %"
                if one.hurts
                else "a record does not show enough of valve and process to count on that"
            )
        return NOTHING, f"{why}: leave the loop as it is.", "The valve goes on wearing at the present rate.", 0.0
    best = safe[0]
    expected = OPTIMISM * best.improvement if found else best.improvement
    advice = f"until the shutdown: {best.name}. {best.remedy.words}"
    reason = f"{repair}; {advice} It lowers the PV's deviation by {100.0 * best.improvement:.0f} %"
    reason += f" on the twin; expect {100.0 * expected:.0f} % on the plant." if found else "."
    return best.name, reason, _risk(best, nothing), expected


def _foreseen(one: RemedyTrial) -> bool:
    """Whether the twin of a record predicts the improvement by a remedy."""
    return one.name in FORESEEN and one.worst <= SURE


def _little(x: float) -> str:
    """A signed change in percent, without a sign where it rounds to nothing, and `only` where it is little."""
    told = f"{round(100.0 * x):+d} %" if round(100.0 * x) else "0 %"
    return f"{told} only" if abs(x) < LEAST_REPAIR else told


def _times(value: float, base: float) -> str:
    """A ratio with two significant digits, so that a small one is not told as nothing."""
    ratio = value / max(base, 1e-300)
    return f"{ratio:.2g}" if ratio < 100.0 else f"{ratio:.0f}"


def _risk(best: RemedyTrial, nothing: RemedyTrial) -> str:
    """What the remedy costs and where it may fail."""
    b, now = best.behaviour, nothing.behaviour
    told = [
        f"stem travel {_times(b.travel, now.travel)} times and reversals {_times(b.reversals, now.reversals)} times "
        "those of doing nothing"
    ]
    if b.offset > now.offset + 0.1 * now.pv_std:
        told.append(f"an offset of about {b.offset:.3g} PV units stays")
    if b.load_step > 1.2 * now.load_step:
        told.append(f"a load step costs {b.load_step / now.load_step:.1f} times the IAE")
    if b.sp_step > 1.2 * now.sp_step:
        told.append(f"a set point step costs {b.sp_step / now.sp_step:.1f} times the IAE")
    if best.name in OPEN_LOOP:
        told.append("the loop is open while the stem rests, blind to a load until the error leaves the band")
    told.append(f"with S and J off by 30 % the PV deviates by up to {best.worst:.2f} times that of doing nothing")
    return f"The price: {'; '.join(told)}."
