"""PV against OP, recorded and simulated; the colour shows the time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.report import style
from stiction.report.blocks import Figure
from stiction.report.last_periods import last_periods

if TYPE_CHECKING:
    from stiction.report.loop_view import LoopView

__all__ = ["TIME_COLOR_SCALE", "pv_op"]

TIME_COLOR_SCALE = [[0.0, "#D3E2EC"], [1.0, style.PV]]
"""Colours of early and late samples."""


def pv_op(view: LoopView) -> Figure | None:
    """Return the PV-OP plot of the last few periods; None without a PV."""
    record, identification, plotted = view.diagnosis.record, view.diagnosis.identification, last_periods(view)
    cut = plotted.cut
    if record.pv is None:
        return None
    data: list[dict[str, Any]] = [
        {
            "type": "scatter",
            "mode": "lines+markers",
            "x": record.op[cut],
            "y": record.pv[cut],
            "name": "recorded",
            "line": {"color": "#C4D3DE", "width": 1},
            "marker": {
                "color": view.time[cut],
                "colorscale": TIME_COLOR_SCALE,
                "size": 5,
                "colorbar": style.colorbar(f"Time [{view.unit[0]}]"),
            },
        }
    ]
    caption = f"{plotted.text}; early samples are pale, late ones dark"
    if identification is not None:
        data.append(style.trace(record.op[cut], view.model[cut], view.model_name, style.line_style(style.MODEL, 1.3)))
        caption += f"; the dash-dotted line is the PV simulated with the {view.model_name} from the same OP"
        if np.isnan(view.model[cut]).any():
            caption += ", where it was simulated"
    layout = {
        "margin": {"t": style.BELOW_BUTTONS},
        "xaxis": {"title": {"text": f"OP (controller output) [{view.op_unit}]"}},
        "yaxis": {"title": {"text": f"PV [{view.pv_unit}]"}},
    }
    return Figure({"data": data, "layout": layout}, "PV against OP", f"{caption}.", height=400)
