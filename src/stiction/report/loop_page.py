"""The page of one loop: verdict, trends, reasons, valve and process, oscillation, methods, data."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.diagnosis.loop_state import HEADLINES
from stiction.report import figures, labels
from stiction.report.blocks import Block, Cell, Collapsible, Figure, Heading, SideBySide, StatusIcon, Table, Text
from stiction.report.explanation import describe_controller, describe_identification
from stiction.report.figures.contributions import feature_table
from stiction.report.loop_view import LoopView
from stiction.report.rendering import render_fragment

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.diagnosis.verdict.diagnosis import Diagnosis
    from stiction.report.blocks import TrustedHtml

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
    blocks += [*_reasons(view), *_valve(view)]
    blocks += [Heading("Oscillation"), Text(diagnosis.oscillation.reason) if diagnosis.oscillation.reason else None]
    blocks += [figures.oscillation_causes(view), _side_by_side(figures.autocorrelation(view), figures.spectrum(view))]
    blocks += [Heading("Published methods"), _methods(diagnosis), Heading("Data quality"), *_quality(diagnosis)]
    blocks += [Heading("Origin"), _provenance(diagnosis, settings or {})]
    return [block for block in blocks if block is not None]


def _side_by_side(*some: Figure | None) -> Block | None:
    present = [figure for figure in some if figure is not None]
    if len(present) > 1:
        return SideBySide(present)
    return present[0] if present else None


def _headline(diagnosis: Diagnosis) -> TrustedHtml:
    found, severity = diagnosis.identification, None
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
        facts=_facts(diagnosis),
    )


def _facts(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    found, oscillation = diagnosis.identification, diagnosis.oscillation
    facts = [("Loop state", HEADLINES[diagnosis.loop_state.state])]
    if oscillation.oscillating:
        facts += [
            ("Period", labels.format_duration(oscillation.period)),
            ("PV amplitude", labels.format_number(oscillation.amplitude_pv)),
            ("OP amplitude", labels.format_number(oscillation.amplitude_op, diagnosis.record.op_unit)),
            ("Cycles", labels.format_number(oscillation.cycles)),
        ]
    else:
        facts.append(("Oscillation", "none found"))
    if diagnosis.loop_state.in_control:
        facts.append((f"Main {labels.cause_title(diagnosis)}", labels.cause_label(diagnosis)))
    if found is not None:
        sticky, good = labels.format_number(found.fit, "%", 2), labels.format_number(found.fit_linear, "%", 2)
        facts.append(("PV explained, sticky / good valve", f"{sticky} / {good}"))
    return facts


def _reasons(view: LoopView) -> list[Block | None]:
    """Contributions of the features, and likelihood ratios over other explanations."""
    if not view.diagnosis.contributions:
        return []
    table = Table(["Feature", "Formula", "Value", "Log odds"], feature_table(view.diagnosis))
    return [
        Heading("Why this verdict"),
        _side_by_side(figures.contributions(view), figures.likelihood_ratios(view)),
        Collapsible("Values of the features", [table]),
    ]


def _valve(view: LoopView) -> list[Block | None]:
    """Valve and process as identified, with the figures."""
    blocks: list[Block | None] = [Heading("Valve and process")]
    if view.diagnosis.identification is None:
        pictures = (figures.pv_op(view), figures.valve_position(view))
        return [
            *blocks,
            Text("No valve was identified, so S and J are not known.", kind="note"),
            _side_by_side(*pictures),
        ]
    return [
        *blocks,
        _identified(view),
        _side_by_side(figures.pv_op(view), figures.valve_position(view)),
        figures.model_fit(view),
        figures.segments(view),
        figures.likelihood_surface(view),
    ]


def _identified(view: LoopView) -> Table:
    """Controller, valve and process as identified, and what limits them."""
    diagnosis, unit = view.diagnosis, view.op_unit_short
    assert diagnosis.identification is not None
    rows = [list(row) for row in describe_identification(diagnosis.identification, unit)]
    if diagnosis.controller is not None:
        rows.insert(0, ["Controller", describe_controller(diagnosis.controller, unit)])
    caption = "" if view.valve_is_accepted else "This is the best sticky-valve fit. The verdict does not rely on it."
    return Table(["Part", "Identified"], rows, caption)


def _methods(diagnosis: Diagnosis) -> Block:
    if not diagnosis.evidence:
        return Text("No published method was applied to this record.", kind="note")
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
        f"The condition of {labels.count_noun(len(votes), 'method')} is met: {votes.count('stiction')} vote for "
        f"stiction, {votes.count('no_stiction')} against it, {votes.count('undecided')} cannot tell. The methods are "
        "shown for comparison; the probability does not use their votes."
    )
    return Table(["Method", "Index [-]", "Threshold [-]", "Vote", "Condition", "Why", "Source"], rows, caption)


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")


def _quality(diagnosis: Diagnosis) -> list[Block]:
    quality = diagnosis.quality
    rows = []
    for check in sorted(quality.checks, key=lambda check: _ORDER.get(check.severity, 0)):
        word, icon = _SEVERITY.get(check.severity, (check.severity, "unknown"))
        rows.append([check.name, Cell(word, mark=icon), check.value, check.limit, check.unit, check.why])
    result = "No data check rejects the record." if quality.usable else "The data checks reject the record."
    return [Text(result), Table(["Check", "Result", "Value", "Limit", "Unit", "Why"], rows)]


def _provenance(diagnosis: Diagnosis, settings: Mapping[str, Any]) -> TrustedHtml:
    from stiction import __version__

    record, costs = diagnosis.record, diagnosis.costs
    origin = record.provenance
    kind = {None: "unknown", True: "integrating", False: "self-regulating"}[record.integrating]
    every, duration = labels.format_duration(record.dt), labels.format_duration(record.duration)
    used = {
        "prior": diagnosis.prior,
        "costs": {"false alarm": costs.false_alarm, "missed valve": costs.missed, "asking": costs.ask},
        **diagnosis.settings,
        **settings,
    }
    rows = [
        ("Source", [origin.source]),
        ("SHA-256", [origin.sha256 or "no file"]),
        ("Columns", [f"{name}: {column}" for name, column in origin.columns.items()]),
        ("Assumed", list(origin.assumptions)),
        ("Rows", [f"{origin.rows} read, {origin.missing_samples} without a good OP or PV"] if origin.rows else []),
        ("Record", [f"{len(record)} samples, one every {every}, {duration} in all"]),
        ("Start", [f"{record.start:%Y-%m-%d %H:%M:%S %Z}".strip()] if record.start else []),
        ("Loop", [f"{record.loop_type}, process {kind}"]),
        ("Settings", [f"{name}: {labels.format_setting(value)}" for name, value in used.items()]),
        ("Software", [f"stiction {__version__}"]),
        ("Written", [f"{datetime.now().astimezone():%Y-%m-%d %H:%M %Z}"]),
    ]
    return render_fragment("provenance.html", rows=[(name, values) for name, values in rows if values])
