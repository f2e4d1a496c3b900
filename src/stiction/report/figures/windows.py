"""Windows of a loop over time: probability of stiction by each window alone, and S with its interval."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.diagnosis.loop_state import HEADLINES
from stiction.diagnosis.verdict.over_time import describe_change, describe_disagreement, describe_windows
from stiction.report import labels, style
from stiction.report.blocks import Cell, Figure, Table

if TYPE_CHECKING:
    from stiction.diagnosis.verdict.diagnosis import Diagnosis
    from stiction.diagnosis.verdict.history import Window

__all__ = ["windows"]

MOST_ROWS = 200
"""Windows in the table, the last ones [-]."""


def windows(diagnosis: Diagnosis) -> Figure | None:
    """Return probability and S of each window over time; None where there is one window."""
    parts = diagnosis.windows
    if len(parts) < 2:
        return None
    name, size = labels.time_unit(parts[-1].end_s)
    judged = [one for one in parts if one.in_control]
    left = [one for one in parts if not one.in_control]
    hatched = {"color": "#FFFFFF", "pattern": {"shape": "/", "fgcolor": style.SECONDARY_COLOR, "size": 6}}
    data = [
        _bars([one for one in judged if one.probability >= 0.5], "more likely sticky", {"color": style.OP}, size),
        _bars([one for one in judged if one.probability < 0.5], "more likely good", {"color": style.PV}, size),
        _bars(left, "not judged", hatched, size, height=1.0),
        _sizes(judged, size),
    ]
    start = parts[0].start
    title = f"Time{f' since {labels.format_time(start)}' if start else ''} [{name}]"
    layout: dict[str, Any] = {
        "xaxis": {"title": {"text": title}, "anchor": "y2"},
        "yaxis": {"domain": [0.54, 1.0], "title": {"text": "Probability<br>[-]"}, "range": [0.0, 1.0]},
        "yaxis2": {
            "domain": [0.0, 0.46], "title": {"text": f"S<br>[{diagnosis.record.op_unit}]"}, "rangemode": "tozero",
        },
        "barmode": "overlay", "showlegend": True,
        "shapes": [
            {"type": "line", "x0": one.time_s / size, "x1": one.time_s / size, "yref": "paper", "y0": 0.0, "y1": 1.0,
             "line": {"color": style.TEXT_COLOR, "width": 1, "dash": "dash"}}
            for one in diagnosis.history
        ],
    }  # fmt: skip
    unit = diagnosis.record.op_unit_short
    history = diagnosis.history
    sentences = [describe_windows(parts), *(describe_change(one, unit) for one in history)]
    sentences += [
        describe_disagreement(parts, history, unit),
        "S and its 95 % interval are those of each window alone.",
    ]
    caption = " ".join(filter(None, sentences))
    shown = [trace for trace in data if len(trace["x"])]
    return Figure(
        {"data": shown, "layout": layout}, "The valve over time", caption, height=340, table=_table(diagnosis)
    )


def _bars(
    parts: list[Window], name: str, marker: dict[str, Any], size: float, height: float | None = None
) -> dict[str, Any]:
    """Bars as wide as their windows and as high as the probability."""
    return {
        "type": "bar", "name": name, "yaxis": "y",
        "x": np.array([0.5 * (one.start_s + one.end_s) / size for one in parts]),
        "y": np.array([one.probability if height is None else height for one in parts]),
        "width": np.array([one.duration / size for one in parts]),
        "marker": {**marker, "line": {"color": style.TEXT_COLOR, "width": 1}},
        "hovertext": [
            f"{HEADLINES[one.state]}, probability {labels.format_probability(one.probability)}" for one in parts
        ],
        "hoverinfo": "text",
    }  # fmt: skip


def _sizes(parts: list[Window], size: float) -> dict[str, Any]:
    """S of each window with its interval."""
    S, low, high = (np.array([getattr(one, name) for one in parts], dtype=float) for name in ("S", "S_low", "S_high"))
    return {
        "type": "scatter", "mode": "markers", "name": "S", "yaxis": "y2",
        "x": np.array([0.5 * (one.start_s + one.end_s) / size for one in parts]), "y": S,
        "error_y": {"type": "data", "symmetric": False, "array": high - S, "arrayminus": S - low, "thickness": 1},
        "marker": {"color": style.TEXT_COLOR, "size": 6},
    }  # fmt: skip


def _table(diagnosis: Diagnosis) -> Table:
    """State, probability and S of each window."""
    rows = []
    for one in diagnosis.windows[-MOST_ROWS:]:
        begin = labels.format_time(one.start) or labels.format_duration(one.start_s)
        sizes = (one.S, one.S_low, one.S_high) if one.in_control else (None, None, None)
        mark = "" if not one.in_control else "alert" if one.probability >= 0.5 else "good"
        rows.append([
            begin, labels.format_duration(one.duration), Cell(HEADLINES[one.state], mark=mark),
            one.probability if one.in_control else None, *sizes, one.S_detectable,
        ])  # fmt: skip
    columns = ("Begin", "Length", "Loop state", "Probability [-]", "S [% of span]", "S low [% of span]",
               "S high [% of span]", "S that would have shown [% of span]")  # fmt: skip
    return Table(columns, rows)
