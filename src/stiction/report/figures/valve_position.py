"""Valve position against OP, with S and J drawn as dimensions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.diagnosis.identified import J_UNKNOWN
from stiction.report import labels, style
from stiction.report.blocks import Figure
from stiction.report.last_periods import last_periods, rests_before_slips

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identified import Identification
    from stiction.report.loop_view import LoopView

__all__ = ["valve_position"]

SAME = (0.6, 1.6)
"""Slopes of the measured position over the estimated one between which both are in one unit [-]."""
SMALL = 0.1
"""Height and width of the plot below which dimensions stand no nearer [% of span]."""


def valve_position(view: LoopView) -> Figure | None:
    """Return valve position against OP over the last few periods; None when it is neither measured nor estimated."""
    record, found, shown = view.diagnosis.record, view.diagnosis.identification, last_periods(view)
    cut = shown.cut
    op, estimated = record.op[cut], view.stem[cut]
    data: list[dict[str, Any]] = []
    shapes: list[dict[str, Any]] = []
    notes: list[dict[str, Any]] = []
    if record.mv is not None:
        measured, name = record.mv[cut], "measured"
        if found is not None:
            measured, name = _in_unit_of_op(measured, estimated, view.op_unit)
        data.append(style.trace(op, measured, name, style.line_style(style.MV, 2.0)))
    if found is not None:
        name = "estimated" if view.valve_is_accepted else "sticky valve"
        if not view.valve_is_accepted and record.mv is None:
            data.append(style.trace(op, op, "good valve", style.line_style(style.MODEL, 1.5)))
        data.append(
            style.trace(op, estimated, name, style.line_style(style.MODEL if record.mv is not None else style.MV, 1.5))
        )
        if view.valve_is_accepted and shown.slips:
            shapes, notes = _dimensions(op, estimated, found, view)
    if not data:
        return None
    of_position = view.op_unit if found is not None or record.op_in_percent else "as recorded"
    layout = {
        "margin": {"t": style.BELOW_BUTTONS},
        "xaxis": {"title": {"text": f"OP (controller output) [{view.op_unit}]"}},
        "yaxis": {"title": {"text": f"Valve position [{of_position}]"}},
        "shapes": shapes,
        "annotations": notes,
        "showlegend": True,
    }
    how = {(True, False): "measured", (False, True): "estimated", (True, True): "measured and estimated"}
    kind = how[record.mv is not None, found is not None]
    caption = f"{shown.said}{_moved(found, view, slips=shown.slips) if found is not None else ''}"
    if found is not None and record.mv is None and view.valve_is_accepted:
        caption += "; the position was estimated from OP and PV, it was not measured"
    return Figure({"data": data, "layout": layout}, f"Valve position against OP, {kind}", caption + ".", height=400)


def _moved(found: Identification, view: LoopView, *, slips: bool) -> str:
    """What the estimated valve does where OP turns, as the end of a sentence."""
    unit = view.op_unit_short
    S = labels.format_interval(found.S, found.S_low, found.S_high)[0]
    J, J_low, J_high = labels.format_interval(found.J, found.J_low, found.J_high)
    if not view.valve_is_accepted:
        return f": the likeliest sticky valve, S = {S}\u00a0{unit}, was not believed; a good one follows OP"
    if not slips:
        return ": nowhere in it does the estimated valve position rest over S and then slip"
    if found.J_told == J_UNKNOWN:
        jump = f"; whether it then jumps is open (by {J_low} to {J_high}\u00a0{unit})"
    elif found.J_open:
        jump = f", then it jumps, how far is open (by {J_low} to {J_high}\u00a0{unit})"
    else:
        jump = f", then the valve jumps J = {J}\u00a0{unit}" if found.J > 0.0 else "; no jump was found"
    return f": after a reversal the OP travels S = {S}\u00a0{unit} before the valve moves{jump}"


def _in_unit_of_op(
    measured: NDArray[np.float64], estimated: NDArray[np.float64], unit: str
) -> tuple[NDArray[np.float64], str]:
    """A measured position on the scale of the estimated one where it is in another unit, such as mA; and its name."""
    both = np.isfinite(measured) & np.isfinite(estimated)
    if both.sum() < 3 or not np.ptp(estimated[both]) > 0.0:
        return measured, "measured"
    slope, level = np.polyfit(estimated[both], measured[both], 1)
    apart = abs(float(np.mean(measured[both] - estimated[both])))
    if slope == 0.0 or (SAME[0] < slope < SAME[1] and apart < float(np.ptp(estimated[both]))):
        return measured, "measured"
    return (measured - level) / slope, f"measured, brought to {unit}"


def _dimensions(
    op: NDArray[np.float64], mv: NDArray[np.float64], found: Identification, view: LoopView
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """S along the rest before a slip in which the OP travels farthest; J from its end, where that is not open."""
    S, J, unit = found.S, found.J, view.op_unit_short
    if not np.isfinite([S, J]).all() or S <= 0.0:
        return [], []
    stuck = max(rests_before_slips(mv, op, S), key=lambda rest: float(np.ptp(op[rest])), default=None)
    if stuck is None:
        return [], []
    least = SMALL if view.diagnosis.record.op_in_percent else 0.0
    travel, level = op[stuck], float(mv[stuck.start])
    way = -1.0 if travel.argmax() < travel.argmin() else 1.0
    turn = float(travel.max() if way < 0.0 else travel.min())
    end, height, width = turn + way * S, float(np.nanmax(mv) - np.nanmin(mv)), float(np.nanmax(op) - np.nanmin(op))
    beside = level - way * 0.06 * max(height, least)
    shapes = [_line(turn, beside, end, beside), _tick(turn, level, beside), _tick(end, level, beside)]
    said = f"S = {labels.format_interval(S, found.S_low, found.S_high)[0]} {unit}"
    notes = [_note(0.5 * (turn + end), beside, said, yanchor="bottom" if way < 0.0 else "top")]
    if height * 0.04 < J and not found.J_open:
        aside = end + way * 0.04 * max(width, least)
        shapes += [_line(aside, level, aside, level + way * J)]
        shapes += [_rung(aside, end, level), _rung(aside, end, level + way * J)]
        anchor = "right" if way < 0.0 else "left"
        said = f"J = {labels.format_interval(J, found.J_low, found.J_high)[0]} {unit}"
        notes.append(_note(aside, level + 0.5 * way * J, said, xanchor=anchor))
    return shapes, notes


def _line(x0: float, y0: float, x1: float, y1: float, color: str = style.TEXT_COLOR) -> dict[str, Any]:
    return {"type": "line", "x0": x0, "y0": y0, "x1": x1, "y1": y1, "line": {"color": color, "width": 1.2}}


def _tick(x: float, y0: float, y1: float) -> dict[str, Any]:
    return _line(x, y0, x, y1 + 0.35 * (y1 - y0), style.SECONDARY_COLOR)


def _rung(x0: float, x1: float, y: float) -> dict[str, Any]:
    return _line(x0 - 0.35 * (x1 - x0), y, x1, y, style.SECONDARY_COLOR)


def _note(x: float, y: float, text: str, **anchor: str) -> dict[str, Any]:
    return {"x": x, "y": y, "text": text, "showarrow": False, "font": {"size": 13}, "borderpad": 4, **anchor}
