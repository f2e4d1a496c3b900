"""Valve position against OP, with S and J drawn as dimensions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.records.straight_line import fit_line
from stiction.report import labels, style
from stiction.report.blocks import Figure
from stiction.report.last_periods import last_periods, rests_before_slips

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.result import Identification
    from stiction.report.loop_view import LoopView

__all__ = ["valve_position"]

SAME_UNIT_SLOPES = (0.6, 1.6)
"""Slopes of the measured over the estimated position between which both have the same unit [-]."""
MIN_SIZE = 0.1
"""Smallest height and width of the plot for the distance of the dimensions from the curve [% of span]."""


def valve_position(view: LoopView) -> Figure | None:
    """Return valve position against OP over the last few periods; None when it is neither measured nor estimated."""
    record, identification, plotted = view.diagnosis.record, view.diagnosis.identification, last_periods(view)
    op, estimated = record.op[plotted.cut], view.valve_position[plotted.cut]
    data: list[dict[str, Any]] = []
    shapes: list[dict[str, Any]] = []
    notes: list[dict[str, Any]] = []
    if record.mv is not None:
        measured, name = record.mv[plotted.cut], "measured"
        if identification is not None:
            measured, name = _in_unit_of_op(measured, estimated, view.op_unit)
        data.append(style.trace(op, measured, name, style.line_style(style.MV, 2.0)))
    if identification is not None:
        name = "estimated" if view.valve_is_accepted else "sticky valve"
        if not view.valve_is_accepted and record.mv is None:
            data.append(style.trace(op, op, "good valve", style.line_style(style.MODEL, 1.5)))
        data.append(
            style.trace(op, estimated, name, style.line_style(style.MODEL if record.mv is not None else style.MV, 1.5))
        )
        if view.valve_is_accepted and plotted.has_slips:
            shapes, notes = _dimensions(op, estimated, identification, view)
    if not data:
        return None
    of_position = view.op_unit if identification is not None or record.op_in_percent else "as recorded"
    layout = {
        "margin": {"t": style.BELOW_BUTTONS},
        "xaxis": {"title": {"text": f"OP (controller output) [{view.op_unit}]"}},
        "yaxis": {"title": {"text": f"Valve position [{of_position}]"}},
        "shapes": shapes,
        "annotations": notes,
        "showlegend": True,
    }
    how = {(True, False): "measured", (False, True): "estimated", (True, True): "measured and estimated"}
    kind = how[record.mv is not None, identification is not None]
    caption = plotted.text
    if identification is not None:
        caption += _describe_motion(identification, view, has_slips=plotted.has_slips)
    if identification is not None and record.mv is None and view.valve_is_accepted:
        caption += ". The position is estimated from OP and PV; it was not measured"
    return Figure({"data": data, "layout": layout}, f"Valve position against OP, {kind}", caption + ".", height=400)


def _describe_motion(identification: Identification, view: LoopView, *, has_slips: bool) -> str:
    """How the estimated valve moves after a reversal of OP, as the end of a sentence."""
    unit = view.op_unit_short
    S = labels.format_interval(identification.S, identification.S_low, identification.S_high)[0]
    J, J_low, J_high = labels.format_interval(identification.J, identification.J_low, identification.J_high)
    if not view.valve_is_accepted:
        return f"; a good valve follows OP. The best sticky valve (S = {S}\u00a0{unit}) is not accepted by the verdict"
    if not has_slips:
        return "; the estimated valve position does not rest over S and then slip in them"
    interval = f"({J_low} to {J_high}\u00a0{unit})"
    if labels.has_unknown_J(identification):
        jump = f"; whether it then jumps is unknown {interval}"
    elif identification.J_undetermined:
        jump = f", then it jumps by an uncertain J {interval}"
    else:
        jump = f", then the valve jumps by J = {J}\u00a0{unit}" if identification.J > 0.0 else "; no jump was found"
    return f": after a reversal OP travels S = {S}\u00a0{unit} before the valve moves{jump}"


def _in_unit_of_op(
    measured: NDArray[np.float64], estimated: NDArray[np.float64], unit: str
) -> tuple[NDArray[np.float64], str]:
    """The measured position and its name; converted to the unit of OP where it is in another unit, such as mA."""
    both = np.isfinite(measured) & np.isfinite(estimated)
    if both.sum() < 3 or not np.ptp(estimated[both]) > 0.0:
        return measured, "measured"
    line = fit_line(estimated[both], measured[both])
    apart = abs(float(np.mean(measured[both] - estimated[both])))
    if line.slope == 0.0 or (
        SAME_UNIT_SLOPES[0] < line.slope < SAME_UNIT_SLOPES[1] and apart < float(np.ptp(estimated[both]))
    ):
        return measured, "measured"
    return line.x_mean + (measured - line.y_mean) / line.slope, f"measured, converted to {unit}"


def _dimensions(
    op: NDArray[np.float64], mv: NDArray[np.float64], identification: Identification, view: LoopView
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """S along the rest before a slip in which OP travels farthest, and J at its end when it is determined."""
    S, J, unit = identification.S, identification.J, view.op_unit_short
    if not np.isfinite([S, J]).all() or S <= 0.0:
        return [], []
    stuck = max(rests_before_slips(mv, op, S), key=lambda rest: float(np.ptp(op[rest])), default=None)
    if stuck is None:
        return [], []
    least = MIN_SIZE if view.diagnosis.record.op_in_percent else 0.0
    travel, level = op[stuck], float(mv[stuck.start])
    way = -1.0 if travel.argmax() < travel.argmin() else 1.0
    turn = float(travel.max() if way < 0.0 else travel.min())
    end, height, width = turn + way * S, float(np.nanmax(mv) - np.nanmin(mv)), float(np.nanmax(op) - np.nanmin(op))
    y_S = level - way * 0.06 * max(height, least)
    shapes = [_line(turn, y_S, end, y_S), _tick(turn, level, y_S), _tick(end, level, y_S)]
    text = f"S = {labels.format_interval(S, identification.S_low, identification.S_high)[0]} {unit}"
    notes = [_note(0.5 * (turn + end), y_S, text, yanchor="bottom" if way < 0.0 else "top")]
    if height * 0.04 < J and not identification.J_undetermined:
        x_J = end + way * 0.04 * max(width, least)
        shapes += [_line(x_J, level, x_J, level + way * J)]
        shapes += [_rung(x_J, end, level), _rung(x_J, end, level + way * J)]
        anchor = "right" if way < 0.0 else "left"
        text = f"J = {labels.format_interval(J, identification.J_low, identification.J_high)[0]} {unit}"
        notes.append(_note(x_J, level + 0.5 * way * J, text, xanchor=anchor))
    return shapes, notes


def _line(x0: float, y0: float, x1: float, y1: float, color: str = style.TEXT_COLOR) -> dict[str, Any]:
    return {"type": "line", "x0": x0, "y0": y0, "x1": x1, "y1": y1, "line": {"color": color, "width": 1.2}}


def _tick(x: float, y0: float, y1: float) -> dict[str, Any]:
    return _line(x, y0, x, y1 + 0.35 * (y1 - y0), style.SECONDARY_COLOR)


def _rung(x0: float, x1: float, y: float) -> dict[str, Any]:
    return _line(x0 - 0.35 * (x1 - x0), y, x1, y, style.SECONDARY_COLOR)


def _note(x: float, y: float, text: str, **anchor: str) -> dict[str, Any]:
    return {"x": x, "y": y, "text": text, "showarrow": False, "font": {"size": 13}, "borderpad": 4, **anchor}
