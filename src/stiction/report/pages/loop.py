"""The page of one loop: verdict, trends, reasons, valve and process, oscillation, methods, data."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.diagnosis.loop_state import HEADLINES, describe_state
from stiction.display.finding_words import can_wait
from stiction.report import figures, labels
from stiction.report.blocks import (
    Block,
    Cell,
    Collapsible,
    Definitions,
    Figure,
    Heading,
    Headline,
    SideBySide,
    StatusIcon,
    Table,
    Text,
)
from stiction.report.identification_text import describe_controller, describe_identification
from stiction.report.loop_view import LoopView
from stiction.report.visible_reasons import visible_reasons

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.diagnosis.verdict.diagnosis import Diagnosis

__all__ = ["loop_blocks", "loop_headline", "loop_sections"]

_SEVERITY: dict[str, tuple[str, StatusIcon]] = {
    "reject": ("rejected", "alert"),
    "warn": ("warning", "unknown"),
    "ok": ("passed", "good"),
}
"""Severity of a data check, the worst first -> its name and icon."""


def loop_blocks(diagnosis: Diagnosis, settings: Mapping[str, Any] | None = None) -> list[Block]:
    """Return all blocks of one loop; `settings` of the run are listed with its origin."""
    sections = loop_sections(diagnosis, settings)
    blocks = (block for title, parts in sections.items() for block in (Heading(title), *parts))
    return [loop_headline(diagnosis), *blocks]


def loop_headline(diagnosis: Diagnosis) -> Headline:
    """Return the finding on one loop with its main numbers."""
    identification, severity = diagnosis.identification, None
    if identification is not None and diagnosis.shows_size and np.isfinite(identification.S):
        severity = figures.severity(identification, diagnosis.record)
    line, action, step = labels.headline(diagnosis), diagnosis.action, diagnosis.next_step
    mark = labels.finding_icon(diagnosis)
    if "follows" in diagnosis.settings:  # what the audit says of a loop that oscillates with another
        line, action, step, mark = diagnosis.settings["follows"], diagnosis.settings["next_step"], "", "good"
    return Headline(
        diagnosis.record.tag,
        diagnosis.verdict,
        mark,
        line,
        labels.confidence_text(diagnosis),
        diagnosis.reason,
        action=f"{action} Next step: {step}" if step and step not in action else action,
        facts=_facts(diagnosis),
        severity=severity,
    )


def loop_sections(diagnosis: Diagnosis, settings: Mapping[str, Any] | None = None) -> dict[str, list[Block]]:
    """Return the blocks of each section by its title, in the order of the page."""
    view = LoopView(diagnosis)
    sections: dict[str, list[Block | None]] = {
        "Over time": [figures.windows(diagnosis)],
        "Trends": [_state(diagnosis), figures.trends(view)],
        "Why this verdict": _reasons(view),
        "Valve and process": _valve(view),
        "Oscillation": [
            _oscillation(diagnosis),
            figures.oscillation_causes(view),
            side_by_side(figures.autocorrelation(view), figures.spectrum(view)),
        ],
        "Published methods": [_methods(diagnosis)],
        "Data quality": [*_quality(diagnosis)],
        "Origin": [_provenance(diagnosis, settings or {})],
    }
    present = {title: [block for block in blocks if block is not None] for title, blocks in sections.items()}
    return {title: blocks for title, blocks in present.items() if blocks}


def _reasons(view: LoopView) -> list[Block | None]:
    """Sentences that can be checked on the trend; the bars of the features are folded below."""
    bars = side_by_side(figures.contributions(view), figures.likelihood_ratios(view))
    if bars is None:
        return []
    return [Text(" ".join(visible_reasons(view))), Collapsible("How each measured feature counts", [bars])]


def side_by_side(*some: Figure | None) -> Block | None:
    """Return the figures that exist beside each other; a single one alone, None without any."""
    present = [figure for figure in some if figure is not None]
    if len(present) > 1:
        return SideBySide(present)
    return present[0] if present else None


def _facts(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    identification, oscillation, record = diagnosis.identification, diagnosis.oscillation, diagnosis.record
    facts = [("Loop state", HEADLINES[diagnosis.loop_state.state])]
    if oscillation.oscillating:
        facts += [
            ("Period", labels.format_duration(oscillation.period)),
            ("PV amplitude", labels.format_number(oscillation.amplitude_pv, record.provenance.pv_unit or "unit of PV")),
            ("OP amplitude", labels.format_number(oscillation.amplitude_op, record.op_unit)),
            ("Cycles", labels.format_number(oscillation.cycles)),
        ]
    else:
        facts.append(("Oscillation", "none found"))
    if diagnosis.loop_state.in_control:
        if diagnosis.verdict == "no_stiction" and diagnosis.S_detectable is not None:
            facts.append(("Stiction that would have shown", f"above {diagnosis.S_detectable:.1f} {record.op_unit}"))
        if oscillation.oscillating or diagnosis.cause != "none":
            facts.append((f"Main {labels.cause_title(diagnosis)}", labels.cause_label(diagnosis)))
    if identification is not None:
        sticky, good = (
            labels.format_number(identification.fit, "%", 2),
            labels.format_number(identification.fit_linear, "%", 2),
        )
        facts.append(("PV explained, sticky / good valve", f"{sticky} / {good}"))
    test = diagnosis.valve_test
    if test is not None and "follows" not in diagnosis.settings:
        waits = can_wait(diagnosis.finding, oscillating=oscillation.oscillating)
        facts.append(("Test, if you want to know" if waits else "Plan of the test", test.command))
    return facts


def _state(diagnosis: Diagnosis) -> Text | None:
    """State of a loop that is not in control, and the stretches of the record in another state."""
    record, state = diagnosis.record, diagnosis.loop_state
    lines = [describe_state(state, record.start, record.provenance.pv_unit)]
    if state.in_control:
        lines = [
            f"{HEADLINES[stretch.state]} from {labels.format_duration(stretch.start_s)} to "
            f"{labels.format_duration(stretch.end_s)}."
            for stretch in state.stretches
        ]
    return Text(" ".join(lines)) if any(lines) else None


def _oscillation(diagnosis: Diagnosis) -> Text | None:
    """What was found of a periodic movement, and of further ones."""
    oscillation = diagnosis.oscillation
    lines = [oscillation.reason] if oscillation.reason else []
    lines += [
        f"A further oscillation of period {labels.format_duration(other.period)} carries {100.0 * other.share:.0f} % "
        "of the variance of the control error."
        for other in oscillation.others
    ]
    return Text(" ".join(lines)) if lines else None


def _valve(view: LoopView) -> list[Block | None]:
    """Controller, valve and process as identified, and what limits them, with the figures."""
    diagnosis, unit = view.diagnosis, view.op_unit_short
    rows = [] if diagnosis.controller is None else [["Controller", describe_controller(diagnosis.controller, unit)]]
    pictures = side_by_side(figures.pv_op(view), figures.valve_position(view))
    if diagnosis.identification is None:
        note = Text("No valve was identified, so S and J are not known.", kind="note")
        return [Table(["Part", "Identified"], rows) if rows else None, note, pictures]
    rows += [list(row) for row in describe_identification(diagnosis.identification, unit)]
    caption = "" if view.valve_is_accepted else "This is the best sticky-valve fit. The verdict does not rely on it."
    return [
        Table(["Part", "Identified"], rows, caption),
        pictures,
        figures.model_fit(view),
        figures.segments(view),
        figures.likelihood_surface(view),
    ]


def _methods(diagnosis: Diagnosis) -> Block:
    if not diagnosis.evidence:
        return Text("No published method was applied to this record.", kind="note")
    rows = [
        [
            labels.method_label(row.method),
            row.index,
            row.threshold,
            Cell(labels.VERDICTS[row.vote], mark=labels.VERDICT_ICONS[row.vote] if row.valid else ""),
            "met" if row.valid else "not met",
            row.why,
            labels.citation(row.source),
        ]
        for row in diagnosis.evidence
    ]
    votes = [row.vote for row in diagnosis.evidence if row.valid]
    caption = (
        f"{labels.count_noun(len(votes), 'method')} can be used here: {votes.count('stiction')} for stiction, "
        f"{votes.count('no_stiction')} against it, {votes.count('undecided')} cannot tell. The methods are shown for "
        "comparison; the probability does not use their votes."
    )
    return Table(["Method", "Index [-]", "Threshold [-]", "Vote", "Condition", "Why", "Source"], rows, caption)


def _quality(diagnosis: Diagnosis) -> list[Block]:
    quality, order = diagnosis.quality, list(_SEVERITY)
    rows = [
        [
            labels.signal_words(check.name),
            Cell(_SEVERITY[check.severity][0], mark=_SEVERITY[check.severity][1]),
            check.value,
            check.limit,
            check.unit,
            check.why,
        ]
        for check in sorted(quality.checks, key=lambda check: order.index(check.severity))
    ]
    result = "No data check rejects the record." if quality.usable else "The data checks reject the record."
    return [Text(result), Table(["Check", "Result", "Value", "Limit", "Unit", "Why"], rows)]


def _provenance(diagnosis: Diagnosis, settings: Mapping[str, Any]) -> Definitions:
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
    read = f"{labels.count_noun(origin.rows, 'row')} read, {origin.missing_samples} without a good OP or PV"
    return Definitions(
        [
            ("Source", [origin.source]),
            ("SHA-256", [origin.sha256 or "no file"]),
            ("Columns", [f"{name}: {column}" for name, column in origin.columns.items()]),
            ("Assumed", list(origin.assumptions)),
            ("Rows", [read] if origin.rows else []),
            ("Record", [f"{labels.count_noun(len(record), 'sample')}, one every {every}, {duration} in all"]),
            ("Start", [labels.format_time(record.start)]),
            ("Loop", [f"{record.loop_type}, process {kind}"]),
            ("Settings", [f"{name}: {labels.format_setting(value)}" for name, value in used.items()]),
            ("Software", [f"stiction {__version__}"]),
            ("Written", [labels.format_time(datetime.now().astimezone())]),
        ]
    )
