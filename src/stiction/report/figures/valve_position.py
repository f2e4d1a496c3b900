"""Valve position against OP, with S and J drawn as dimensions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.report import look, words
from stiction.report.blocks import Figure

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.report.view import View

__all__ = ["valve_position"]


def valve_position(view: View) -> Figure | None:
    """Return valve position against OP over the last few periods; None when it is neither measured nor estimated."""
    record, found, cut = view.diagnosis.record, view.diagnosis.identification, view.cycles
    op = record.op[cut]
    data: list[dict[str, Any]] = []
    shapes: list[dict[str, Any]] = []
    notes: list[dict[str, Any]] = []
    if record.mv is not None:
        data.append(_path(op, record.mv[cut], "measured", look.line(look.MV, 2.0)))
    if found is not None:
        estimated = view.laid(found.mv)[cut]
        data.append(_path(op, estimated, "estimated", look.line(look.MODEL if record.mv is not None else look.MV, 1.5)))
        shapes, notes = _dimensions(op, estimated, found.S, found.J)
    if not data:
        return None
    layout = {
        "xaxis": {"title": {"text": "OP (controller output) [% of span]"}},
        "yaxis": {"title": {"text": "Valve position [% of span]"}},
        "shapes": shapes,
        "annotations": notes,
        "showlegend": True,
    }
    how = {(True, False): "measured", (False, True): "estimated", (True, True): "measured and estimated"}
    kind = how[record.mv is not None, found is not None]
    caption = f"Valve position ({kind}) against OP"
    if found is not None:
        caption += f": after a reversal the OP travels S = {words.digits(found.S)} % before the valve moves" + (
            f", then the valve jumps J = {words.digits(found.J)} %" if found.J > 0.0 else "; no jump was found"
        )
        if record.mv is None:
            caption += "; the position was estimated from OP and PV, it was not measured"
    return Figure({"data": data, "layout": layout}, f"Valve position against OP, {kind}", caption + ".", height=400)


def _path(op: NDArray[np.float64], mv: NDArray[np.float64], name: str, line: dict[str, Any]) -> dict[str, Any]:
    return {"type": "scatter", "mode": "lines", "x": op, "y": mv, "name": name, "line": line}


def _dimensions(
    op: NDArray[np.float64], mv: NDArray[np.float64], S: float, J: float
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """S along the upper stuck stretch, from where the OP turns back to where the valve jumps; J down from there."""
    good = np.isfinite(op) & np.isfinite(mv)
    if not good.any() or not np.isfinite([S, J]).all() or S <= 0.0:
        return [], []
    top = float(mv[good].max())
    turn = float(op[good & (mv >= top - 1e-9)].max())
    lift = top + 0.06 * max(float(np.ptp(mv[good])), 0.1)
    shapes = [_line(turn - S, lift, turn, lift), _tick(turn - S, top, lift), _tick(turn, top, lift)]
    notes = [_note(turn - 0.5 * S, lift, f"S = {words.digits(S)} %", yanchor="bottom")]
    if J > 0.0:
        aside = turn - S - 0.04 * max(float(np.ptp(op[good])), 0.1)
        shapes += [_line(aside, top, aside, top - J), _rung(aside, turn - S, top), _rung(aside, turn - S, top - J)]
        notes.append(_note(aside, top - 0.5 * J, f"J = {words.digits(J)} %", xanchor="right"))
    return shapes, notes


def _line(x0: float, y0: float, x1: float, y1: float, color: str = look.INK) -> dict[str, Any]:
    return {"type": "line", "x0": x0, "y0": y0, "x1": x1, "y1": y1, "line": {"color": color, "width": 1.2}}


def _tick(x: float, y0: float, y1: float) -> dict[str, Any]:
    return _line(x, y0, x, y1 + 0.35 * (y1 - y0), look.MUTED)


def _rung(x0: float, x1: float, y: float) -> dict[str, Any]:
    return _line(x0 - 0.35 * (x1 - x0), y, x1, y, look.MUTED)


def _note(x: float, y: float, text: str, **anchor: str) -> dict[str, Any]:
    return {"x": x, "y": y, "text": text, "showarrow": False, "font": {"size": 13}, "borderpad": 4, **anchor}
