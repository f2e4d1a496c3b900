"""The simulation error for each S and dead time: how far one stands for the other."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.report import look, words
from stiction.report.blocks import Figure
from stiction.report.figures.error_surface import SHADES, edges

if TYPE_CHECKING:
    from stiction.report.view import View

__all__ = ["dead_time"]


def dead_time(view: View) -> Figure | None:
    """Return the map of the error over S and dead time, and the best dead time for each S; None without a search."""
    found = view.diagnosis.identification
    if found is None or min(found.surface.error_late.shape, default=0) < 2:
        return None
    surface, of_op = found.surface, view.op_unit_short
    unit, seconds = words.time_unit(float(surface.dead_time[-1]))
    error, late = surface.error_late.T, surface.dead_time / seconds
    data: list[dict[str, Any]] = [
        {
            "type": "heatmap",
            "x": surface.S,
            "y": late,
            "z": error,
            "colorscale": SHADES,
            "zmin": float(error.min()),
            "zmax": min(float(error.max()), 1.0),
            "colorbar": look.colorbar("error [-]"),
            "hovertemplate": f"S %{{x:.3g}} {of_op}<br>dead time %{{y:.3g}}<br>error %{{z:.3g}}<extra></extra>",
        },
        {
            "type": "scatter",
            "mode": "lines+markers",
            "x": surface.S,
            "y": late[np.argmin(error, axis=0)],
            "name": "best dead time for each S",
            "line": {"color": look.INK, "dash": "dash", "width": 1.6},
            "marker": {"size": 4, "color": look.INK},
        },
    ]
    layout = {
        "xaxis": {"title": {"text": f"S [{view.op_unit}]"}, "range": edges(surface.S)},
        "yaxis": {"title": {"text": f"Dead time [{unit}]"}, "range": edges(late)},
        "showlegend": True,
        "margin": {"t": look.BELOW_BUTTONS},
    }
    caption = (
        "A band makes the stem late, and so does dead time: along a pale valley a larger S with a shorter dead time"
        " explains a cycle that repeats as well. Another operating point or a test of the valve tells them apart."
    )
    if not view.believed:
        caption += " None of these sticky valves was believed."
    return Figure({"data": data, "layout": layout}, "S against the dead time", caption, height=400)
