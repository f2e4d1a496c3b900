"""Reasons that a person can check on the trend: sentences, and the places where they show."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.display.number_format import count_noun, format_number

if TYPE_CHECKING:
    from stiction.report.loop_view import LoopView

__all__ = ["find_rests", "visible_reasons"]

MIN_MOVE = 0.5
"""Movement of OP while the valve rests, over S, from which a rest is said [-]."""
SAME_MOVEMENT = 0.8
"""Correlation of set point and PV from which PV follows [-]."""


def find_rests(view: LoopView) -> list[tuple[int, int]]:
    """First and one past the last sample of each stretch in which the estimated valve rests while OP moves.

    Only of a valve that sticks or has play, and only where OP moves by half of S or more.
    """
    diagnosis, stem = view.diagnosis, view.valve_position
    if not diagnosis.shows_size or not np.isfinite(diagnosis.S) or not np.isfinite(stem).any():
        return []
    still = np.abs(np.diff(stem)) < 1e-6 * max(1.0, diagnosis.S)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    op = diagnosis.record.op
    rests = [(int(first), int(last) + 1) for first, last in edges.reshape(-1, 2)]
    return [(first, last) for first, last in rests if np.ptp(op[first:last]) >= MIN_MOVE * diagnosis.S]


def visible_reasons(view: LoopView) -> list[str]:
    """Two or three sentences on what the trend shows, each of which a person can check there."""
    diagnosis = view.diagnosis
    if not diagnosis.loop_state.in_control:
        return []
    lines = [_rests(view), _following(view), _waves(view), _good_valve(view)]
    return [line for line in lines if line][:3]


def _rests(view: LoopView) -> str:
    rests = find_rests(view)
    if not rests:
        return ""
    op = view.diagnosis.record.op
    move = format_number(float(np.median([np.ptp(op[first:last]) for first, last in rests])), view.op_unit_short, 2)
    times = count_noun(len(rests), "time")
    return f"The estimated valve position rests {times} while OP goes on moving, each time by about {move}."


def _following(view: LoopView) -> str:
    """Say that PV follows a set point that moves."""
    record = view.diagnosis.record
    if record.sp is None or record.pv is None or view.diagnosis.cause != "set_point":
        return ""
    known = np.isfinite(record.sp) & np.isfinite(record.pv)
    if known.sum() < 10 or not np.ptp(record.sp[known]) > 0.0:
        return ""
    likeness = float(np.corrcoef(record.sp[known], record.pv[known])[0, 1])
    if likeness < SAME_MOVEMENT:
        return ""
    moves = format_number(float(np.ptp(record.sp[known])), record.provenance.pv_unit, 2)
    return f"The set point itself moves, over a range of {moves}, and PV moves with it (correlation {likeness:.2f})."


def _waves(view: LoopView) -> str:
    """Say how PV and OP swing."""
    swing = view.diagnosis.oscillation
    if not swing.oscillating:
        return "Neither PV nor OP repeats regularly."
    from stiction.report import labels

    unit = view.diagnosis.record.provenance.pv_unit
    sizes = [
        f"{name} {{}}by {format_number(2.0 * amplitude, unit, 2)}"
        for name, amplitude, unit in (("OP", swing.amplitude_op, view.op_unit_short), ("PV", swing.amplitude_pv, unit))
        if amplitude > 0.0
    ]
    moves = " and ".join(size.format("" if k else "swings ") for k, size in enumerate(sizes))
    return f"{moves} from peak to peak, every {labels.format_duration(swing.period)}." if moves else ""


def _good_valve(view: LoopView) -> str:
    """Compare what the two valves explain."""
    found = view.diagnosis.identification
    if found is None or not np.isfinite([found.fit, found.fit_linear]).all():
        return ""
    sticky, good = (format_number(value, "%", 2) for value in (found.fit, found.fit_linear))
    if view.diagnosis.shows_size:
        return f"With a good valve the same loop would explain {good} of the movement of PV, with this valve {sticky}."
    return f"A good valve explains {good} of the movement of PV, the best sticky one {sticky}."
