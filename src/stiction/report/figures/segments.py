"""Where the valve sticks: S of each window of the record as a strip below the trends."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.report import labels, style
from stiction.report.blocks import Figure

if TYPE_CHECKING:
    from stiction.report.loop_view import LoopView

__all__ = ["windows"]

_LOOKS = {
    "stiction": ("sticks", {"color": style.ALERT}),
    "no_stiction": (
        "follows",
        {"color": style.BORDER_COLOR, "pattern": {"shape": ".", "fgcolor": style.SECONDARY_COLOR, "size": 6}},
    ),
    "undecided": (
        "cannot tell",
        {"color": "#FFFFFF", "pattern": {"shape": "/", "fgcolor": style.SECONDARY_COLOR, "size": 6}},
    ),
}
"""Verdict -> what it is called, and the fill of its bars: a pattern with each colour."""


def windows(view: LoopView) -> Figure | None:
    """Return S over time, a bar for each window; None where the record was judged as one."""
    found = view.diagnosis.windows
    if not found:
        return None
    step = view.diagnosis.record.dt / view.unit[1]
    data: list[dict[str, Any]] = []
    for verdict, (name, marker) in _LOOKS.items():
        own = [window for window in found if window.verdict == verdict]
        if not own:
            continue
        bar: dict[str, Any] = {
            "type": "bar",
            "x": np.array([0.5 * (window.first + window.last) * step for window in own]),
            "y": np.array([window.S for window in own]),
            "width": np.array([(window.last - window.first) * step for window in own]),
            "name": name,
            "marker": {**marker, "line": {"color": style.TEXT_COLOR, "width": 1}},
            "hovertext": [
                f"{name}: S {labels.format_number(window.S, view.op_unit_short)}, explained "
                f"{labels.format_number(window.fit, '%', 2)}"
                f", by a good valve {labels.format_number(window.fit_linear, '%', 2)}"
                for window in own
            ],
            "hoverinfo": "text",
        }
        data.append(bar)
    sticky = sum(window.verdict == "stiction" for window in found)
    layout = {
        "xaxis": {"title": {"text": view.time_title}, "range": [0.0, float(view.time[-1])]},
        "yaxis": {"title": {"text": f"S<br>[{view.op_unit}]"}, "rangemode": "tozero"},
        "barmode": "overlay",
        "showlegend": True,
    }
    caption = f"The valve sticks in {sticky} of {labels.count_noun(len(found), 'window')} judged each by itself" + (
        "." if sticky == len(found) else "; in the others S is what fits best and means little."
    )
    return Figure({"data": data, "layout": layout}, "Where the valve sticks", caption, height=190)
