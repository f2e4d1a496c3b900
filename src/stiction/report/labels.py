"""Names and number formats of the pages: verdicts, causes, methods, times."""

from __future__ import annotations

import re
from collections import Counter
from html import escape
from typing import TYPE_CHECKING

from stiction.diagnosis.identification.result import MAX_PLAY_RATIO
from stiction.diagnosis.loop_state import HEADLINES
from stiction.diagnosis.verdict.decision import decide
from stiction.display.duration_format import format_duration, format_time, time_unit
from stiction.display.finding_words import FINDINGS, finding_level
from stiction.display.number_format import count_noun, format_interval, format_number, format_probability

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.diagnosis.identification.result import Identification
    from stiction.diagnosis.verdict.diagnosis import Diagnosis
    from stiction.records.record import LoopRecord
    from stiction.report.blocks import StatusIcon

__all__ = [
    "CAUSES",
    "FINDINGS",
    "VERDICTS",
    "VERDICT_ICONS",
    "VERDICT_LINES",
    "S_text",
    "cause_label",
    "cause_title",
    "citation",
    "confidence_text",
    "count_noun",
    "finding_icon",
    "finding_line",
    "format_duration",
    "format_interval",
    "format_number",
    "format_probability",
    "format_setting",
    "format_time",
    "has_unknown_J",
    "headline",
    "method_label",
    "pv_unit",
    "signal_words",
    "stiction_size",
    "time_unit",
    "unique_loop_names",
]

VERDICTS = {"stiction": "Stiction", "no_stiction": "No stiction", "undecided": "Cannot tell"}
"""Verdict -> its name."""
VERDICT_LINES = {
    "stiction": "Valve stiction",
    "no_stiction": "No valve stiction found",
    "undecided": "Cannot tell whether the valve sticks",
}
"""Verdict of a row without a finding -> its line at the head of a page."""
VERDICT_ICONS: dict[str, StatusIcon] = {"stiction": "alert", "no_stiction": "good", "undecided": "unknown"}
"""Verdict -> its icon."""
CAUSES = {
    "valve": "valve stiction",
    "tuning": "controller tuning",
    "external": "external load",
    "set_point": "moving set point",
    "rate_limit": "rate limit of OP",
    "sensor": "PV sensor",
    "dead_zone": "dead zone at a fixed OP",
}
"""Cause of an oscillation -> its name."""
_METHODS = {
    "haegglund_shape": "Hägglund shape",
    "rossi_scali": "Rossi and Scali",
    "singhal_salsbury": "Singhal and Salsbury",
}
MIN_HIGH_CONFIDENCE, MIN_MODERATE_CONFIDENCE = 0.9, 0.75
"""Probability of the verdict from which the confidence is called high, and moderate [-]."""


def unique_loop_names(records: Sequence[LoopRecord]) -> list[str]:
    """Return a name for each loop: its tag, with the file where several loops have the same tag.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> unique_loop_names([LoopRecord("FIC-1", 1.0, op=[50.0]), LoopRecord("LIC-2", 1.0, op=[50.0])])
    ['FIC-1', 'LIC-2']
    """
    counts = Counter(record.tag for record in records)
    return [f"{r.tag} ({r.provenance.source})" if counts[r.tag] > 1 and r.provenance.source else r.tag for r in records]


def format_setting(value: object) -> str:
    """Return a setting's value as a person would write it.

    Examples
    --------
    >>> format_setting([0.4, 0.6]), format_setting({"band": 0.76529, "model": "kano"}), format_setting(None)
    ('0.4, 0.6', 'band 0.765, model kano', 'none')
    """
    if isinstance(value, dict):
        return ", ".join(f"{name} {format_setting(part)}" for name, part in value.items())
    if isinstance(value, (list, tuple)):
        return ", ".join(map(format_setting, value))
    if isinstance(value, float):
        return format_number(value)
    return "none" if value is None else str(value)


def method_label(name: str) -> str:
    """Return a method's name as a reader knows it.

    Examples
    --------
    >>> method_label("rossi_scali"), method_label("he_curve_fit")
    ('Rossi and Scali', 'He curve fit')
    """
    return _METHODS.get(name, name[:1].upper() + name[1:].replace("_", " "))


def pv_unit(diagnosis: Diagnosis | None) -> str:
    """Return the unit of the PV as its source names it, for the title of an axis."""
    return (escape(diagnosis.record.provenance.pv_unit) if diagnosis is not None else "") or "engineering units"


def citation(key: str) -> str:
    """Return author and year of a bibliography key.

    Examples
    --------
    >>> citation("horch1999"), citation("")
    ('Horch 1999', '')
    """
    parts = re.fullmatch(r"([a-z]+)(\d{4}[a-z]?)", key)
    return f"{parts[1].capitalize()} {parts[2]}" if parts else key


def has_unknown_J(identification: Identification) -> bool:
    """Whether the record shows neither the size of the slip jump nor that there is one."""
    return identification.J_undetermined and identification.J_low <= MAX_PLAY_RATIO * identification.S


def stiction_size(identification: Identification, record: LoopRecord) -> str:
    """Return S and J with their intervals, in the unit of the record's OP; an unknown J by its interval alone."""
    S, S_low, S_high = format_interval(identification.S, identification.S_low, identification.S_high)
    J, J_low, J_high = format_interval(identification.J, identification.J_low, identification.J_high)
    unit = record.op_unit_short
    jump = f"=\u00a0{J}\u00a0{unit} ({J_low} to {J_high})"
    if has_unknown_J(identification):
        jump = f"unknown ({J_low} to {J_high}\u00a0{unit})"
    return f"S\u00a0=\u00a0{S}\u00a0{record.op_unit} (95\u00a0%: {S_low} to {S_high}), J\u00a0{jump}"


def S_text(diagnosis: Diagnosis) -> str:
    """Return S with its interval, and its unit if that is not % of span; empty unless stiction or play is found."""
    identification = diagnosis.identification
    if identification is None or not diagnosis.shows_size:
        return ""
    S, low, high = format_interval(identification.S, identification.S_low, identification.S_high)
    unit = "" if diagnosis.record.op_in_percent else f"\u00a0{diagnosis.record.op_unit_short}"
    return f"{S} ({low}\u00a0to\u00a0{high}){unit}"


def finding_line(diagnosis: Diagnosis) -> str:
    """Return the finding as tables show it; of a loop that is not in control its state."""
    if not diagnosis.loop_state.in_control:
        return f"{VERDICTS[diagnosis.verdict]}: {HEADLINES[diagnosis.loop_state.state]}"
    line = FINDINGS[diagnosis.finding]
    second = diagnosis.verdict == "stiction" and diagnosis.cause not in ("none", "valve")
    return f"{line} and {cause_label(diagnosis)}" if second else line


def headline(diagnosis: Diagnosis) -> str:
    """Return the verdict in one line; the state of the loop comes first where it is not in control."""
    found = diagnosis.identification
    if not diagnosis.loop_state.in_control:
        return f"{HEADLINES[diagnosis.loop_state.state]}: cannot tell whether the valve sticks"
    line = FINDINGS[diagnosis.finding]
    if diagnosis.shows_size:
        return line if found is None else f"{line}: {stiction_size(found, diagnosis.record)}"
    return line if diagnosis.finding == "cannot_tell" else f"{line}; {_valve_text(diagnosis)}"


def _valve_text(diagnosis: Diagnosis) -> str:
    """What is said of the valve beside the finding."""
    if diagnosis.verdict == "undecided":
        hidden = decide(diagnosis.probability, diagnosis.costs) == "no_stiction"  # but a sticky valve would not show
        return "a sticky valve would not show in this record" if hidden else "cannot tell whether the valve sticks"
    S = diagnosis.S_detectable
    above = "" if S is None else f" above S\u00a0=\u00a0{S:.1f}\u00a0{diagnosis.record.op_unit_short}"
    return f"the valve {diagnosis.grade}{above}"


def finding_icon(diagnosis: Diagnosis) -> StatusIcon:
    """Return the icon of a finding, as urgent as in the tables of an audit: unknown where the fault is elsewhere."""
    if diagnosis.finding == "follows":
        return "good"
    level = finding_level(diagnosis.finding)
    return "unknown" if level == "plain" else level


def cause_title(diagnosis: Diagnosis) -> str:
    """Say what the main cause is the cause of: a loop that does not oscillate may be controlled poorly all the same."""
    return f"cause of the {'oscillation' if diagnosis.oscillation.oscillating else 'poor control'}"


def cause_label(diagnosis: Diagnosis) -> str:
    """Return the name of the main cause of the oscillation; "none" without one."""
    return CAUSES.get(diagnosis.cause, "none")


def confidence_text(diagnosis: Diagnosis) -> str:
    """Return how sure the verdict is, in words and as a probability."""
    p = diagnosis.probability
    if not diagnosis.loop_state.in_control:
        return f"No verdict on the valve: {format_probability(p)} is the share of sticky valves assumed for any loop"
    text = f"probability of stiction {format_probability(p)}"
    if diagnosis.verdict == "undecided":
        return f"No verdict ({text})"
    certainty = p if diagnosis.verdict == "stiction" else 1.0 - p
    if diagnosis.zone_is_unclear:
        return f"Low confidence, as a sticky valve and a dead zone look the same in this record ({text})"
    word = "High" if certainty >= MIN_HIGH_CONFIDENCE else "Moderate" if certainty >= MIN_MODERATE_CONFIDENCE else "Low"
    return f"{word} confidence ({text})"


def signal_words(name: str) -> str:
    """Name of a state or data check in words, signals in capitals.

    Examples
    --------
    >>> signal_words("pv_frozen"), signal_words("op resolution")
    ('PV frozen', 'OP resolution')
    """
    words = name.replace("_", " ").split()
    return " ".join(word.upper() if word in ("op", "pv", "sp", "mv") else word for word in words)
