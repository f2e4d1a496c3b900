"""What a notebook shows of a result: its card. The results are only read, by attribute; nothing is computed."""

from __future__ import annotations

import math
from typing import Any

from stiction.display.card import bar, card, paragraph, sparkline, table
from stiction.display.duration_format import format_seconds, format_time
from stiction.display.number_format import count_noun, format_interval, format_number, format_probability

__all__ = [
    "diagnoses_html",
    "group_html",
    "identification_html",
    "record_html",
    "records_html",
    "trial_html",
    "verdict_html",
]

VERDICTS = {"stiction": "The valve sticks", "no_stiction": "No stiction", "undecided": "Cannot tell"}
"""Verdict -> the headline of its card."""
MAX_LISTED = 50
"""Loops that a card of many lists [-]."""
MAX_MEMBERS = 20
"""Loops of a group that a card lists [-]."""


def record_html(record: Any) -> str:
    """Return the card of a LoopRecord: size, signals, drawings."""
    length = f"{count_noun(len(record), 'sample')} every {format_seconds(record.dt)}, {format_seconds(record.duration)}"
    start = f", from {format_time(record.start)}" if record.start is not None else ""
    missing = f" {format_number(record.missing_percent, '%')} missing." if record.missing_percent else ""
    title = f"{record.tag} ({record.loop_type})"
    return card(title, [paragraph(f"{length}{start}.{missing}"), *_drawings(record)])


def records_html(records: Any) -> str:
    """Return the card of Records: one line for each loop."""
    rows = [
        (
            record.tag,
            record.loop_type or "",
            count_noun(len(record), "sample"),
            format_seconds(record.duration),
            format_time(record.start),
        )
        for record in records[:MAX_LISTED]
    ]
    more = len(records) - len(rows)
    rest = [paragraph(f"and {count_noun(more, 'more loop')}")] if more else []
    return card(count_noun(len(records), "loop"), [table(rows, ("loop", "type", "samples", "length", "from")), *rest])


def diagnoses_html(diagnoses: Any, rows: list[tuple[str, str, str]]) -> str:
    """Return the card of Diagnoses: loop, finding and next step of each."""
    more = len(rows) - MAX_LISTED
    rest = [paragraph(f"and {count_noun(more, 'more loop')}")] if more > 0 else []
    rest += [paragraph(text) for text in diagnoses.failures[:MAX_LISTED]]
    return card(repr(diagnoses)[1:-1], [table(rows[:MAX_LISTED], ("loop", "finding", "next step")), *rest])


def verdict_html(diagnosis: Any) -> str:
    """Return the card of a Diagnosis: headline, reason, action, drawings."""
    name = VERDICTS.get(diagnosis.verdict, diagnosis.verdict)
    in_control = diagnosis.loop_state.in_control
    parts = []
    if in_control:
        parts += [
            paragraph(f"Probability of stiction {format_probability(diagnosis.probability)}"),
            bar(diagnosis.probability),
        ]
    parts += [paragraph(diagnosis.reason), paragraph(diagnosis.action)]
    if diagnosis.identification is not None and diagnosis.verdict == "stiction":
        parts.append(_size_table(diagnosis.identification, diagnosis.record.op_unit))
    return card(f"{diagnosis.record.tag}: {name}", [*parts, *_drawings(diagnosis.record)])


def identification_html(identification: Any) -> str:
    """Return the card of an Identification: size of the stiction, process, fit."""
    process = identification.process
    kind = "integrating process" if process.integrating else "process"
    text = (
        f"{kind}: gain {format_number(process.gain)}, time constant {format_number(process.time_constant, 's')}, dead "
        f"time {format_number(process.dead_time, 's')}. The simulation explains "
        f"{format_number(identification.fit, '%')} of the PV, with a good valve "
        f"{format_number(identification.fit_linear, '%')}."
    )
    reason = [paragraph(identification.reason)] if identification.reason else []
    return card(
        f"Valve model {identification.model}",
        [_size_table(identification, "% of span"), paragraph(text[0].upper() + text[1:]), *reason],
    )


def group_html(group: Any) -> str:
    """Return the card of a Group: period, likeliest sources, members."""
    rows = [
        (loop.tag, format_seconds(loop.period), f"{loop.coherence:.2f}", f"{loop.phase:+.0f}°")
        for loop in group.members[:MAX_MEMBERS]
    ]
    more, similar = len(group.members) - len(rows), ", ".join(group.similar[:MAX_MEMBERS])
    roots = ", ".join(f"{loop.tag} ({format_probability(loop.probability)})" for loop in group.leading_roots())
    parts = [
        paragraph(f"Likeliest source: {roots}."),
        table(rows, ("loop", "period", "coherence", "phase")),
        *([paragraph(f"and {count_noun(more, 'more loop')}")] if more else []),
        *([paragraph(f"Similar periods, connection not shown: {similar}.")] if similar else []),
    ]
    return card(f"{count_noun(len(group.members), 'loop')} oscillate every {format_seconds(group.period)}", parts)


def trial_html(trial: Any) -> str:
    """Return the card of a CompensationTrial: recommendation and what each remedy gives and costs."""
    if trial.recommended is None:
        return card(f"{trial.tag}: no advice", [paragraph(trial.reason)])
    rows = [
        (
            ("→ " if remedy.name == trial.recommended else "") + remedy.name,
            f"{-100 * remedy.improvement:+.0f} %",
            format_number(remedy.behaviour.travel),
            format_number(remedy.behaviour.reversals),
            f"{remedy.cost:.2f}",
        )
        for remedy in trial.remedies
    ]
    head = ("remedy", "PV deviation", "travel [%/h]", "reversals [1/h]", "cost")
    parts = [paragraph(trial.reason), table(rows, head), *([paragraph(trial.risk)] if trial.risk else [])]
    return card(f"{trial.tag}: {trial.recommended}", parts)


def _size_table(identification: Any, unit: str) -> str:
    """Table of S and J with their intervals."""
    rows = []
    for name, meaning in (("S", "deadband plus stickband"), ("J", "slip jump")):
        ends = [getattr(identification, name + part) for part in ("", "_low", "_high")]
        value, low, high = format_interval(*ends)
        interval = f"95 % interval {low} to {high}" if all(map(math.isfinite, ends)) else ""
        rows.append((f"{name}, {meaning}", f"{value} {unit}", interval))
    return table(rows)


def _drawings(record: Any) -> list[str]:
    """PV with SP, and OP with the valve position."""
    parts = []
    for label, names in (("PV and set point", ("sp", "pv")), ("OP and valve position", ("mv", "op"))):
        signals = [(name, series.tolist()) for name in names if (series := getattr(record, name)) is not None]
        if signals and len(record):
            parts += [paragraph(label), sparkline(signals, f"{label} over time")]
    return parts
