"""Trends: set point and PV above, OP below, on one time axis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.records.gaps import missing_mask
from stiction.records.quality.frozen import find_manual
from stiction.records.quality.saturation import find_saturation
from stiction.records.runs import runs
from stiction.report import labels, style
from stiction.report.blocks import Figure
from stiction.report.downsample import downsample

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.report.loop_view import LoopView

__all__ = ["trends"]

MOST_STRETCHES = 200
MOST_RINGS = 0.5
"""Share of the samples up to which those that were stored are ringed; more would hide the line [-]."""
_HATCH = {"missing": "x", "saturated": "/", "in manual": "\\"}


def trends(view: LoopView) -> Figure:
    """Return SP, PV, OP and, where measured, the valve position over time; doubtful stretches are hatched."""
    record = view.diagnosis.record
    data: list[dict[str, Any]] = []
    if record.sp is not None:
        step = style.line_style(style.SP, 1.2, shape="hv")
        data.append(view.trace(record.sp, "SP (set point)", step, yaxis="y"))
    if record.pv is not None:
        data.append(view.trace(record.pv, "PV (process variable)", style.line_style(style.PV), yaxis="y"))
    data.append(view.trace(record.op, "OP (controller output)", style.line_style(style.OP), yaxis="y2"))
    data += _as_stored(view)
    if record.mv is not None:
        data.append(view.trace(record.mv, "Valve position, measured", style.line_style(style.MV), yaxis="y2"))
    doubtful = {
        "missing": missing_mask(record.op, record.pv),
        "saturated": find_saturation(record.op, record.pv, record.auto),
        "in manual": find_manual(record.op, record.pv, record.auto),
    }
    shown = "PV, SP" if record.sp is not None else "PV"
    upper = record.pv is not None or record.sp is not None
    for name, mask in doubtful.items():
        if mask.any():
            data += _hatched(view, name, mask, ["y4", "y3"] if upper else ["y4"])
    hidden = {"range": [0.0, 1.0], "visible": False, "fixedrange": True}
    layout: dict[str, Any] = {
        "xaxis": {"title": {"text": view.time_title}, "anchor": "y2", "range": [0.0, float(view.time[-1])]},
        "yaxis": {"domain": [0.54, 1.0], "title": {"text": f"{shown}<br>[{view.pv_unit}]"}, "visible": upper},
        "yaxis2": {"domain": [0.0, 0.46 if upper else 1.0], "title": {"text": f"OP<br>[{view.op_unit}]"}},
        "yaxis3": {"overlaying": "y", **hidden},
        "yaxis4": {"overlaying": "y2", **hidden},
        "hovermode": "x",
        "shapes": [] if view.whole else [_analysed(view)],
        "annotations": [] if view.whole or not upper else [_between_panels(view, "analysed")],
    }
    found = [
        f"{labels.format_number(100.0 * mask.mean(), '%', 2)} {name}" for name, mask in doubtful.items() if mask.any()
    ]
    first, last = view.window
    left_out = " and ".join(view.partly_stored)
    caption = (
        f"{labels.count_noun(len(record), 'sample')} over {labels.format_duration(record.duration)}, one every "
        f"{labels.format_duration(record.dt)}; "
        + ("the whole record was analysed" if view.whole else f"samples {first} to {last - 1} (shaded) were analysed")
        + (", the valve simulated over the part that Model over data tells" if view.in_part else "")
        + (f"; hatched: {', '.join(found)}" if found else "")
        + (f"; what was not stored of {left_out} is told by the controller's law" if view.partly_stored else "")
        + ". Drag over a stretch to look closer; both plots follow."
    )
    return Figure({"data": data, "layout": layout}, "Set point, PV and OP over time", caption, height=440)


def _as_stored(view: LoopView) -> list[dict[str, Any]]:
    """Rings where a signal was stored at few samples and its line is told by the controller's law between them."""
    record, stored = view.diagnosis.record, view.diagnosis.stored
    if stored is None:
        return []
    signals = {"PV": (record.pv, stored.pv, style.PV, "y"), "OP": (record.op, stored.op, style.OP, "y2")}
    rings = []
    for name in (name for name, share in view.partly_stored.items() if share <= MOST_RINGS):
        x, mask, color, axis = signals[name]
        assert x is not None
        at = np.flatnonzero(mask)
        at = at[downsample(x[at])]
        rings.append(style.ring_markers(view.time[at], x[at], f"{name} as stored", color) | {"yaxis": axis})
    return rings


def _hatched(view: LoopView, name: str, mask: NDArray[np.bool_], axes: list[str]) -> list[dict[str, Any]]:
    """One trace per panel, on a hidden axis from 0 to 1, so that the hatching fills the panel at any zoom."""
    longest = sorted(runs(mask), key=lambda run: run[0] - run[1])[:MOST_STRETCHES]
    half = 0.5 * view.diagnosis.record.dt / view.unit[1]
    x: list[float] = []
    for first, last in longest:
        left, right = float(view.time[first]) - half, float(view.time[last - 1]) + half
        x += [left, left, right, right, left, np.nan]
    trace: dict[str, Any] = {
        "type": "scatter",
        "mode": "lines",
        "x": np.array(x),
        "y": np.array([0.0, 1.0, 1.0, 0.0, 0.0, np.nan] * len(longest)),
        "fill": "toself",
        "fillcolor": "rgba(90,98,112,0.06)",
        "fillpattern": {"shape": _HATCH[name], "fgcolor": "rgba(90,98,112,0.45)", "size": 7, "solidity": 0.12},
        "line": {"width": 0},
        "name": name,
        "hoverinfo": "skip",
        "legendgroup": name,
    }
    return [{**trace, "yaxis": axis, "showlegend": axis == axes[0]} for axis in axes]


def _analysed(view: LoopView) -> dict[str, Any]:
    first, last = view.window
    return {
        "type": "rect",
        "x0": float(view.time[first]),
        "x1": float(view.time[last - 1]),
        "y0": 0,
        "y1": 1,
        "yref": "paper",
        "layer": "below",
        "line": {"width": 1, "color": style.BORDER_COLOR},
        "fillcolor": "#F0F4F7",
    }


def _between_panels(view: LoopView, text: str) -> dict[str, Any]:
    place = {"x": float(view.time[view.window[0]]), "y": 0.5, "yref": "paper", "xanchor": "left", "yanchor": "middle"}
    return {**place, "text": text, "showarrow": False, "font": {"size": 11, "color": style.SECONDARY_COLOR}}
