"""The simulation error for each (S, J): how sharp the optimum is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.report import look, words
from stiction.report.blocks import Figure

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.report.view import View

__all__ = ["error_surface"]

_SHADES = [[0.0, "#FFFFFF"], [0.08, "#EAF0F4"], [0.35, "#BDD0DD"], [1.0, "#6C8DA5"]]


def error_surface(view: View) -> Figure | None:
    """Return the map of the error over S and J / S with the 95 % region and the optimum; None without a search."""
    found = view.diagnosis.identification
    if found is None or min(found.surface.error.shape, default=0) < 2 or not np.isfinite(found.surface.error).any():
        return None
    surface = found.surface
    error = np.where(np.isfinite(surface.error), surface.error, np.nan).T
    data: list[dict[str, Any]] = [
        {
            "type": "heatmap",
            "x": surface.S,
            "y": surface.J,
            "z": error,
            "colorscale": _SHADES,
            "zmin": float(np.nanmin(error)),
            "zmax": min(float(np.nanmax(error)), 1.0),
            "colorbar": look.colorbar("error [-]"),
            "hovertemplate": "S %{x:.3g} %<br>J / S %{y:.3g}<br>error %{z:.3g}<extra></extra>",
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
    if np.isfinite([found.S, found.J]).all() and found.S > 0.0:
        data.append(_optimum(found.S, found.J, found.S_low, found.S_high))
    S, S_low, S_high = words.interval(found.S, found.S_low, found.S_high)
    J, J_low, J_high = words.interval(found.J, found.J_low, found.J_high)
    layout = {
        "xaxis": {"title": {"text": "S [% of span]"}, "range": _edges(surface.S)},
        "yaxis": {"title": {"text": "J / S [-]"}, "range": _edges(surface.J)},
        "showlegend": True,
    }
    caption = (
        f"Pale is a good fit: best at S = {S} %, J = {J} %"
        f" (S between {S_low} and {S_high} %, J between {J_low} and {J_high} %);"
        " a long pale valley means that the data do not tell S and J apart."
    )
    return Figure({"data": data, "layout": layout}, "Error for each S and J", caption, height=400)


def _edges(grid: NDArray[np.float64]) -> list[float]:
    """Outer edges of the cells about the grid's points."""
    return [float(1.5 * grid[0] - 0.5 * grid[1]), float(1.5 * grid[-1] - 0.5 * grid[-2])]


def _optimum(S: float, J: float, low: float, high: float) -> dict[str, Any]:
    point: dict[str, Any] = {
        "type": "scatter",
        "mode": "markers",
        "x": [S],
        "y": [J / S],
        "name": "optimum, 95 % interval of S",
        "marker": {"symbol": "diamond", "size": 10, "color": "#FFFFFF", "line": {"color": look.INK, "width": 2}},
    }
    if np.isfinite([low, high]).all():
        point["error_x"] = {
            "type": "data",
            "symmetric": False,
            "array": [max(high - S, 0.0)],
            "arrayminus": [max(S - low, 0.0)],
            "color": look.INK,
            "thickness": 1.5,
        }
    return point
