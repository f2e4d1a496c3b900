"""The likelihood of each (S, J): how well the record determines both."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.report import labels, style
from stiction.report.blocks import Figure

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.result import Identification, LikelihoodSurface
    from stiction.report.loop_view import LoopView

__all__ = ["COLOR_SCALE", "cell_edges", "likelihood_surface"]

COLOR_SCALE = [[0.0, "#FFFFFF"], [0.25, "#EAF0F4"], [0.6, "#BDD0DD"], [1.0, "#6C8DA5"]]
"""Colours of a likelihood ratio, dark where it is large."""


def likelihood_surface(view: LoopView) -> Figure | None:
    """Return the map of the likelihood ratio over S and J / S, with the estimate; None without a search."""
    identification = view.diagnosis.identification
    surface = None if identification is None else identification.surface
    if identification is None or surface is None or min(surface.likelihood_ratio.shape, default=0) < 2:
        return None
    ratio = surface.likelihood_ratio
    if not np.isfinite(ratio).any():
        return None
    high = float(np.nanmax(ratio[np.isfinite(ratio)]))
    low = 0.0 if high > 0.0 else float(np.nanmin(ratio[np.isfinite(ratio)]))
    data: list[dict[str, Any]] = [
        {
            "type": "heatmap",
            "x": surface.S,
            "y": surface.ratio,
            "z": np.where(np.isfinite(ratio), ratio, np.nan).T,
            "colorscale": COLOR_SCALE,
            "zmin": low,
            "zmax": high,
            "colorbar": style.colorbar("likelihood ratio [-]"),
            "hovertemplate": f"S %{{x:.3g}} {view.op_unit_short}<br>J / S %{{y:.3g}}<br>"
            "twice the log likelihood ratio %{z:.3g}<extra></extra>",
        },
        _maximum(surface),
    ]
    across, up = cell_edges(surface.S), cell_edges(surface.ratio)
    caption = (
        "Twice the log likelihood ratio over a good valve in the first, coarse search; white: not better than a good "
        "valve. A long dark band means that the record does not determine S and J well."
    )
    if np.isfinite([identification.S, identification.J]).all() and identification.S > 0.0:
        data += _estimate(identification)
        across = [across[0], max(across[1], min(1.03 * identification.S_high, 1.5 * across[1]))]
        up = [up[0], max(up[1], min(1.03 * identification.J_high / identification.S, 1.5 * up[1]))]
        source = (
            "by the recorded valve position"
            if identification.by_position
            else "by the final search, on all samples, corrected"
        )
        caption += (
            f" The cross is the estimate {source}: {labels.stiction_size(identification, view.diagnosis.record)}."
        )
    if not view.valve_is_accepted:
        caption += " The verdict does not rely on it."
    layout = {
        "xaxis": {"title": {"text": f"S [{view.op_unit}]"}, "range": across},
        "yaxis": {"title": {"text": "J / S [-]"}, "range": up},
        "showlegend": True,
        "margin": {"t": style.BELOW_BUTTONS},
    }
    return Figure({"data": data, "layout": layout}, "Likelihood of each S and J", caption, height=320)


def cell_edges(grid: NDArray[np.float64]) -> list[float]:
    """Return the outer edges of the cells around the points of a grid.

    Examples
    --------
    >>> cell_edges(np.array([0.0, 0.5, 1.0]))
    [-0.25, 1.25]
    """
    return [float(1.5 * grid[0] - 0.5 * grid[1]), float(1.5 * grid[-1] - 0.5 * grid[-2])]


def _maximum(surface: LikelihoodSurface) -> dict[str, Any]:
    """The best point of the map."""
    i, j = np.unravel_index(int(np.nanargmax(surface.likelihood_ratio)), surface.likelihood_ratio.shape)
    return {
        "type": "scatter",
        "mode": "markers",
        "x": [float(surface.S[i])],
        "y": [float(surface.ratio[j])],
        "name": "maximum of the map",
        "marker": {"symbol": "x-thin", "size": 9, "line": {"color": style.TEXT_COLOR, "width": 2}},
    }


def _estimate(identification: Identification) -> list[dict[str, Any]]:
    """S and J with the cross of their intervals; the interval of an undetermined J is dashed."""
    name, ratio = "estimate", identification.J / identification.S
    dash = "dash" if identification.J_undetermined else "solid"
    intervals = {
        "S": ([identification.S_low, identification.S_high], [ratio, ratio], "solid"),
        "J": (
            [identification.S, identification.S],
            [identification.J_low / identification.S, identification.J_high / identification.S],
            dash,
        ),
    }
    cross: list[dict[str, Any]] = [
        style.trace(x, y, f"95 % interval of {what}", {"color": style.TEXT_COLOR, "width": 2.0, "dash": kind})
        | {"showlegend": False, "legendgroup": "estimate"}
        for what, (x, y, kind) in intervals.items()
        if np.isfinite([*x, *y]).all()
    ]
    line = {"color": style.TEXT_COLOR, "width": 2}
    mark = {"symbol": "diamond", "size": 10, "color": "#FFFFFF", "line": line}
    if identification.J_undetermined:
        mark = {"symbol": "line-ns", "size": 12, "color": style.TEXT_COLOR, "line": line}
        name += ", J undetermined"
    point = {"type": "scatter", "mode": "markers", "x": [identification.S], "y": [ratio], "name": name, "marker": mark}
    return [*cross, point | {"legendgroup": "estimate"}]
