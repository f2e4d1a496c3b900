"""Parts of a notebook card: one HTML fragment with inline SVG, no script, light and dark."""

from __future__ import annotations

import math
from html import escape
from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

__all__ = ["bar", "card", "sparkline", "table"]

WIDTH, HEIGHT = 560.0, 56.0
"""Size of a signal drawing [px]."""
MAX_COLUMNS = 240
"""Columns of a signal drawing; each shows the smallest and the largest sample in it [-]."""
MAX_TEXT = 1200
"""Characters of one text in a card [-]."""
STYLE = """<style>
.stiction-card{color-scheme:light dark;font:14px/1.45 system-ui,sans-serif;max-width:620px;padding:10px 14px;
border:1px solid #8886;border-radius:8px;color:light-dark(#1f2328,#e6edf3);background:light-dark(#fff,#161b22)}
.stiction-card h4{margin:0 0 4px;font-size:15px}.stiction-card p{margin:4px 0}
.stiction-card table{border-collapse:collapse;margin:6px 0;font-size:13px}
.stiction-card td,.stiction-card th{padding:2px 10px 2px 0;text-align:left;background:none;border:0}
.stiction-card svg{display:block;width:100%;height:auto}
.stiction-card .op{stroke:light-dark(#0969da,#58a6ff)}.stiction-card .pv{stroke:light-dark(#1a7f37,#3fb950)}
.stiction-card .mv{stroke:light-dark(#bc4c00,#f0883e)}.stiction-card .sp{stroke:light-dark(#6e7781,#8b949e)}
.stiction-card path{fill:none;stroke-width:1.2}.stiction-card rect{fill:light-dark(#0969da,#58a6ff)}
</style>"""


def card(title: str, parts: Iterable[str]) -> str:
    """Return a card with an escaped title; `parts` are fragments that are escaped already.

    Examples
    --------
    >>> "FIC&lt;1&gt;" in card("FIC<1>", ["<p>text</p>"])
    True
    """
    body = "".join(parts)
    return f'<div class="stiction-card">{STYLE}<h4>{escape(_cut(title))}</h4>{body}</div>'


def paragraph(text: str) -> str:
    """Return a text as an escaped paragraph, cut where it is very long."""
    return f"<p>{escape(_cut(text))}</p>"


def table(rows: Sequence[Sequence[str]], head: Sequence[str] = ()) -> str:
    """Return rows of text as an escaped table.

    Examples
    --------
    >>> table([("S", "5 %")])
    '<table><tr><td>S</td><td>5 %</td></tr></table>'
    """

    def row(cells: Sequence[str], kind: str) -> str:
        return "<tr>" + "".join(f"<{kind}>{escape(_cut(cell))}</{kind}>" for cell in cells) + "</tr>"

    return "<table>" + (row(head, "th") if head else "") + "".join(row(cells, "td") for cells in rows) + "</table>"


def bar(share: float) -> str:
    """Return a bar of a share between 0 and 1."""
    share = min(max(share, 0.0), 1.0) if math.isfinite(share) else 0.0
    return (
        f'<svg viewBox="0 0 {WIDTH:g} 8" role="img" aria-label="{100 * share:.0f} %">'
        f'<rect width="{WIDTH:g}" height="8" style="opacity:.18"/><rect width="{WIDTH * share:.1f}" height="8"/></svg>'
    )


def sparkline(signals: Sequence[tuple[str, Sequence[float]]], label: str) -> str:
    """Return signals on one scale as a small drawing.

    `signals`: class of the line (op, pv, mv or sp) and its samples [any unit]; gaps stay gaps. `label`: text for screen
    readers. Returns an inline SVG, or a line of text when there is no sample to draw.

    Examples
    --------
    >>> sparkline([("op", [1.0, 2.0])], "OP").count("<path")
    1
    """
    finite = [value for _, series in signals for value in series if math.isfinite(value)]
    if not finite:
        return paragraph(f"{label}: no values.")
    low, size = min(finite), (max(finite) - min(finite)) or 1.0
    lines = [f'<path class="{escape(name)}" d="{_path(series, low, size)}"/>' for name, series in signals]
    return f'<svg viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="{escape(label)}">{"".join(lines)}</svg>'


def _path(series: Sequence[float], low: float, size: float) -> str:
    """Path of a signal: in each column a stroke from the smallest to the largest sample, in the order of time."""
    columns = min(MAX_COLUMNS, len(series))
    edges = [k * len(series) // columns for k in range(columns + 1)]
    points: list[str] = []
    pen = "M"
    for begin, end in pairwise(edges):
        block = [(value, k) for k, value in enumerate(series[begin:end], begin) if math.isfinite(value)]
        if not block:
            pen = "M"
            continue
        for value, k in sorted({min(block), max(block)}, key=lambda pair: pair[1]):
            x = WIDTH * k / max(len(series) - 1, 1)
            points.append(f"{pen}{x:.0f} {HEIGHT - 3 - (value - low) / size * (HEIGHT - 6):.1f}")
            pen = "L"
    return "".join(points)


def _cut(text: str) -> str:
    return text if len(text) <= MAX_TEXT else f"{text[: MAX_TEXT - 1]}…"
