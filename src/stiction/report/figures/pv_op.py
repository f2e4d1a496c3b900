"""PV against OP, the order in time by a fading colour, with what was fitted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.report import look
from stiction.report.blocks import Figure
from stiction.report.last_periods import last_periods

if TYPE_CHECKING:
    from stiction.report.view import View

__all__ = ["FADE", "pv_op"]

FADE = [[0.0, "#D3E2EC"], [1.0, look.PV]]


def pv_op(view: View) -> Figure | None:
    """Return the PV-OP plot of the last few periods; None without a PV."""
    record, found, shown = view.diagnosis.record, view.diagnosis.identification, last_periods(view)
    cut = shown.cut
    if record.pv is None:
        return None
    data: list[dict[str, Any]] = [
        {
            "type": "scatter",
            "mode": "lines+markers",
            "x": record.op[cut],
            "y": record.pv[cut],
            "name": "recorded, restored between" if view.partly_stored else "recorded",
            "line": {"color": "#C4D3DE", "width": 1},
            "marker": {
                "color": view.time[cut],
                "colorscale": FADE,
                "size": 5,
                "colorbar": look.colorbar(f"Time [{view.unit[0]}]"),
            },
        }
    ]
    caption = f"{shown.said}, early samples pale and late ones dark"
    if found is not None:
        data.append(look.trace(record.op[cut], view.model[cut], view.model_name, look.line(look.MODEL, 1.3)))
        caption += f"; the dash-dotted line is what the {view.model_name} and its process make of the same OP"
        if np.isnan(view.model[cut]).any():
            caption += ", as far as it was simulated"
    layout = {
        "margin": {"t": look.BELOW_BUTTONS},
        "xaxis": {"title": {"text": f"OP (controller output) [{view.op_unit}]"}},
        "yaxis": {"title": {"text": f"PV [{view.pv_unit}]"}},
    }
    return Figure({"data": data, "layout": layout}, "PV against OP", f"{caption}.", height=400)
