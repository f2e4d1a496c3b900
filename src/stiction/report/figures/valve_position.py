"""Valve position against OP, with S and J drawn as dimensions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.records.rests import runs
from stiction.report import look, words
from stiction.report.blocks import Figure

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.report.view import View

__all__ = ["valve_position"]

SAME = (0.6, 1.6)
"""Slopes of the measured position over the estimated one between which both are in one unit [-]."""
SMALL = 0.1
"""Height and width of the plot below which dimensions stand no nearer [% of span]."""


def valve_position(view: View) -> Figure | None:
    """Return valve position against OP over the last few periods; None when it is neither measured nor estimated."""
    record, found, cut = view.diagnosis.record, view.diagnosis.identification, view.cycles
    op = record.op[cut]
    data: list[dict[str, Any]] = []
    shapes: list[dict[str, Any]] = []
    notes: list[dict[str, Any]] = []
    if record.mv is not None:
        data.append(look.trace(op, record.mv[cut], "measured", look.line(look.MV, 2.0)))
    S, J, unit = "", "", view.op_unit_short
    # Play is told by S; any other valve that was not found to stick has none.
    sticks = view.diagnosis.verdict != "no_stiction" or view.diagnosis.cause == "deadband"
    if found is not None:
        if record.mv is not None:
            measured, name = _in_unit_of_op(record.mv[cut], view.laid(found.mv)[cut], view.op_unit)
            data = [look.trace(op, measured, name, look.line(look.MV, 2.0))]
        S = words.interval(found.S, found.S_low, found.S_high)[0]
        J = words.interval(found.J, found.J_low, found.J_high)[0]
        estimated = view.laid(found.mv)[cut]
        name = "estimated" if sticks else "estimated, if it stuck"
        data.append(look.trace(op, estimated, name, look.line(look.MODEL if record.mv is not None else look.MV, 1.5)))
        least = SMALL if record.op_in_percent else 0.0
        if sticks:
            shapes, notes = _dimensions(op, estimated, found.S, found.J, (f"S = {S} {unit}", f"J = {J} {unit}"), least)
    if not data:
        return None
    of_position = view.op_unit if found is not None or record.op_in_percent else "as recorded"
    layout = {
        "xaxis": {"title": {"text": f"OP (controller output) [{view.op_unit}]"}},
        "yaxis": {"title": {"text": f"Valve position [{of_position}]"}},
        "shapes": shapes,
        "annotations": notes,
        "showlegend": True,
    }
    how = {(True, False): "measured", (False, True): "estimated", (True, True): "measured and estimated"}
    kind = how[record.mv is not None, found is not None]
    caption = f"Valve position ({kind}) against OP"
    if found is not None and not sticks:
        caption += f": the likeliest valve that would stick has S = {S}\u00a0{unit}, and none was found that does"
    elif found is not None:
        caption += f": after a reversal the OP travels S = {S}\u00a0{unit} before the valve moves" + (
            f", then the valve jumps J = {J}\u00a0{unit}" if found.J > 0.0 else "; no jump was found"
        )
    if found is not None and record.mv is None:
        caption += "; the position was estimated from OP and PV, it was not measured"
    return Figure({"data": data, "layout": layout}, f"Valve position against OP, {kind}", caption + ".", height=400)


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
    op: NDArray[np.float64], mv: NDArray[np.float64], S: float, J: float, said: tuple[str, str], least: float
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """S along the stretch in which the valve stands still for the longest travel of the OP; J from its end."""
    stuck = _longest_stuck(op, mv)
    if stuck is None or not np.isfinite([S, J]).all() or S <= 0.0:
        return [], []
    travel, level = op[stuck], float(mv[stuck.start])
    way = -1.0 if travel.argmax() < travel.argmin() else 1.0
    turn = float(travel.max() if way < 0.0 else travel.min())
    end, height, width = turn + way * S, float(np.nanmax(mv) - np.nanmin(mv)), float(np.nanmax(op) - np.nanmin(op))
    beside = level - way * 0.06 * max(height, least)
    shapes = [_line(turn, beside, end, beside), _tick(turn, level, beside), _tick(end, level, beside)]
    notes = [_note(0.5 * (turn + end), beside, said[0], yanchor="bottom" if way < 0.0 else "top")]
    if height * 0.04 < J:
        aside = end + way * 0.04 * max(width, least)
        shapes += [_line(aside, level, aside, level + way * J)]
        shapes += [_rung(aside, end, level), _rung(aside, end, level + way * J)]
        anchor = "right" if way < 0.0 else "left"
        notes.append(_note(aside, level + 0.5 * way * J, said[1], xanchor=anchor))
    return shapes, notes


def _longest_stuck(op: NDArray[np.float64], mv: NDArray[np.float64]) -> slice | None:
    """Stretch of constant position with the longest travel of the OP; None when the valve never stands still."""
    stretches = [slice(first, last + 1) for first, last in runs(np.abs(np.diff(mv)) < 1e-9)]
    good = [stretch for stretch in stretches if np.isfinite(op[stretch]).all()]
    return max(good, key=lambda stretch: float(np.ptp(op[stretch])), default=None)


def _line(x0: float, y0: float, x1: float, y1: float, color: str = look.INK) -> dict[str, Any]:
    return {"type": "line", "x0": x0, "y0": y0, "x1": x1, "y1": y1, "line": {"color": color, "width": 1.2}}


def _tick(x: float, y0: float, y1: float) -> dict[str, Any]:
    return _line(x, y0, x, y1 + 0.35 * (y1 - y0), look.MUTED)


def _rung(x0: float, x1: float, y: float) -> dict[str, Any]:
    return _line(x0 - 0.35 * (x1 - x0), y, x1, y, look.MUTED)


def _note(x: float, y: float, text: str, **anchor: str) -> dict[str, Any]:
    return {"x": x, "y": y, "text": text, "showarrow": False, "font": {"size": 13}, "borderpad": 4, **anchor}
