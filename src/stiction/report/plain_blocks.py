"""Blocks of a page as plain texts, numbers and arrays, which the scripts of the web page draw."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.report.blocks import (
    Cell,
    Collapsible,
    Definitions,
    Figure,
    Heading,
    Headline,
    Sheet,
    SideBySide,
    Table,
    Text,
    TrustedHtml,
)
from stiction.report.rendering import format_cell

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from stiction.report.blocks import Block

__all__ = ["blocks_to_plain"]


def blocks_to_plain(blocks: Iterable[Block]) -> list[dict[str, Any]]:
    """Return blocks as mappings of texts, numbers and arrays; `type` says what each is.

    Maps, and plots with a logarithmic axis, are left out; they are in the report.

    Examples
    --------
    >>> blocks_to_plain([Heading("Fig. 6")])
    [{'type': 'heading', 'text': 'Fig. 6', 'level': 2}]
    """
    return [plain for block in blocks if (plain := _to_plain(block)) is not None]


def _to_plain(block: Block) -> dict[str, Any] | None:
    match block:
        case Heading():
            return {"type": "heading", "text": block.text, "level": block.level}
        case Headline():
            names = ("name", "verdict", "mark", "line", "confidence", "reason", "action", "facts")
            return {"type": "headline", **{name: getattr(block, name) for name in names}}
        case Text():
            return {"type": "text", "text": block.text, "kind": block.kind}
        case Sheet():
            return {"type": "sheet", "title": block.title, "lines": block.lines}
        case Definitions():
            return {"type": "definitions", "rows": block.given}
        case Table():
            rows = [[_cell(value) for value in row] for row in block.rows]
            return {"type": "table", "columns": list(block.columns), "rows": rows, "caption": block.caption}
        case SideBySide():
            return {"type": "side_by_side", "blocks": blocks_to_plain(block.blocks)}
        case Collapsible():
            return {"type": "collapsible", "title": block.title, "blocks": blocks_to_plain(block.blocks)}
        case Figure():
            return _figure(block)
        case _:
            raise TypeError(f"The web page does not draw a {type(block).__name__}.")


def _figure(figure: Figure) -> dict[str, Any] | None:
    """A figure of bars, or one of lines and markers as panels that share the x axis, from the top down."""
    layout: Mapping[str, Any] = figure.plot["layout"]
    traces, x_axis = figure.plot["data"], layout.get("xaxis", {})
    texts = {"title": figure.title, "caption": figure.caption, "x_label": _title(x_axis)}
    if traces[0]["type"] == "bar" and traces[0].get("orientation") == "h":
        [bars] = traces
        names = [name.replace("<br>", " ") for name in bars["y"]]
        return {"type": "bars", **texts, "names": names, "x": np.asarray(bars["x"]), "text": bars["text"]}
    if any(trace["type"] != "scatter" for trace in traces) or x_axis.get("type") == "log":
        return None
    axes: dict[str, list[dict[str, Any]]] = {}
    for trace in traces:
        axes.setdefault(trace.get("yaxis", "y"), []).append(_series(trace))
    panels = []
    for name in sorted(axes):
        y_axis = layout.get(name.replace("y", "yaxis", 1), {})
        panels.append({"label": _title(y_axis), "range": y_axis.get("range"), "series": axes[name]})
    shaded = [[shape["x0"], shape["x1"]] for shape in layout.get("shapes", ()) if shape["type"] == "rect"]
    more = {"height": figure.height, "x_range": x_axis.get("range"), "panels": panels, "shaded": shaded}
    return {"type": "figure", **texts, **more}


def _series(trace: Mapping[str, Any]) -> dict[str, Any]:
    """One line or set of markers; points in the colours of a scale become a line."""
    line, marker = trace.get("line") or {}, trace.get("marker") or {}
    is_scale = not isinstance(marker.get("color", ""), str)
    return {
        "name": trace["name"],
        "x": np.asarray(trace["x"], dtype=float),
        "y": np.asarray(trace["y"], dtype=float),
        "mode": "markers" if "markers" in trace["mode"] and not is_scale else "lines",
        "color": "pv" if is_scale else line.get("color") or marker.get("color") or "",
        "dash": line.get("dash", "solid"),
        "width": line.get("width", 1.5),
        "symbol": marker.get("symbol", "circle"),
        "text": [str(text).replace("<b>", "").replace("</b>", "") for text in trace.get("text", ())],
    }


def _title(axis: Mapping[str, Any]) -> str:
    return axis.get("title", {}).get("text", "").replace("<br>", " ")


def _cell(value: Any) -> dict[str, Any]:
    """Text and status of a table cell."""
    cell = value if isinstance(value, Cell) else Cell(value)
    if isinstance(cell.value, TrustedHtml):
        raise TypeError("The web page shows no markup of a report in a table.")
    is_number = cell.value is None or not isinstance(cell.value, str)
    return {"text": format_cell(cell.value), "mark": cell.mark, "number": is_number}
