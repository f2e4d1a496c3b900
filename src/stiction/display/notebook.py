"""What a notebook shows of a result: its card. The results are only read, by attribute; nothing is computed."""

from __future__ import annotations

import math
from typing import Any

from stiction.display.card import bar, card, paragraph, sparkline, table
from stiction.display.duration_format import format_seconds
from stiction.display.number_format import count_noun, format_interval, format_number, format_probability

__all__ = ["group_html", "identification_html", "record_html", "trial_html", "verdict_html"]

VERDICTS = {"stiction": "The valve sticks", "no_stiction": "No stiction", "undecided": "Cannot tell"}
"""Verdict -> the headline of its card."""
MAX_MEMBERS = 20
"""Loops of a group that a card lists [-]."""


def record_html(record: Any) -> str:
    """Return the card of a LoopRecord: size, signals, drawings."""
    length = f"{count_noun(len(record), 'sample')} every {format_seconds(record.dt)}, {format_seconds(record.duration)}"
    start = f", from {record.start:%Y-%m-%d %H:%M:%S}" if record.start is not None else ""
    missing = f" {format_number(record.missing_percent, '%')} missing." if record.missing_percent else ""
    title = f"{record.tag} ({record.loop_type})"
    return card(title, [paragraph(f"{length}{start}.{missing}"), *_drawings(record)])


def verdict_html(found: Any) -> str:
    """Return the card of a Diagnosis: headline, reason, action, drawings."""
    name = VERDICTS.get(found.verdict, found.verdict)
    in_control = found.loop_state.in_control
    parts = []
    if in_control:
        parts += [paragraph(f"Probability of stiction {format_probability(found.probability)}"), bar(found.probability)]
    parts += [paragraph(found.reason), paragraph(found.action)]
    if found.identification is not None and found.verdict == "stiction":
        parts.append(_size_table(found.identification, found.record.op_unit))
    return card(f"{found.record.tag}: {name}", [*parts, *_drawings(found.record)])


def identification_html(found: Any) -> str:
    """Return the card of an Identification: size of the stiction, process, fit."""
    process = found.process
    kind = "integrating process" if process.integrating else "process"
    text = (
        f"{kind}: gain {format_number(process.gain)}, time constant {format_number(process.time_constant, 's')}, dead "
        f"time {format_number(process.dead_time, 's')}. The simulation explains {format_number(found.fit, '%')} of the "
        f"PV, with a good valve {format_number(found.fit_linear, '%')}."
    )
    reason = [paragraph(found.reason)] if found.reason else []
    return card(
        f"Valve model {found.model}",
        [_size_table(found, "% of span"), paragraph(text[0].upper() + text[1:]), *reason],
    )


def group_html(group: Any) -> str:
    """Return the card of a Group: period, likeliest sources, members."""
    rows = [
        (one.tag, format_seconds(one.period), f"{one.coherence:.2f}", f"{one.phase:+.0f}°")
        for one in group.members[:MAX_MEMBERS]
    ]
    more = len(group.members) - len(rows)
    roots = ", ".join(f"{one.tag} ({format_probability(one.probability)})" for one in group.leading_roots())
    parts = [
        paragraph(f"Likeliest source: {roots}."),
        table(rows, ("loop", "period", "coherence", "phase")),
        *([paragraph(f"and {count_noun(more, 'more loop')}")] if more else []),
        *([paragraph(group.remark)] if group.remark else []),
    ]
    return card(f"{count_noun(len(group.members), 'loop')} oscillate every {format_seconds(group.period)}", parts)


def trial_html(trial: Any) -> str:
    """Return the card of a CompensationTrial: recommendation and what each remedy gives and costs."""
    if trial.recommended is None:
        return card(f"{trial.tag}: no advice", [paragraph(trial.reason)])
    rows = [
        (
            ("→ " if one.name == trial.recommended else "") + one.name,
            f"{-100 * one.improvement:+.0f} %",
            format_number(one.behaviour.travel),
            format_number(one.behaviour.reversals),
            f"{one.cost:.2f}",
        )
        for one in trial.remedies
    ]
    head = ("remedy", "PV deviation", "travel [%/h]", "reversals [1/h]", "cost")
    parts = [paragraph(trial.reason), table(rows, head), *([paragraph(trial.risk)] if trial.risk else [])]
    return card(f"{trial.tag}: {trial.recommended}", parts)


def _size_table(found: Any, unit: str) -> str:
    """Table of S and J with their intervals."""
    rows = []
    for name, meaning in (("S", "deadband plus stickband"), ("J", "slip jump")):
        ends = [getattr(found, name + part) for part in ("", "_low", "_high")]
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
