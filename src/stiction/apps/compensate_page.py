"""HTML page of ``stiction compensate``: advice, before and after, remedies, twin, retuning, work order."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.apps import remedy_output as remedy_text
from stiction.compensation.remedies import NO_ACTION, REPAIR
from stiction.report import (
    Block,
    Cell,
    Collapsible,
    Figure,
    Heading,
    SideBySide,
    Table,
    Text,
    figures,
    labels,
    write_page,
)
from stiction.report.rendering import render_fragment

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from stiction.apps.advise import Advice
    from stiction.compensation import CompensationTrial, RemedyTrial
    from stiction.report import TrustedHtml
    from stiction.report.blocks import StatusIcon

__all__ = ["advice_blocks", "write_compensate_page"]


def write_compensate_page(advices: Sequence[Advice], path: Path) -> Path:
    """Write the page of one loop, or of several loops in parts that open on a click."""
    if len(advices) == 1:
        trial = advices[0].trial
        title = "What if" if advices[0].file is None else trial.tag
        return write_page(title, advice_blocks(advices[0]), path, subtitle="Repair, retune or compensate")
    overview = Table(
        ["Loop", "Until the shutdown", "PV std [% of now]", "The same with a good valve [%]"],
        [_overview(advice, k) for k, advice in enumerate(advices)],
        "Advice for each loop.",
    )
    folds = [
        Collapsible(
            f"{advice.trial.tag} · {remedy_text.headline(advice.trial)}", advice_blocks(advice), anchor=f"loop-{k}"
        )
        for k, advice in enumerate(advices)
    ]
    return write_page("Repair, retune or compensate", [overview, Heading("Loops", anchor="loops"), *folds], path)


def advice_blocks(advice: Advice) -> list[Block]:
    """Return the blocks of one loop."""
    trial = advice.trial
    blocks: list[Block | None] = [_headline(advice)]
    trends = figures.before_after(trial)
    if trends is not None:
        blocks += [Heading("Before and after"), *trends]
    if trial.remedies:
        blocks += [Heading("The remedies"), _remedies(trial)]
        blocks += [_weights(trial), _beside(figures.remedy_tradeoff(trial), figures.remedy_sensitivity(trial))]
        blocks += [_remedy_table(trial)]
    if trial.twin is not None:
        said = remedy_text.twin_text(trial)
        overlay = figures.twin_overlay(trial.twin, labels.pv_unit(advice.diagnosis))
        blocks += [Heading("The twin"), Text(said) if said else None, overlay, _twin(trial)]
    if trial.retuning is not None:
        blocks += [Heading("Retuning"), Text(remedy_text.retuning_text(trial)), figures.retuning(trial.retuning)]
    if advice.work_order is not None:
        blocks += [Heading("Work order"), _sheet(advice.work_order)]
    return [block for block in blocks if block is not None]


def _beside(*some: Figure | None) -> Block | None:
    there = [figure for figure in some if figure is not None]
    return SideBySide(there) if there else None


def _headline(advice: Advice) -> TrustedHtml:
    trial, found = advice.trial, advice.diagnosis
    verdict = "stiction" if found is None else found.verdict
    facts = [("S", labels.format_number(trial.S, "% of span")), ("J", labels.format_number(trial.J, "% of span"))]
    if found is not None:
        facts = [
            ("Verdict", f"{labels.VERDICTS[verdict]}, probability {labels.format_probability(found.probability)}"),
            *facts,
        ]
    if trial.twin is not None and trial.twin.measured.period > 0.0:
        facts.append(("Period", labels.format_duration(trial.twin.measured.period)))
    if trial.recommended and trial[trial.recommended].remedy.settings:
        facts.append(("Settings", remedy_text.settings_text(trial[trial.recommended])))
    if trial.remedies:
        facts.append(("Runs of each remedy", str(trial.seeds)))
    return render_fragment(
        "headline.html",
        verdict=verdict if not trial.refused or verdict == "no_stiction" else "undecided",
        sign=labels.VERDICT_ICONS[verdict] if trial.refused else "",
        line=remedy_text.headline(trial),
        confidence=_expected(trial),
        reason=f"{trial.reason} {trial.risk}".strip(),
        action=remedy_text.valve_text(advice),
        severity=None,
        facts=facts if trial.remedies or found is not None else [],
    )


def _expected(trial: CompensationTrial) -> str:
    """Return the expected effect of the recommendation and of the repair."""
    if not trial.remedies:
        return "No remedy was tried" if trial.refused else ""
    parts = (
        []
        if trial.recommended in (None, NO_ACTION)
        else [f"PV std {remedy_text.format_change(1.0 - trial[trial.recommended].improvement)}"]
    )
    return "; ".join([*parts, f"with a good valve {remedy_text.format_change(1.0 - trial[REPAIR].improvement)}"])


def _remedies(trial: CompensationTrial) -> Table:
    """Return the table of all remedies, the cheapest first."""
    columns = [
        "Remedy", "PV std", "of now [%]", "S, J wrong by 30 % [%]", "IAE", "Offset", "SP step", "Load step",
        "Travel [%/h]", "Reversals [1/h]", "OP moves [%/h]", "Cost [-]", "Note",
    ]  # fmt: skip
    caption = (
        "PV std, also in % of doing nothing, for the identified S and J and for S and J wrong by 30 %: both up, both "
        "down, S up and "
        "J down, S down and J up; IAE undisturbed and after a step, each over its time, and offset in PV units; travel "
        "of the stem; the cost of doing nothing is 1."
    )
    return Table(columns, [_row(one, trial) for one in trial.remedies], caption, sortable=True)


def _row(one: RemedyTrial, trial: CompensationTrial) -> list[Cell | str | float | None]:
    b, note = one.behaviour, remedy_text.remedy_note(one, trial)
    mark: StatusIcon = (
        "good" if one.name == trial.recommended else "alert" if note.startswith(("hurts", "makes")) else ""
    )
    numbers = [
        b.pv_std, 100.0 * (1.0 - one.improvement), b.iae, b.offset, b.sp_step, b.load_step, b.travel,
        b.reversals, b.op_travel, one.cost,
    ]  # fmt: skip
    now, share, *others = (float(f"{x:.3g}") for x in numbers)
    off = " / ".join(f"{100.0 * x:.0f}" for x in one.with_errors)
    return [Cell(one.name, mark=mark), now, share, off, *others, note]


def _remedy_table(trial: CompensationTrial) -> Table:
    """Return the table of actions and settings of the remedies."""
    rows = [[one.name, one.remedy.words, remedy_text.settings_text(one) or "none"] for one in trial.remedies]
    return Table(
        ["Remedy", "What is done", "Settings"], rows, "The best of the settings tried for each kind of remedy."
    )


def _weights(trial: CompensationTrial) -> Text:
    weights = ", ".join(f"{name} {value:g}" for name, value in trial.weights.items())
    return Text(f"Weights of the cost: {weights}. Give others with --weights.", kind="note")


def _twin(trial: CompensationTrial) -> Table:
    """Return the parameters of the twin."""
    assert trial.twin is not None
    twin, loop = trial.twin, trial.twin.loop
    pid = loop.controller
    inputs = "its own noise only"
    if twin.inputs is not None:
        series = (twin.inputs.pv_residual, twin.inputs.sp_deviation)
        pv, sp = (labels.format_number(float(x.std())) for x in series)
        inputs = f"recorded noise and disturbances of std {pv}, recorded set point of std {sp}"
    rows = [
        [
            "Valve",
            f"{type(loop.valve).__name__}, S = {labels.format_number(trial.S)} %, "
            f"J = {labels.format_number(trial.J)} %",
        ],
        [
            "Controller",
            f"Kc = {labels.format_number(pid.Kc)}, Ti = {labels.format_number(pid.Ti)} s, Td = "
            f"{labels.format_number(pid.Td)} s",
        ],
        ["Process", _process(twin.to_dict()["process"])],
        ["Sampling", f"every {labels.format_duration(loop.dt)}"],
        ["Noise of the PV", f"{labels.format_number(loop.noise)} PV units"],
        ["External inputs [PV units]", inputs],
    ]
    return Table(["Part of the twin", "As simulated"], rows)


def _process(parts: dict) -> str:
    num, den = (", ".join(f"{x:.3g}" for x in parts[key]) for key in ("num", "den"))
    return f"({num}) / ({den}) in falling powers of s, dead time {labels.format_duration(parts['dead_time_s'])}"


def _overview(advice: Advice, k: int) -> list[Cell | str | float | None]:
    trial = advice.trial
    name = Cell(trial.tag, href=f"#loop-{k}")
    if trial.refused:
        return [name, f"No advice. {trial.reason}", None, None]
    shares = (trial[str(trial.recommended)].improvement, trial[REPAIR].improvement)
    return [name, str(trial.recommended), *(round(100.0 * (1.0 - share)) for share in shares)]


def _sheet(text: str) -> TrustedHtml:
    """Return the work order, Markdown with headings, lists and paragraphs, as HTML for one printed page."""
    kinds = (("## ", "heading"), ("# ", "title"), ("- ", "item"))
    lines = []
    for line in filter(None, text.splitlines()):
        kind, size = next(((kind, len(sign)) for sign, kind in kinds if line.startswith(sign)), ("text", 0))
        lines.append((kind, line[size:]))
    return render_fragment("sheet.html", lines=lines, title="Work order")
