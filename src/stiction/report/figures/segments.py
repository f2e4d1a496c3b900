"""S in parts of the record: drift of S, and stiction that comes and goes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.report import labels, style
from stiction.report.blocks import Figure
from stiction.report.identification_text import describe_drift

if TYPE_CHECKING:
    from stiction.report.loop_view import LoopView

__all__ = ["segments"]


def segments(view: LoopView) -> Figure | None:
    """Return S over time, a bar for each part of the record; None with fewer than two parts."""
    parts, sticky, identification = view.segments, view.sticky_segments, view.diagnosis.identification
    if identification is None or len(parts) < 2:
        return None
    step, unit = view.diagnosis.record.dt / view.unit[1], view.op_unit_short
    groups = (
        ("sticky valve more likely", sticky, {"color": style.OP}),
        (
            "not clearly more likely",
            [part for part in parts if part not in sticky],
            {"color": "#FFFFFF", "pattern": {"shape": "/", "fgcolor": style.SECONDARY_COLOR, "size": 6}},
        ),
    )
    data: list[dict[str, Any]] = [
        {
            "type": "bar",
            "x": np.array([0.5 * (first + last) * step for first, last, _ in some]),
            "y": np.array([part.S for *_, part in some]),
            "width": np.array([(last - first) * step for first, last, _ in some]),
            "name": name,
            "marker": {**marker, "line": {"color": style.TEXT_COLOR, "width": 1}},
            "hovertext": [
                f"S {labels.format_number(part.S, unit)}, twice the log likelihood ratio over a good valve "
                f"{labels.format_number(part.likelihood_ratio)}"
                for *_, part in some
            ],
            "hoverinfo": "text",
        }
        for name, some, marker in groups
        if some
    ]
    layout = {
        "xaxis": {"title": {"text": view.time_title}, "range": [0.0, float(view.time[-1])]},
        "yaxis": {"title": {"text": f"S<br>[{view.op_unit}]"}, "rangemode": "tozero"},
        "barmode": "overlay",
        "showlegend": True,
    }
    caption = (
        f"In {len(sticky)} of {len(parts)} parts of the record the sticky valve is clearly more likely than a good "
        f"one. {describe_drift(identification, unit)}"
    )
    return Figure({"data": data, "layout": layout}, "S in each part of the record", caption.strip(), height=190)
