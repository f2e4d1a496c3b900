"""Choose the remedy to use until the next shutdown, or say why none is recommended, and what its risk is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.compensation.remedies import NO_ACTION, REPAIR

if TYPE_CHECKING:
    from stiction.compensation.result import LoopPerformance, RemedyTrial
    from stiction.diagnosis import Diagnosis

__all__ = ["MAX_TRAVEL", "choose_remedy", "refusal_reason", "repair_not_worthwhile", "travel_ratio", "wears_too_much"]

OPEN_LOOP_REMEDIES = ("two-move", "four-move")
"""Remedies that open the loop."""
MIN_IMPROVEMENT_OF_LOOP, MIN_IMPROVEMENT_OF_TWIN = 0.10, 0.20
"""Smallest recommended improvement of the PV deviation, on a given loop and on the twin of a record [-]."""
MIN_REPAIR_IMPROVEMENT = 0.10
"""Smallest improvement by a good valve at which compensation is worthwhile [-]."""
PREDICTABLE_REMEDIES = ("knocker", "constant reinforcement")
"""Remedies whose improvement the twin of a record predicts well. Whether a remedy with a band comes to rest, and what
other controller settings do, depends on properties that a record does not show (docs/understand/remedies.md)."""
MAX_DEVIATION_WITH_ERRORS = 0.90
"""Largest PV deviation relative to doing nothing on the twin of a record, with S and J wrong by 30 % [-]."""
MAX_TRAVEL = 3.0
"""Largest stem travel of a remedy over the present one [-]: see `wears_too_much`."""
PLANT_TO_TWIN_RATIO = 0.9
"""Improvement of the plant relative to that of its twin [-]: the settings fit the twin best."""


def refusal_reason(diagnosis: Diagnosis) -> str:
    """Say why no advice can be given for a diagnosis; empty when it can.

    Returns the reason, or an empty text.
    """
    if not diagnosis.loop_state.in_control:
        return f"{diagnosis.reason} So the record does not show how the valve moves, and no remedy can be advised."
    limited = next((check for check in diagnosis.quality.warnings if check.name == "saturation"), None)
    if limited is not None:
        return f"OP is at its limits, so a compensator cannot add to it. {limited.why}"
    if diagnosis.verdict == "undecided":
        return (
            f"It is unknown whether the valve sticks, and a remedy for the wrong fault can do harm. {diagnosis.reason}"
        )
    if diagnosis.verdict == "no_stiction":
        return "No stiction was found, so there is nothing to compensate."
    if diagnosis.identification is None:
        return "Valve and process were not identified, so no remedy can be simulated."
    return ""


def repair_not_worthwhile(fix: RemedyTrial) -> str:
    """Say that even a good valve would change little; empty when it would change more."""
    if fix.improvement >= MIN_REPAIR_IMPROVEMENT:
        return ""
    return (
        f"Even a good valve would change the PV deviation by {_format_change(-fix.improvement)}: something else moves "
        "the PV, so there is nothing to compensate. If the valve sticks, repair it at the next shutdown."
    )


def travel_ratio(one: LoopPerformance, now: LoopPerformance) -> float:
    """Stem travel with a remedy over the present one [-]."""
    return one.travel / max(now.travel, 1e-300)


def wears_too_much(one: LoopPerformance, now: LoopPerformance, *, max_travel: float = MAX_TRAVEL) -> bool:
    """Whether a remedy moves the stem so far that packing and seat wear out before the repair.

    Parameters
    ----------
    one, now : LoopPerformance
        The loop with the remedy, and as it is.
    max_travel : float
        Largest stem travel over the present one [-]. A knocker of half of S needs up to 2.6 times (the table in
        docs/understand/remedies.md); a month with three times the travel wears the valve as three months do now.

    Returns
    -------
    bool
        Whether it does.

    References
    ----------
    munaro2016: pulses wear the valve, and a method that moves the stem less is to be preferred.
    """
    return travel_ratio(one, now) > max_travel


def choose_remedy(
    ranked: tuple[RemedyTrial, ...], *, from_record: bool = False, max_travel: float = MAX_TRAVEL
) -> tuple[str, str, str, float]:
    """Choose the remedy to use until the next shutdown.

    `ranked`: the trials, the cheapest first. `from_record`: whether they were made on the twin of a record; otherwise
    on a given loop. `max_travel`: largest stem travel over the present one [-]. Returns its name, the reason, the risk,
    and the share by which it is expected to lower the PV deviation [-].
    """
    fix = next(one for one in ranked if one.name == REPAIR)
    nothing = next(one for one in ranked if one.name == NO_ACTION)
    least = MIN_IMPROVEMENT_OF_TWIN if from_record else MIN_IMPROVEMENT_OF_LOOP
    helping = [one for one in ranked if one.at_hand and one.improvement >= least and one.cost < nothing.cost]
    now = nothing.behaviour
    gentle = [one for one in helping if not wears_too_much(one.behaviour, now, max_travel=max_travel)]
    safe = [one for one in gentle if not one.hurts and (not from_record or _is_predictable(one))]
    repair = f"Repair of the valve lowers the PV deviation by {100.0 * fix.improvement:.0f} %"
    if fix.improvement < MIN_REPAIR_IMPROVEMENT:
        repair = f"Repair of the valve changes the PV deviation by {_format_change(-fix.improvement)}"
    if not safe:
        why = f"{repair}; no other remedy lowers it by {100.0 * least:.0f} % and costs less than doing nothing"
        if helping:
            one = (gentle or helping)[0]
            why = (
                f"{repair}; until then the remedy '{one.name}' would lower it by {100.0 * one.improvement:.0f} %, but "
            )
            if not gentle:
                times = _format_ratio(one.behaviour.travel, now.travel)
                why += f"moves the stem {times} times as far as now, and wears it (limit {max_travel:g} times)"
            elif one.hurts:
                why += f"raises it to {one.worst:.2f} times that of doing nothing if S and J are wrong by 30 %"
            else:
                why += "the model identified from one record is not reliable enough for this remedy"
        return NO_ACTION, f"{why}: leave the loop as it is.", "The valve continues to wear at the present rate.", 0.0
    best = safe[0]
    expected = PLANT_TO_TWIN_RATIO * best.improvement if from_record else best.improvement
    advice = f"until the shutdown: {best.name}. {best.remedy.words}"
    reason = f"{repair}; {advice} It lowers the PV deviation by {100.0 * best.improvement:.0f} %"
    reason += f" in the simulation; expect {100.0 * expected:.0f} % on the plant." if from_record else "."
    return best.name, reason, _risk_text(best, nothing), expected


def _is_predictable(one: RemedyTrial) -> bool:
    """Return whether the twin of a record predicts the improvement by a remedy well."""
    return one.name in PREDICTABLE_REMEDIES and one.worst <= MAX_DEVIATION_WITH_ERRORS


def _format_change(x: float) -> str:
    """Return a signed change in percent; a small one ends in `only`."""
    text = f"{round(100.0 * x):+d} %" if round(100.0 * x) else "0 %"
    return f"{text} only" if abs(x) < MIN_REPAIR_IMPROVEMENT else text


def _format_ratio(value: float, base: float) -> str:
    """Return a ratio with two significant digits, so that a small one is not shown as 0."""
    ratio = value / max(base, 1e-300)
    return f"{ratio:.2g}" if ratio < 100.0 else f"{ratio:.0f}"


def _risk_text(best: RemedyTrial, nothing: RemedyTrial) -> str:
    """Return the drawbacks of a remedy as a sentence."""
    b, now = best.behaviour, nothing.behaviour
    drawbacks = [
        f"stem travel {_format_ratio(b.travel, now.travel)} times and reversals "
        f"{_format_ratio(b.reversals, now.reversals)} times the present ones"
    ]
    if b.offset > now.offset + 0.1 * now.pv_std:
        drawbacks.append(f"an offset of about {b.offset:.3g} PV units remains")
    if b.load_step > 1.2 * now.load_step:
        drawbacks.append(f"the IAE after a load step is {b.load_step / now.load_step:.1f} times the present one")
    if b.sp_step > 1.2 * now.sp_step:
        drawbacks.append(f"the IAE after a set point step is {b.sp_step / now.sp_step:.1f} times the present one")
    if best.name in OPEN_LOOP_REMEDIES:
        drawbacks.append(
            "the loop is open while the stem rests: a disturbance is corrected only after the error has left the band"
        )
    drawbacks.append(f"if S and J are wrong by 30 %, the PV deviation is up to {best.worst:.2f} times the present one")
    return f"Drawbacks: {'; '.join(drawbacks)}."
