"""The simulated PV over the recorded PV, and the residual."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.report import labels, style
from stiction.report.blocks import Figure

if TYPE_CHECKING:
    from stiction.report.loop_view import LoopView

__all__ = ["model_fit"]


def model_fit(view: LoopView) -> Figure | None:
    """Return recorded and simulated PV with the residual below; None without an identification or a PV."""
    record, identification = view.diagnosis.record, view.diagnosis.identification
    if record.pv is None or identification is None:
        return None
    first, last = view.analysed
    residual = record.pv - view.model
    simulated = f"PV simulated from OP with the {view.model_name}"
    data = [
        view.trace(record.pv, "PV recorded", style.line_style(style.PV), yaxis="y"),
        view.trace(view.model, simulated, style.line_style(style.MODEL), yaxis="y"),
        view.trace(residual, "residual", {"color": style.SECONDARY_COLOR, "width": 1}, yaxis="y2", showlegend=False),
    ]
    zero = {"zeroline": True, "zerolinecolor": style.BORDER_COLOR}
    layout = {
        "xaxis": {
            "title": {"text": view.time_title},
            "anchor": "y2",
            "range": [float(view.time[first]), float(view.time[last - 1])],
        },
        "yaxis": {"domain": [0.36, 1.0], "title": {"text": f"PV<br>[{view.pv_unit}]"}},
        "yaxis2": {"domain": [0.0, 0.28], "title": {"text": "residual"}, **zero},
        "hovermode": "x",
    }
    sticky, good = labels.format_number(identification.fit), labels.format_number(identification.fit_linear)
    caption = (
        f"Simulated from OP, the sticky valve and its process explain {sticky} % of the variation of the PV about its "
        f"moving average, a good valve and its process {good} %. The {view.model_name} is drawn."
    )
    if view.diagnosis.oscillation.oscillating:
        caption += " Half a period at both ends is not compared."
    return Figure({"data": data, "layout": layout}, "Simulated and recorded PV", caption, height=400)
