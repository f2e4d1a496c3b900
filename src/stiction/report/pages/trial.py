"""The page of a trial of remedies: recommendation, before and after, remedies, twin, retuning, work order."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stiction.compensation.prediction_text import format_settings
from stiction.compensation.recommend import travel_ratio, wears_too_much
from stiction.compensation.remedies import NO_ACTION, REPAIR, RETUNING
from stiction.report import figures, labels
from stiction.report.blocks import Block, Cell, Collapsible, Heading, Headline, Sheet, StatusIcon, Table, Text
from stiction.report.pages.loop import side_by_side

if TYPE_CHECKING:
    from stiction.compensation import CompensationTrial, RemedyTrial
    from stiction.diagnosis import Diagnosis

__all__ = ["remedy_note", "retuning_text", "trial_blocks", "trial_headline", "trial_line", "trial_row"]

WARNINGS = ("makes it worse", "worse if S, J are wrong")
"""Notes on remedies that may do harm."""
MIN_WORSENING = 0.05
"""Increase of the PV deviation above which a remedy is noted as making it worse [-]."""
COLUMNS = ("Remedy", "PV std", "IAE", "Offset", "Travel", "Rev/h", "OP", "\u00b130 %", "Cost")
"""Headings that fit into 80 columns of a terminal; the caption explains them."""
OVERVIEW_COLUMNS = ("Loop", "Until the shutdown", "PV std", "PV std with a good valve")
"""Headings of `trial_row`."""


def trial_blocks(
    trial: CompensationTrial, diagnosis: Diagnosis | None = None, work_order: str | None = None
) -> list[Block]:
    """Return the blocks of one trial, with the diagnosis of its loop and the work order where there are any."""
    blocks: list[Block | None] = [trial_headline(trial, diagnosis)]
    trends = figures.before_after(trial)
    if trends is not None:
        blocks += [Heading("Before and after"), *trends]
    if trial.remedies:
        blocks += [Heading("The remedies"), _remedies(trial), _warnings(trial)]
        blocks += [side_by_side(figures.remedy_tradeoff(trial), figures.remedy_sensitivity(trial)), _settings(trial)]
    if trial.twin is not None:
        text = _twin_text(trial)
        overlay = figures.twin_overlay(trial.twin, labels.pv_unit(diagnosis))
        blocks += [Heading("The twin"), Text(text) if text else None, overlay, _twin(trial)]
    if trial.retuning is not None:
        blocks += [Heading("Retuning"), Text(retuning_text(trial)), figures.retuning(trial.retuning)]
    if work_order is not None:
        blocks += [Heading("Work order"), Sheet("Work order", work_order)]
    return [block for block in blocks if block is not None]


def trial_line(trial: CompensationTrial) -> str:
    """Return the recommendation in a few words."""
    if trial.refused:
        return "No advice"
    return f"Until the shutdown: {_recommendation(trial)}"


def trial_headline(trial: CompensationTrial, diagnosis: Diagnosis | None = None) -> Headline:
    """Return the recommendation with its expected effect, and the action on the valve."""
    verdict = "stiction" if diagnosis is None else diagnosis.verdict
    facts = [("S", labels.format_number(trial.S, "% of span")), ("J", labels.format_number(trial.J, "% of span"))]
    if diagnosis is not None:
        probability = labels.format_probability(diagnosis.probability)
        facts.insert(0, ("Verdict", f"{labels.VERDICTS[verdict]}, probability {probability}"))
    if trial.twin is not None and trial.twin.measured.period > 0.0:
        facts.append(("Period", labels.format_duration(trial.twin.measured.period)))
    if trial.recommended and (settings := settings_text(trial[trial.recommended])):
        facts.append(("Settings", settings))
    if trial.remedies:
        facts.append(("Runs of each remedy", str(trial.seeds)))
    repair = next((tried.remedy.words for tried in trial.remedies if tried.name == REPAIR), "")
    return Headline(
        trial.tag,
        "undecided" if trial.refused and verdict == "stiction" else verdict,
        labels.VERDICT_ICONS[verdict] if trial.refused else "",
        trial_line(trial),
        _expected(trial),
        f"{trial.reason} {'' if trial.refused else trial.risk}".strip(),
        repair if diagnosis is None else diagnosis.action,
        facts if trial.remedies or diagnosis is not None else [],
    )


def trial_row(trial: CompensationTrial, href: str) -> list[Cell | str]:
    """Return the row of a loop in a table of several; see `OVERVIEW_COLUMNS`."""
    name = Cell(trial.tag, href=href)
    if trial.refused:
        return [name, f"No advice. {trial.reason}", "", ""]
    shares = (trial[trial.recommended or NO_ACTION].improvement, trial[REPAIR].improvement)
    return [name, _recommendation(trial), *(_change(1.0 - share) for share in shares)]


def settings_text(tried: RemedyTrial) -> str:
    """Return the settings of a remedy with their units; a line of a narrow cell ends only between two settings."""
    text = format_settings({k: v for k, v in tried.remedy.settings.items() if not isinstance(v, (bool, str))})
    return ", ".join(one.replace(" ", "\u00a0") for one in text.split(", "))


def remedy_note(tried: RemedyTrial, trial: CompensationTrial) -> str:
    """Return a note on a remedy: that it is recommended, or for the shutdown, or may do harm."""
    if tried.name == trial.recommended:
        return "recommended"
    if not tried.at_hand:
        return "at the shutdown"
    if tried.improvement < -MIN_WORSENING:
        return WARNINGS[0]
    return WARNINGS[1] if tried.hurts else ""


def retuning_text(trial: CompensationTrial) -> str:
    """Say what retuning changes: in the undisturbed cycle, and in the trial."""
    if trial.retuning is None:
        return ""
    tried = next((tried for tried in trial.remedies if tried.name == RETUNING), None)
    if tried is None or trial.retuning.improvement <= 0.0:
        return trial.retuning.reason
    alone = trial.twin is None or trial.twin.inputs is None
    where = "with noise and loads" if alone else "with the noise and disturbances of the record"
    verdict = ": leave the settings" if remedy_note(tried, trial) in WARNINGS or tried.improvement <= 0.0 else ""
    change = _change(1.0 - tried.improvement)
    return f"{trial.retuning.reason} In the table, {where}, the PV deviation changes by {change}{verdict}."


def _recommendation(trial: CompensationTrial) -> str:
    return "leave the loop as it is" if trial.recommended in (None, NO_ACTION) else str(trial.recommended)


def _expected(trial: CompensationTrial) -> str:
    """Return the expected effect of the recommendation and of the repair."""
    if not trial.remedies:
        return "No remedy was tried" if trial.refused else ""
    parts = [f"with a good valve {_change(1.0 - trial[REPAIR].improvement)}"]
    if trial.recommended not in (None, NO_ACTION):
        parts.insert(0, f"PV std {_change(1.0 - trial[str(trial.recommended)].improvement)}")
    return "; ".join(parts)


def _remedies(trial: CompensationTrial) -> Table:
    """Return the table of all remedies, the recommended first, then by cost, relative to doing nothing."""
    now = trial[NO_ACTION].behaviour
    rows = []
    for tried in sorted(trial.remedies, key=lambda one: one.name != trial.recommended):
        b, note = tried.behaviour, remedy_note(tried, trial)
        mark: StatusIcon = "good" if note == "recommended" else "alert" if note in WARNINGS else ""
        rows.append(
            [
                Cell(tried.name, mark=mark),
                _change(_ratio(b.pv_std, now.pv_std)),
                _change(_ratio(b.iae, now.iae)),
                labels.format_number(b.offset, significant=2),
                labels.format_number(_ratio(b.travel, now.travel), significant=2),
                labels.format_number(b.reversals),
                labels.format_number(_ratio(b.op_travel, now.op_travel), significant=2),
                _change(tried.worst),
                f"{tried.cost:.2f}",
            ]
        )
    pv, travel, op = (labels.format_number(x) for x in (now.pv_std, now.travel, now.op_travel))
    weights = ", ".join(f"{name} {value:g}" for name, value in trial.weights.items())
    caption = (
        "PV std, IAE: change of the standard deviation of PV and of the integral of the absolute error. Offset: mean "
        "error in PV units. Travel, OP: travel of stem and OP relative to doing nothing. Rev/h: reversals of the stem "
        "per hour. \u00b130 %: largest change of the PV std if S and J are wrong by 30 %. "
        f"Doing nothing: PV std {pv}, stem travel {travel} %/h, OP travel {op} %/h, cost 1. "
        f"Weights of the cost: {weights}; give others with --weights."
    )
    return Table(COLUMNS, rows, caption, sortable=True)


def why_not_cheaper(trial: CompensationTrial) -> list[str]:
    """Say of each remedy that costs less than the recommended one why it is not recommended."""
    if trial.recommended is None:
        return []
    best, now = trial[trial.recommended], trial[NO_ACTION].behaviour
    lines = []
    for one in trial.remedies:
        if one.cost >= best.cost or one.name == NO_ACTION:
            continue
        if not one.at_hand:
            why = "waits for the shutdown"
        elif wears_too_much(one.behaviour, now, max_travel=trial.max_travel):
            times = labels.format_number(travel_ratio(one.behaviour, now), significant=2)
            why = f"moves the stem {times} times as far as now, more than {trial.max_travel:g} times"
        elif one.hurts:
            why = f"raises the PV deviation to {one.worst:.2f} times the present one if S and J are wrong by 30 %"
        elif one.improvement <= 0.0:
            why = "does not lower the PV deviation"
        else:
            why = "what it does on the plant cannot be predicted well enough from one record"
        lines.append(f"{one.name[0].upper()}{one.name[1:]} costs less but {why}.")
    return lines


def _warnings(trial: CompensationTrial) -> Text | None:
    """Name the remedies that may do harm, and say why no cheaper one is recommended."""
    names = {note: [one.name for one in trial.remedies if remedy_note(one, trial) == note] for note in WARNINGS}
    lines = [f"{note[0].upper()}{note[1:]}: {', '.join(those)}." for note, those in names.items() if those]
    lines = why_not_cheaper(trial) + lines
    return Text(" ".join(lines)) if lines else None


def _settings(trial: CompensationTrial) -> Collapsible:
    """Return actions and settings of the remedies, and their integrals of the absolute error after the two steps."""
    rows = [
        [tried.name, tried.remedy.words, settings_text(tried) or "none", tried.behaviour.sp_step,
         tried.behaviour.load_step]
        for tried in trial.remedies
    ]  # fmt: skip
    caption = "The best of the settings tried for each kind of remedy; IAE after a step, over its time, in PV units."
    columns = ["Remedy", "What is done", "Settings", "SP step", "Load step"]
    return Collapsible("What is done, and with which settings", [Table(columns, rows, caption)])


def _twin_text(trial: CompensationTrial) -> str:
    """Compare the twin with the record, and list the changes of the identified values; without the trial's reason."""
    twin = trial.twin
    assert twin is not None
    cycle = twin.simulated
    if not twin.overlay:
        text = "" if twin.reason == trial.reason else twin.reason
        if cycle.period > 0.0:
            op, pv = labels.format_number(cycle.amplitude_op), labels.format_number(cycle.amplitude_pv)
            period = labels.format_duration(cycle.period)
            text += f" It oscillates with a period of {period} and amplitudes of {op} % (OP) and {pv} (PV)."
        return text.strip()
    text = twin.comparison if twin.reason == trial.reason else twin.summary()
    return text + (f" Changes of the identified values: {', '.join(twin.changes)}." if twin.changes else "")


def _twin(trial: CompensationTrial) -> Collapsible:
    """Return the parameters of the twin."""
    assert trial.twin is not None
    twin, loop = trial.twin, trial.twin.loop
    number, pid, process = labels.format_number, loop.controller, twin.to_dict()["process"]
    num, den = (", ".join(map(number, process[key])) for key in ("num", "den"))
    inputs = "its own noise only"
    if twin.inputs is not None:
        pv, sp = (number(float(x.std())) for x in (twin.inputs.pv_residual, twin.inputs.sp_deviation))
        inputs = f"recorded noise and disturbances of std {pv}, recorded set point of std {sp}"
    dead_time = labels.format_duration(process["dead_time_s"])
    rows = [
        ["Valve", f"{type(loop.valve).__name__}, S = {number(trial.S)} %, J = {number(trial.J)} %"],
        ["Controller", f"Kc = {number(pid.Kc)}, Ti = {number(pid.Ti)} s, Td = {number(pid.Td)} s"],
        ["Process", f"({num}) / ({den}) in falling powers of s, dead time {dead_time}"],
        ["Sampling", f"every {labels.format_duration(loop.dt)}"],
        ["Noise of the PV", f"{number(loop.noise)} PV units"],
        ["External inputs [PV units]", inputs],
    ]
    return Collapsible("Parameters of the twin", [Table(["Part of the twin", "As simulated"], rows)])


def _change(ratio: float) -> str:
    """Return a ratio as a change in percent."""
    return f"{round(100.0 * (ratio - 1.0)):+d} %" if math.isfinite(ratio) else "–"


def _ratio(value: float, base: float) -> float:
    return value / base if base > 0.0 else math.nan
