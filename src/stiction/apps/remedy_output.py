"""Format trials of remedies as text, table rows and JSON objects."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from stiction.apps.output import print_out, print_table
from stiction.compensation.prediction_text import format_settings
from stiction.compensation.remedies import NO_ACTION, REPAIR, RETUNING
from stiction.report import labels

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from stiction.apps.advise import Advice
    from stiction.apps.failure import Failure
    from stiction.compensation import CompensationTrial, LoopPerformance, RemedyTrial

__all__ = [
    "advice_dict",
    "failed_advice_dict",
    "format_change",
    "headline",
    "not_written_text",
    "print_advice",
    "remedy_note",
    "retuning_text",
    "settings_text",
    "twin_text",
    "valve_text",
]

WARNINGS = ("makes it worse", "worse if S, J are wrong")
"""Notes on remedies that may do harm."""
MIN_WORSENING = 0.05
"""Increase of the PV deviation above which a remedy is noted as making it worse [-]."""
COLUMNS = ("Remedy", "PV std", "IAE", "Offset", "Travel", "Rev/h", "OP", "\u00b130 %", "Cost")
"""Headings that fit into 80 columns; `_legend` explains them."""


def print_advice(advices: Sequence[Advice], failures: Sequence[Failure]) -> None:
    """Print the advice on each loop."""
    for advice in advices:
        print_out("")
        _print_advice(advice)
    for failure in failures if advices or len(failures) > 1 else ():
        print_out(f"\n{failure.tag}: no advice. {failure.reason}")


def headline(trial: CompensationTrial) -> str:
    """Return the recommendation in a few words."""
    if trial.refused:
        return "No advice"
    return "Until the shutdown: leave the loop as it is" if trial.recommended == NO_ACTION else (
        f"Until the shutdown: {trial.recommended}"
    )  # fmt: skip


def format_change(ratio: float) -> str:
    """Return a ratio as a change.

    Examples
    --------
    >>> format_change(0.43), format_change(1.05), format_change(float("nan"))
    ('-57 %', '+5 %', '–')
    """
    return f"{round(100.0 * (ratio - 1.0)):+d} %" if math.isfinite(ratio) else "–"


def twin_text(trial: CompensationTrial) -> str:
    """Compare the twin with the record, and list the changes of the identified values; without the trial's reason."""
    twin = trial.twin
    if twin is None:
        return ""
    cycle = twin.simulated
    if not twin.overlay:
        text = "" if twin.reason == trial.reason else twin.reason
        if cycle.period > 0.0:
            text += (
                f" It oscillates with a period of {labels.format_duration(cycle.period)} and amplitudes of "
                f"{labels.format_number(cycle.amplitude_op)} % (OP) and "
                f"{labels.format_number(cycle.amplitude_pv)} (PV)."
            )
        return text.strip()
    text = twin.comparison if twin.reason == trial.reason else twin.summary()
    return text + (f" Changes of the identified values: {', '.join(twin.changes)}." if twin.changes else "")


def retuning_text(trial: CompensationTrial) -> str:
    """Say what retuning changes: in the undisturbed cycle, and in the trial."""
    if trial.retuning is None:
        return ""
    tried = next((one for one in trial.remedies if one.name == RETUNING), None)
    if tried is None or trial.retuning.improvement <= 0.0:
        return trial.retuning.reason
    alone = trial.twin is None or trial.twin.inputs is None
    where = "with noise and loads" if alone else "with the noise and disturbances of the record"
    verdict = ": leave the settings" if remedy_note(tried, trial) in WARNINGS or tried.improvement <= 0.0 else ""
    change = format_change(1.0 - tried.improvement)
    return f"{trial.retuning.reason} In the table, {where}, the PV deviation changes by {change}{verdict}."


def settings_text(one: RemedyTrial) -> str:
    """Return the settings of a remedy with their units."""
    return format_settings(
        {key: value for key, value in one.remedy.settings.items() if not isinstance(value, (bool, str))}
    )


def valve_text(advice: Advice) -> str:
    """Say what to do about the valve."""
    if advice.diagnosis is not None:
        return advice.diagnosis.action
    fix = next((one for one in advice.trial.remedies if one.name == REPAIR), None)
    return "" if fix is None else fix.remedy.words


def remedy_note(one: RemedyTrial, trial: CompensationTrial) -> str:
    """Return a note on a remedy for the table."""
    if one.name == trial.recommended:
        return "recommended"
    if not one.at_hand:
        return "at the shutdown"
    if one.improvement < -MIN_WORSENING:
        return "makes it worse"
    return "worse if S, J are wrong" if one.hurts else ""


def not_written_text(key: str, target: Path, advice: Advice) -> str:
    """Say why a requested file is not written."""
    name = key.replace("_", " ").capitalize()
    if key == "work_order":
        why = "The valve needs no work."
    elif advice.trial.recommended and advice.trial[advice.trial.recommended].remedy.compensator is not None:
        why = "The OP of the record leaves 0 to 100 %, so the limits of the compensator are not known."
    else:
        why = (
            advice.trial.reason
            if advice.trial.refused
            else f"The remedy '{advice.trial.recommended}' needs no compensator."
        )
    old = f" {target} is from an earlier run." if target.is_file() else ""
    return f"{name}: not written. {why}{old}"


def advice_dict(advice: Advice, written: Mapping[str, str]) -> dict[str, Any]:
    """Return one loop for JSON, without series over time."""
    found, trial = advice.diagnosis, advice.trial.to_dict()
    trial.pop("trends")
    if trial["twin"] is not None:
        trial["twin"].pop("overlay")
    return {
        "file": advice.file,
        "tag": trial.pop("tag"),
        "verdict": None if found is None else found.verdict,
        "probability": None if found is None else found.probability,
        "oscillation_cause": None if found is None else found.oscillation_cause.to_dict(),
        "action": valve_text(advice),
        **trial,
        "structured_text": written.get("structured_text"),
        "work_order": written.get("work_order"),
        "error": None,
    }


def failed_advice_dict(failure: Failure) -> dict[str, Any]:
    """Return a loop without advice with the keys of the others."""
    nothing = dict.fromkeys(
        ("probability", "oscillation_cause", "S", "J", "twin", "retuning", "structured_text", "work_order")
    )
    return {
        "file": failure.file, "tag": failure.tag, "verdict": "undecided",
        "action": failure.remedy, "recommended": None, "expected_improvement": None, "refused": True,
        "reason": failure.reason, "risk": "", "weights": {}, "seeds": 0, "remedies": [], **nothing,
        "error": failure.reason,
    }  # fmt: skip


def _print_advice(advice: Advice) -> None:
    trial = advice.trial
    print_out(f"{trial.tag}: {headline(trial)}.")
    print_out(trial.reason)
    if not trial.refused:
        print_out(trial.risk)
    if told := twin_text(trial):
        print_out(f"Twin: {told}")
    if trial.remedies:
        now = trial[NO_ACTION].behaviour
        print_out("")
        print_table(COLUMNS, [_row(one, now) for one in trial.remedies], right=COLUMNS[1:])
        print_out(_legend(now))
        for note in WARNINGS:
            names = [one.name for one in trial.remedies if remedy_note(one, trial) == note]
            if names:
                print_out(f"{note[0].upper()}{note[1:]}: {', '.join(names)}.")
        print_out("")
    if trial.retuning is not None:
        print_out(f"Retuning: {retuning_text(trial)}")
    if action := valve_text(advice):
        of_valve = advice.diagnosis is None or advice.diagnosis.verdict == "stiction"
        print_out(f"{'Valve' if of_valve else 'Action'}: {action}")


def _legend(now: LoopPerformance) -> str:
    pv, travel, op = (labels.format_number(x) for x in (now.pv_std, now.travel, now.op_travel))
    return (
        "PV std, IAE: change of the standard deviation of PV and of the integral of the absolute error. Offset: mean "
        "error in PV units. Travel, OP: travel of stem and OP relative to doing nothing. Rev/h: reversals of the stem "
        "per "
        "hour. \u00b130 %: largest change of the PV std if S and J are wrong by 30 %. "
        f"Doing nothing: PV std {pv}, stem travel {travel} %/h, OP travel {op} %/h, cost 1."
    )


def _row(one: RemedyTrial, now: LoopPerformance) -> list[str]:
    b = one.behaviour
    return [
        one.name,
        format_change(_format_ratio(b.pv_std, now.pv_std)),
        format_change(_format_ratio(b.iae, now.iae)),
        labels.format_number(b.offset, significant=2),
        labels.format_number(_format_ratio(b.travel, now.travel), significant=2),
        labels.format_number(b.reversals),
        labels.format_number(_format_ratio(b.op_travel, now.op_travel), significant=2),
        format_change(one.worst),
        f"{one.cost:.2f}",
    ]


def _format_ratio(value: float, base: float) -> float:
    return value / base if base > 0.0 else math.nan
