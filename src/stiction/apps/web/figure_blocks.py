"""Blocks of a report page as plain texts, numbers and arrays, which the scripts of the web page draw."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.report import Figure, Heading, SideBySide, Table, Text
from stiction.report.blocks import Cell, TrustedHtml

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stiction.report import Block

__all__ = ["block_to_plain", "figure_to_plain"]


def block_to_plain(block: Block) -> dict[str, Any]:
    """Return a block as a mapping of texts, numbers and arrays; its `type` says what it is.

    Raises
    ------
    TypeError
        When the block is of a kind that the web page does not draw.

    Examples
    --------
    >>> block_to_plain(Heading("Fig. 6"))
    {'type': 'heading', 'text': 'Fig. 6', 'level': 2}
    """
    if isinstance(block, Heading):
        return {"type": "heading", "text": block.text, "level": block.level}
    if isinstance(block, Text):
        return {"type": "text", "text": block.text, "kind": block.kind}
    if isinstance(block, Table):
        rows = [[_cell(value) for value in row] for row in block.rows]
        return {"type": "table", "columns": list(block.columns), "rows": rows, "caption": block.caption}
    if isinstance(block, SideBySide):
        return {"type": "side_by_side", "blocks": [block_to_plain(one) for one in block.blocks]}
    if isinstance(block, Figure):
        return figure_to_plain(block)
    raise TypeError(f"The web page does not draw a {type(block).__name__}.")


def figure_to_plain(figure: Figure) -> dict[str, Any]:
    """Return a figure of lines and markers as panels that share the x axis, from the top down.

    Examples
    --------
    >>> line = {"x": [0.0, 1.0], "y": [2.0, float("nan")], "name": "OP", "mode": "lines", "line": {"color": "#D55E00"}}
    >>> figure_to_plain(Figure({"data": [line], "layout": {}}, "Trend", "OP rises."))["panels"][0]["series"][0]["y"]
    array([ 2., nan])
    """
    layout: Mapping[str, Any] = figure.plot["layout"]
    axes: dict[str, list[dict[str, Any]]] = {}
    for trace in figure.plot["data"]:
        axes.setdefault(trace.get("yaxis", "y"), []).append(_series(trace))
    x_axis = layout.get("xaxis", {})
    panels = []
    for name in sorted(axes):
        y_axis = layout.get(name.replace("y", "yaxis", 1), {})
        panels.append({"label": _title(y_axis), "range": y_axis.get("range"), "series": axes[name]})
    shaded = [[shape["x0"], shape["x1"]] for shape in layout.get("shapes", ()) if shape["type"] == "rect"]
    return {
        "type": "figure",
        "title": figure.title,
        "caption": figure.caption,
        "height": figure.height,
        "x_label": _title(x_axis),
        "x_range": x_axis.get("range"),
        "panels": panels,
        "shaded": shaded,
    }


def _series(trace: Mapping[str, Any]) -> dict[str, Any]:
    """One line or set of markers."""
    line, marker = trace.get("line") or {}, trace.get("marker") or {}
    return {
        "name": trace["name"],
        "x": np.asarray(trace["x"], dtype=float),
        "y": np.asarray(trace["y"], dtype=float),
        "mode": "markers" if "markers" in trace["mode"] else "lines",
        "color": line.get("color") or marker.get("color") or "",
        "dash": line.get("dash", "solid"),
        "width": line.get("width", 1.5),
        "symbol": marker.get("symbol", "circle"),
        "text": [str(one) for one in trace.get("text", ())],
    }


def _title(axis: Mapping[str, Any]) -> str:
    return axis.get("title", {}).get("text", "").replace("<br>", " ")


def _cell(value: Any) -> dict[str, Any]:
    """Text and status of a table cell."""
    from stiction.report.labels import format_number

    mark = value.mark if isinstance(value, Cell) else ""
    plain = value.value if isinstance(value, Cell) else value
    if isinstance(plain, str):
        return {"text": plain, "mark": mark}
    if isinstance(plain, TrustedHtml):
        raise TypeError("The web page shows no markup of a report in a table.")
    number = math.nan if plain is None else float(plain)
    return {"text": "-" if math.isnan(number) else format_number(number, significant=4), "mark": mark}
