"""The simulation error for each (S, J): how sharp the optimum is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.report import look, words
from stiction.report.blocks import Figure

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identified import ErrorSurface, Identification
    from stiction.report.view import View

__all__ = ["SHADES", "edges", "error_surface"]

SHADES = [[0.0, "#FFFFFF"], [0.08, "#EAF0F4"], [0.35, "#BDD0DD"], [1.0, "#6C8DA5"]]
"""Colours of an error, pale where it is small."""


def error_surface(view: View) -> Figure | None:
    """Return the map of the error over S and J / S, its region and best, and what is told; None without a search."""
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
            "colorscale": SHADES,
            "zmin": float(np.nanmin(error)),
            "zmax": min(float(np.nanmax(error)), 1.0),
            "colorbar": look.colorbar("error [-]"),
            "hovertemplate": f"S %{{x:.3g}} {unit}<br>J / S %{{y:.3g}}<br>error %{{z:.3g}}<extra></extra>",
        }
    ]
    if np.isfinite(surface.limit):
        data.append(
            {
                "type": "contour",
                "x": surface.S,
                "y": surface.J,
                "z": error,
                "contours": {"coloring": "none", "start": surface.limit, "end": surface.limit, "size": 1.0},
                "line": {"color": look.INK, "dash": "dash", "width": 1.6},
                "showscale": False,
                "showlegend": True,
                "hoverinfo": "skip",
                "name": "95 % region",
            }
        )
    data.append(_best(surface))
    if np.isfinite([found.S, found.J]).all() and found.S > 0.0:
        data.append(_told(found))
    S, S_low, S_high = words.interval(found.S, found.S_low, found.S_high)
    J, J_low, J_high = words.interval(found.J, found.J_low, found.J_high)
    layout = {
        "xaxis": {"title": {"text": f"S [{view.op_unit}]"}, "range": edges(surface.S)},
        "yaxis": {"title": {"text": "J / S [-]"}, "range": edges(surface.J)},
        "showlegend": True,
        "margin": {"t": look.BELOW_BUTTONS},
    }
    told = (
        f"told, with 95 % intervals, is S = {S} {unit} ({S_low} to {S_high} {unit}), "
        f"J = {J} {unit} ({J_low} to {J_high} {unit})"
    )
    if found.rough is not None:
        told += ", which predicts the PV best from sample to sample: loads pull a simulation away from it"
    caption = f"Pale is a good fit; a long pale valley means that the data do not tell S and J apart. What is {told}."
    return Figure({"data": data, "layout": layout}, "Simulation error for each S and J", caption, height=400)


def edges(grid: NDArray[np.float64]) -> list[float]:
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
        "marker": {"symbol": "x-thin", "size": 9, "line": {"color": look.INK, "width": 2}},
    }


def _told(found: Identification) -> dict[str, Any]:
    """S and J as told, with their intervals."""
    ends = {"error_x": (found.S, found.S_low, found.S_high), "error_y": (found.J, found.J_low, found.J_high)}
    bars = {
        name: {
            "type": "data",
            "symmetric": False,
            "array": [max(high - value, 0.0) / scale],
            "arrayminus": [max(value - low, 0.0) / scale],
            "color": look.INK,
            "thickness": 1.5,
        }
        for (name, (value, low, high)), scale in zip(ends.items(), (1.0, found.S), strict=True)
        if np.isfinite([low, high]).all()
    }
    return {
        "type": "scatter",
        "mode": "markers",
        "x": [found.S],
        "y": [found.J / found.S],
        "name": "told",
        "marker": {"symbol": "diamond", "size": 10, "color": "#FFFFFF", "line": {"color": look.INK, "width": 2}},
        **bars,
    }
