"""Trends: set point and PV above, OP below, on one time axis; stretches that were left out are hatched."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.records.gaps import missing_mask
from stiction.records.runs import runs
from stiction.report import labels, style
from stiction.report.blocks import Figure
from stiction.report.visible_reasons import find_rests

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.report.loop_view import LoopView

__all__ = ["trends"]

MAX_STRETCHES = 200
"""Largest number of hatched stretches of one kind that are drawn [-]."""
RESTING = "valve at rest while OP moves"
"""Stretches that are shaded, not hatched: a reason of the verdict that can be seen."""
HATCHES = {"missing": "x", "saturated": "/", "manual": "\\"}
"""Kind of a stretch -> its hatching; other kinds are crossed."""


def trends(view: LoopView) -> Figure:
    """Return SP, PV, OP and, where measured, the valve position over time."""
    record = view.diagnosis.record
    data: list[dict[str, Any]] = []
    if record.sp is not None:
        step = style.line_style(style.SP, 1.2, shape="hv")
        data.append(view.trace(record.sp, "SP (set point)", step, yaxis="y"))
    if record.pv is not None:
        data.append(view.trace(record.pv, "PV (process variable)", style.line_style(style.PV), yaxis="y"))
    data.append(view.trace(record.op, "OP (controller output)", style.line_style(style.OP), yaxis="y2"))
    if record.mv is not None:
        data.append(view.trace(record.mv, "Valve position, measured", style.line_style(style.MV), yaxis="y2"))
    upper = record.pv is not None or record.sp is not None
    masks = _marked(view)
    for name, mask in masks.items():
        data += _hatched(view, name, mask, ["y4", "y3"] if upper else ["y4"])
    rests = find_rests(view)
    if rests:
        resting = np.zeros(len(record), dtype=np.bool_)
        for first, last in rests:
            resting[first:last] = True
        data += _hatched(view, RESTING, resting, ["y4"])
    hidden = {"range": [0.0, 1.0], "visible": False, "fixedrange": True}
    signals = "PV, SP" if record.sp is not None else "PV"
    whole = view.is_analysed_whole
    layout: dict[str, Any] = {
        "xaxis": {"title": {"text": view.time_title}, "anchor": "y2", "range": [0.0, float(view.time[-1])]},
        "yaxis": {"domain": [0.54, 1.0], "title": {"text": f"{signals}<br>[{view.pv_unit}]"}, "visible": upper},
        "yaxis2": {"domain": [0.0, 0.46 if upper else 1.0], "title": {"text": f"OP<br>[{view.op_unit}]"}},
        "yaxis3": {"overlaying": "y", **hidden},
        "yaxis4": {"overlaying": "y2", **hidden},
        "hovermode": "x",
        "shapes": [] if whole else [_analysed_part(view)],
        "annotations": [] if whole or not upper else [_between_panels(view, "analysed")],
    }
    return Figure(
        {"data": data, "layout": layout},
        "Set point, PV and OP over time",
        _caption(view, masks, len(rests)),
        height=440,
    )


def _marked(view: LoopView) -> dict[str, NDArray[np.bool_]]:
    """Samples that are missing, and those of each loop state other than in control."""
    record = view.diagnosis.record
    masks = {"missing": missing_mask(record.op, record.pv)}
    for one in view.diagnosis.loop_state.stretches:
        name = one.state.replace("_", " ").replace("pv", "PV")
        masks.setdefault(name, np.zeros(len(record), dtype=np.bool_))[one.first : one.last] = True
    return {name: mask for name, mask in masks.items() if mask.any()}


def _caption(view: LoopView, masks: dict[str, NDArray[np.bool_]], rests: int) -> str:
    record, (first, last) = view.diagnosis.record, view.analysed
    sentences = [
        f"{labels.count_noun(len(record), 'sample')} over {labels.format_duration(record.duration)}, one every "
        f"{labels.format_duration(record.dt)}.",
    ]
    if not view.diagnosis.loop_state.in_control:
        sentences.append("The valve was not diagnosed.")
    elif view.is_analysed_whole:
        sentences.append("The whole record was analysed.")
    else:
        sentences.append(f"Samples {first} to {last - 1} (shaded) were analysed.")
    if masks:
        shares = (f"{labels.format_number(100.0 * mask.mean(), '%', 2)} {name}" for name, mask in masks.items())
        sentences.append(f"Hatched: {', '.join(shares)}.")
    if rests:
        times = labels.count_noun(rests, "time")
        sentences.append(f"Shaded with OP: the estimated valve rests while OP moves by half of S or more, {times}.")
    return " ".join([*sentences, "Drag over a stretch to zoom in both plots."])


def _hatched(view: LoopView, name: str, mask: NDArray[np.bool_], axes: list[str]) -> list[dict[str, Any]]:
    """One trace per panel, on a hidden axis from 0 to 1, so that the hatching fills the panel at any zoom."""
    longest = sorted(runs(mask), key=lambda run: run[0] - run[1])[:MAX_STRETCHES]
    half = 0.5 * view.diagnosis.record.dt / view.unit[1]
    x: list[float] = []
    for first, last in longest:
        left, right = float(view.time[first]) - half, float(view.time[last - 1]) + half
        x += [left, left, right, right, left, np.nan]
    pattern = {"shape": HATCHES.get(name, "+"), "fgcolor": "rgba(90,98,112,0.45)", "size": 7, "solidity": 0.12}
    trace: dict[str, Any] = {
        "type": "scatter",
        "mode": "lines",
        "x": np.array(x),
        "y": np.array([0.0, 1.0, 1.0, 0.0, 0.0, np.nan] * len(longest)),
        "fill": "toself",
        **(
            {"fillcolor": "rgba(193,83,27,0.22)"}
            if name == RESTING
            else {"fillcolor": "rgba(90,98,112,0.06)", "fillpattern": pattern}
        ),
        "line": {"width": 0},
        "name": name,
        "hoverinfo": "skip",
        "legendgroup": name,
    }
    return [{**trace, "yaxis": axis, "showlegend": axis == axes[0]} for axis in axes]


def _analysed_part(view: LoopView) -> dict[str, Any]:
    first, last = view.analysed
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
    place = {"x": float(view.time[view.analysed[0]]), "y": 0.5, "yref": "paper", "xanchor": "left", "yanchor": "middle"}
    return {**place, "text": text, "showarrow": False, "font": {"size": 11, "color": style.SECONDARY_COLOR}}
