"""The twin over the record, to compare their oscillations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.report import labels, style
from stiction.report.blocks import Figure

if TYPE_CHECKING:
    from stiction.compensation import Twin

__all__ = ["twin_overlay"]


def twin_overlay(twin: Twin, pv_unit: str) -> Figure | None:
    """Return three periods of record and twin, PV above and OP below; None where there is nothing to compare."""
    if not twin.overlay:
        return None
    overlay = twin.overlay
    name, unit = labels.time_unit(float(overlay["time"][-1]))
    data = []
    for signal, color, axis in (("pv", style.PV, "y"), ("op", style.OP, "y2")):
        for key, whose, drawn in (
            (signal, "record", style.line_style(color)),
            (f"{signal}_twin", "twin", style.line_style(style.MODEL)),
        ):
            data.append({
                "type": "scatter", "mode": "lines", "x": overlay["time"] / unit, "y": overlay[key], "line": drawn,
                "name": "twin" if whose == "twin" else f"{signal.upper()}, record", "yaxis": axis,
                "showlegend": whose == "record" or signal == "pv",
            })  # fmt: skip
    layout = {
        "xaxis": {"title": {"text": f"Time [{name}]"}, "anchor": "y2"},
        "yaxis": {"domain": [0.54, 1.0], "title": {"text": f"PV<br>[{pv_unit}]"}},
        "yaxis2": {"domain": [0.0, 0.46], "title": {"text": "OP<br>[% of span]"}},
        "hovermode": "x",
    }
    a, b = twin.measured, twin.simulated
    periods, pv, op = (
        " and ".join(texts)
        for texts in (
            (labels.format_duration(a.period), labels.format_duration(b.period)),
            (labels.format_number(a.amplitude_pv), labels.format_number(b.amplitude_pv)),
            (labels.format_number(a.amplitude_op, "%"), labels.format_number(b.amplitude_op, "%")),
        )
    )
    caption = (
        "Three periods of the record and of the twin, which is simulated without the record, shifted in phase. "
        f"Period {periods}, PV amplitude {pv}, OP amplitude {op}."
    )
    return Figure({"data": data, "layout": layout}, "The twin over the record", caption, height=380)
