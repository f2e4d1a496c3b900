"""Everything about one loop, in the order an engineer asks: verdict, trends, fit, rhythm, evidence, data."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.display.check_text import describe_check
from stiction.report import figures, labels
from stiction.report.blocks import Block, Cell, Figure, Heading, SideBySide, StatusIcon, Table, Text
from stiction.report.explanation import causes_step, controlled, counted_step, explained
from stiction.report.loop_view import LoopView
from stiction.report.rendering import render_fragment

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.diagnosis.result import Diagnosis

__all__ = ["loop_blocks"]

_SEVERITY: dict[str, tuple[str, StatusIcon]] = {
    "ok": ("passed", "good"),
    "warn": ("warning", "unknown"),
    "reject": ("rejected", "alert"),
}
_ORDER = {"reject": 0, "warn": 1, "ok": 2}


def loop_blocks(diagnosis: Diagnosis, settings: Mapping[str, Any] | None = None) -> list[Block]:
    """Return the blocks of one loop's page."""
    view = LoopView(diagnosis)
    blocks: list[Block | None] = [_headline(diagnosis), Heading("Trends"), figures.trends(view)]
    blocks.append(figures.windows(view))
    blocks += [Heading("Valve and process"), _beside(figures.pv_op(view), figures.valve_position(view))]
    if diagnosis.identification is None:
        blocks.append(Text("No valve model was fitted to this record, so S and J are not known.", kind="note"))
    else:
        blocks += [figures.model_fit(view), _beside(figures.error_surface(view), figures.dead_time(view))]
        blocks.append(_identified(diagnosis, view))
    blocks += [Heading("Oscillation"), Text(diagnosis.oscillation.reason) if diagnosis.oscillation.reason else None]
    blocks += [_beside(figures.autocorrelation(view), figures.spectrum(view))]
    blocks += _weighed(diagnosis)
    blocks += [Heading("Evidence"), _evidence(diagnosis), Heading("Data quality"), *_quality(diagnosis)]
    blocks += [Heading("Where this comes from"), _provenance(diagnosis, settings or {})]
    return [block for block in blocks if block is not None]


def _beside(*some: Figure | None) -> Block | None:
    there = [figure for figure in some if figure is not None]
    if len(there) > 1:
        return SideBySide(there)
    return there[0] if there else None


def _headline(diagnosis: Diagnosis) -> TrustedHtml:
    found, rhythm = diagnosis.identification, diagnosis.oscillation
    facts = [("Cause", diagnosis.cause or "unknown")]
    sticky = sum(window.verdict == "stiction" for window in diagnosis.windows)
    partly = 0 < sticky < len(diagnosis.windows)
    if partly:
        facts.append(("Windows that stick", f"{sticky} of {len(diagnosis.windows)}"))
    if rhythm.oscillating:
        over = " over all" if partly else ""  # windows that stick swing farther than the others
        facts += [
            (f"Period{over}", labels.format_duration(rhythm.period)),
            (f"PV amplitude{over}", labels.format_number(rhythm.amplitude_pv)),
            (f"OP amplitude{over}", labels.format_number(rhythm.amplitude_op, diagnosis.record.op_unit)),
            (f"Cycles{over}", labels.format_number(rhythm.cycles)),
        ]
    else:
        facts.append(("Oscillation", "none found"))
    if found is not None:
        facts.append(
            (
                "Fit with sticky / good valve",
                f"{labels.format_number(found.fit, '%', 2)} / {labels.format_number(found.fit_linear, '%', 2)}",
            )
        )
    severity = None
    if found is not None and diagnosis.verdict != "no_stiction" and np.isfinite(found.S):
        severity = figures.severity(found, diagnosis.record)
    return render_fragment(
        "headline.html",
        verdict=diagnosis.verdict,
        sign=labels.VERDICT_ICONS[diagnosis.verdict],
        line=labels.headline(diagnosis),
        confidence=labels.confidence_text(diagnosis),
        reason=diagnosis.reason,
        action=diagnosis.action,
        severity=severity,
        facts=facts,
    )


def _identified(diagnosis: Diagnosis, view: LoopView) -> Table:
    """Controller, valve and process as identified, what they were compared with, and what limits them."""
    unit, found = diagnosis.record.op_unit_short, diagnosis.identification
    assert found is not None
    silent = {"Valve"} if not np.isfinite(found.S) else {"Limits"} if not view.valve_is_accepted else set()
    rows = [(what, text) for what, text in explained(found, unit) if what not in silent]
    if diagnosis.controller is not None:
        rows = [("Controller", controlled(diagnosis.controller, unit)), *rows]
    caption = "" if view.valve_is_accepted else "The valve is the likeliest sticky one, which was not believed."
    return Table(["What", "Found"], [list(row) for row in rows], caption)


def _weighed(diagnosis: Diagnosis) -> list[Block]:
    """Probability of each cause, and what counted for stiction and against it."""
    steps = [step for step in (counted_step(diagnosis), causes_step(diagnosis)) if step is not None]
    if not steps:
        return []
    tables: list[Block] = [
        Table(step.table.columns, step.table.rows, " ".join(step.lines) or "They sum to 1.")
        for step in steps
        if step.table is not None
    ]
    return [Heading("What counted"), *tables]


def _evidence(diagnosis: Diagnosis) -> Block:
    if not diagnosis.evidence:
        return Text("No method could be applied to this record.", kind="note")
    rows = [
        [
            labels.method_label(row.method),
            _rounded(row.index),
            _rounded(row.threshold),
            Cell(labels.VERDICTS[row.vote], mark=labels.VERDICT_ICONS[row.vote] if row.valid else ""),
            "met" if row.valid else "not met",
            row.why,
            labels.citation(row.source),
        ]
        for row in diagnosis.evidence
    ]
    votes = [row.vote for row in diagnosis.evidence if row.valid]
    caption = (
        f"Of {labels.count_noun(len(votes), 'method')} whose condition is met, {votes.count('stiction')} say stiction,"
        f" {votes.count('no_stiction')} no stiction, {votes.count('undecided')} cannot tell; the others do not count."
    )
    return Table(["Method", "Index [-]", "Threshold [-]", "Vote", "Condition", "Why", "Source"], rows, caption)


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")


def _quality(diagnosis: Diagnosis) -> list[Block]:
    quality: Any = diagnosis.quality
    rows = []
    for check in sorted(quality.checks, key=lambda check: _ORDER.get(check.severity, 0)):
        word, mark = _SEVERITY.get(check.severity, (check.severity, "unknown"))
        rows.append([check.name, Cell(word, mark=mark), check.value, check.limit, check.unit, describe_check(check)])
    worth = "The record is good enough to judge by." if quality.usable else "The record is not good enough to judge by."
    return [Text(worth), Table(["Check", "Result", "Value", "Limit", "Unit", "Why"], rows)]


def _provenance(diagnosis: Diagnosis, settings: Mapping[str, Any]) -> TrustedHtml:
    from stiction import __version__

    record = diagnosis.record
    origin = record.provenance
    kind = {None: "unknown", True: "integrating", False: "self-regulating"}[record.integrating]
    rows = [
        ("Source", [origin.source]),
        ("SHA-256", [origin.sha256 or "no file"]),
        ("Columns", [f"{name}: {column}" for name, column in origin.columns.items()]),
        ("Assumed", list(origin.assumptions)),
        ("Rows", [f"{origin.rows} read, {origin.missing_samples} without a good OP or PV"] if origin.rows else []),
        (
            "Record",
            [
                f"{len(record)} samples, one every {labels.format_duration(record.dt)}, {labels.format_duration(record.duration)} in all"
            ],
        ),
        ("Start", [f"{record.start:%Y-%m-%d %H:%M:%S %Z}".strip()] if record.start else []),
        ("Loop", [f"{record.loop_type}, process {kind}"]),
        (
            "Settings",
            [f"{name}: {labels.format_setting(value)}" for name, value in {**diagnosis.settings, **settings}.items()],
        ),
        ("Software", [f"stiction {__version__}"]),
        ("Written", [f"{datetime.now().astimezone():%Y-%m-%d %H:%M %Z}"]),
    ]
    return render_fragment("provenance.html", rows=[(name, values) for name, values in rows if values])
