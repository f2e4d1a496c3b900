"""The simulation error for each (S, J): how sharp the optimum is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.diagnosis.verdict.stem import BY_POSITION
from stiction.report import labels, style
from stiction.report.blocks import Figure

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identified import ErrorSurface, Identification
    from stiction.report.loop_view import LoopView

__all__ = ["COLOR_SCALE", "edges", "error_surface"]

COLOR_SCALE = [[0.0, "#FFFFFF"], [0.08, "#EAF0F4"], [0.35, "#BDD0DD"], [1.0, "#6C8DA5"]]
"""Colours of an error, pale where it is small."""


def error_surface(view: LoopView) -> Figure | None:
    """Return the map of the error over S and J / S, its least, and what is told; None without a search."""
    found = view.diagnosis.identification
    if found is None or min(found.surface.error.shape, default=0) < 2 or not np.isfinite(found.surface.error).any():
        return None
    surface, unit = found.surface, view.op_unit_short
    error = np.where(np.isfinite(surface.error), surface.error, np.nan).T
    data: list[dict[str, Any]] = [
        {
            "type": "heatmap",
            "x": surface.S,
            "y": surface.J,
            "z": error,
            "colorscale": COLOR_SCALE,
            "zmin": float(np.nanmin(error)),
            "zmax": min(float(np.nanmax(error)), 1.0),
            "colorbar": style.colorbar("error [-]"),
            "hovertemplate": f"S %{{x:.3g}} {unit}<br>J / S %{{y:.3g}}<br>error %{{z:.3g}}<extra></extra>",
        },
        _best(surface),
    ]
    across, up = cell_edges(surface.S), cell_edges(surface.J)
    caption = "Pale is a small error of the simulation; a long pale valley means that it does not tell S and J apart."
    if np.isfinite([found.S, found.J]).all() and found.S > 0.0:
        data += _told(found, view.valve_is_accepted)
        across, up = _with_room(across, found.S_high), _with_room(up, found.J_high / found.S)
        caption += f" {_said(found, view)}"
    layout = {
        "xaxis": {"title": {"text": f"S [{view.op_unit}]"}, "range": across},
        "yaxis": {"title": {"text": "J / S [-]"}, "range": up},
        "showlegend": True,
        "margin": {"t": style.BELOW_BUTTONS},
    }
    title = "Simulation error for each S and J" + ("" if view.valve_is_accepted else ", none believed")
    return Figure({"data": data, "layout": layout}, title, caption, height=400)


def _said(found: Identification, view: LoopView) -> str:
    """Which S and J the cross marks, and where they come from."""
    size = labels.stiction_size(found, view.diagnosis.record)
    if not view.valve_is_accepted:
        return f"The cross is the likeliest sticky valve, {size}; it was not believed."
    told = f"The cross is what is told: {size}."
    if found.rough is None:
        return f"{told} Both come from this search, the intervals from how far its error rises about them."
    if found.reason == BY_POSITION:
        return f"{told} Both come from the recorded valve position, not from this map."
    return (
        f"{told} Both come from the likelihood of the PV, predicted from sample to sample and compared cycle by cycle,"
        " not from this map: what a simulation misses adds up in it, so its least error may lie elsewhere."
    )


def cell_edges(grid: NDArray[np.float64]) -> list[float]:
    """Outer edges of the cells about the grid's points."""
    return [float(1.5 * grid[0] - 0.5 * grid[1]), float(1.5 * grid[-1] - 0.5 * grid[-2])]


def _best(surface: ErrorSurface) -> dict[str, Any]:
    """The best of the map."""
    i, j = np.unravel_index(int(np.nanargmin(surface.error)), surface.error.shape)
    return {
        "type": "scatter",
        "mode": "markers",
        "x": [float(surface.S[i])],
        "y": [float(surface.J[j])],
        "name": "least error",
        "marker": {"symbol": "x-thin", "size": 9, "line": {"color": style.TEXT_COLOR, "width": 2}},
    }


def _told(found: Identification, believed: bool) -> list[dict[str, Any]]:
    """S and J as told: a cross of their intervals, that of an open J dashed and without a mark of its own."""
    name, ratio = "told" if believed else "likeliest sticky valve", found.J / found.S
    bars = {
        "S": ([found.S_low, found.S_high], [ratio, ratio], "solid"),
        "J": ([found.S, found.S], [found.J_low / found.S, found.J_high / found.S], "dash" if found.J_open else "solid"),
    }
    cross: list[dict[str, Any]] = [
        style.trace(x, y, f"95 % interval of {what}", {"color": style.TEXT_COLOR, "width": 2.0, "dash": dash})
        | {"showlegend": False, "legendgroup": "told"}
        for what, (x, y, dash) in bars.items()
        if np.isfinite([*x, *y]).all()
    ]
    mark = {"symbol": "diamond", "size": 10, "color": "#FFFFFF", "line": {"color": style.TEXT_COLOR, "width": 2}}
    if found.J_open:
        mark = {
            "symbol": "line-ns",
            "size": 12,
            "color": style.TEXT_COLOR,
            "line": {"color": style.TEXT_COLOR, "width": 2},
        }
        name += ", J open"
    point = {"type": "scatter", "mode": "markers", "x": [found.S], "y": [ratio], "name": name, "marker": mark}
    return [*cross, point | {"legendgroup": "told"}]


def _with_room(ends: list[float], high: float) -> list[float]:
    """Ends of an axis with room for an interval that goes on beyond the map, up to half as far again."""
    if not high > ends[1]:
        return ends
    return [ends[0], min(1.03 * high, 1.5 * ends[1])]
