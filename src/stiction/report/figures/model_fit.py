"""The fitted valve and process over the recorded PV, and what they leave unexplained."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.report import look, words
from stiction.report.blocks import Figure

if TYPE_CHECKING:
    from stiction.report.view import View

__all__ = ["model_fit"]


def model_fit(view: View) -> Figure | None:
    """Return recorded and simulated PV with the residual below; None without a fit or a PV."""
    record, found = view.diagnosis.record, view.diagnosis.identification
    if record.pv is None or found is None:
        return None
    model = view.laid(found.pv)
    left = record.pv - model
    first, last = view.window
    data = [
        view.trace(record.pv, "PV restored" if "PV" in view.seldom else "PV recorded", look.line(look.PV), yaxis="y"),
        view.trace(model, "PV simulated from OP with the fitted valve", look.line(look.MODEL), yaxis="y"),
        view.trace(left, "residual", {"color": look.MUTED, "width": 1}, yaxis="y2", showlegend=False),
    ]
    layout = {
        "xaxis": {
            "title": {"text": view.time_title},
            "anchor": "y2",
            "range": [float(view.time[first]), float(view.time[last - 1])],
        },
        "yaxis": {"domain": [0.36, 1.0], "title": {"text": f"PV<br>[{view.pv_unit}]"}},
        "yaxis2": {"domain": [0.0, 0.28], "title": {"text": "residual"}, "zeroline": True, "zerolinecolor": look.FAINT},
        "hovermode": "x",
    }
    caption = (
        f"Simulated from the OP, the sticky valve and process explain {words.digits(found.fit)} % of the PV's"
        f" variation; the best process with a good valve explains {words.digits(found.fit_linear)} %."
    )
    return Figure({"data": data, "layout": layout}, "Model over data", caption, height=400)
