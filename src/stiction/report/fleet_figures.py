"""Drawings of an audit as inline SVG: areas as a treemap, trends of a group stacked, its spectra."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from stiction.display import count_noun, format_seconds
from stiction.report.blocks import TrustedHtml
from stiction.report.group_picture import RATIOS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.report.group_picture import GroupPicture

__all__ = ["group_spectra", "group_trends", "treemap"]

WIDTH = 1160.0
"""Width of the treemap [px]."""
SHADES = ((0.0, "#eef1f3"), (0.05, "#f6ddd8"), (0.15, "#eeb8ae"), (0.3, "#e08d80"), (0.5, "#cf6152"))
"""Share of loops with a finding from which a colour is used [-]."""
COLORS = ("#0b6fa4", "#c1531b", "#4a7a2e", "#7a4ea0", "#8a6d00", "#9c2f5f", "#3b6e6e", "#555c66")
"""Colours of the loops of a group."""


def treemap(areas: Sequence[tuple[str, int, int]], *, height: float = 300.0) -> TrustedHtml:
    """Draw areas (name, loops, loops with a finding) as rectangles in proportion to their loops."""
    ordered = sorted((one for one in areas if one[1] > 0), key=lambda one: -one[1])
    parts = []
    boxes = _squarify([one[1] for one in ordered], 0.0, 0.0, WIDTH, height)
    for (name, loops, findings), (x, y, w, h) in zip(ordered, boxes, strict=True):
        share = findings / loops
        color = next(color for limit, color in reversed(SHADES) if share >= limit)
        shown = name or "no area"
        text = f"{shown}: {findings} of {count_noun(loops, 'loop')} with a finding"
        parts.append(
            f'<g><title>{escape(text)}</title><rect x="{x + 1:.1f}" y="{y + 1:.1f}" width="{max(0.0, w - 2):.1f}" '
            f'height="{max(0.0, h - 2):.1f}" fill="{color}" stroke="#9aa3ad" stroke-width="{2 if findings else 0.5}"/>'
        )
        if w > 70 and h > 36:
            letters = max(3, int((w - 12) / 7.2))
            label = shown if len(shown) <= letters else shown[: letters - 1] + "…"
            parts.append(f'<text x="{x + 8:.1f}" y="{y + 18:.1f}" class="area">{escape(label)}</text>')
            parts.append(f'<text x="{x + 8:.1f}" y="{y + 33:.1f}">{findings} of {loops}</text>')
        parts.append("</g>")
    label = f"{count_noun(len(ordered), 'area')} by number of loops, darker with more findings"
    return TrustedHtml(
        f'<svg class="treemap" viewBox="0 0 {WIDTH:g} {height:g}" role="img" aria-label="{label}">'
        f"{''.join(parts)}</svg>"
    )


def group_trends(picture: GroupPicture) -> TrustedHtml:
    """Draw one signal of each loop of a group, stacked."""
    row, left, width = 34.0, 170.0, 760.0
    parts = []
    for k, (tag, (x, level)) in enumerate(picture.trends.items()):
        y = row * k + row / 2.0
        parts.append(f'<text x="0" y="{y + 4:.1f}">{escape(_short(tag))}</text>')
        parts.append(_line(left + x * width, y - level * (row - 8.0), COLORS[k % len(COLORS)]))
    height = row * len(picture.trends)
    loops, shown = count_noun(len(picture.trends), "loop"), format_seconds(max(1.0, picture.shown_s))
    text = f"Trends of {loops} over {shown}, the most likely source first"
    return TrustedHtml(
        f'<svg class="chart" viewBox="0 0 {left + width:g} {height:g}" role="img" aria-label="{escape(text)}">'
        f"{''.join(parts)}</svg>"
    )


def group_spectra(picture: GroupPicture, period: float) -> TrustedHtml:
    """Draw the spectra of the loops over each other; `period`: that of the group [s]."""
    width, height, left = 440.0, 190.0, 10.0
    low, high = np.log(RATIOS[0]), np.log(RATIOS[1])
    parts = [f'<line x1="{left}" x2="{width}" y1="{height - 24}" y2="{height - 24}" stroke="#9aa3ad"/>']
    for ratio in (1, 3, 5):
        x = left + (np.log(ratio) - low) / (high - low) * (width - left)
        parts.append(
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="4" y2="{height - 24}" stroke="#c9cfd6" stroke-dasharray="3 3"/>'
        )
        name = format_seconds(period / ratio) if ratio == 1 else f"1/{ratio}"
        parts.append(f'<text x="{x:.1f}" y="{height - 8}" text-anchor="middle">{escape(name)}</text>')
    for k, (ratios, level) in enumerate(picture.spectra.values()):
        at = left + (np.log(ratios) - low) / (high - low) * (width - left)
        parts.append(_line(at, height - 24 - level * (height - 32), COLORS[k % len(COLORS)]))
    loops = count_noun(len(picture.spectra), "loop")
    text = f"Amplitude spectra of {loops}; they share the peak at {format_seconds(period)}"
    return TrustedHtml(
        f'<svg class="chart" viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{escape(text)}">'
        f"{''.join(parts)}</svg>"
    )


def _squarify(
    sizes: Sequence[float], x: float, y: float, w: float, h: float
) -> list[tuple[float, float, float, float]]:
    """Rectangles of these sizes, the largest first, as square as rows allow (Bruls, Huizing & van Wijk 2000)."""
    boxes: list[tuple[float, float, float, float]] = []
    left = list(sizes)
    while left:
        scale = w * h / sum(left)
        side = min(w, h)
        count = 1
        while count < len(left) and _worst(left[: count + 1], scale, side) <= _worst(left[:count], scale, side):
            count += 1
        row, left = left[:count], left[count:]
        thick = sum(row) * scale / side
        at = 0.0
        for size in row:
            long = size * scale / thick
            boxes.append((x, y + at, thick, long) if w >= h else (x + at, y, long, thick))
            at += long
        x, y, w, h = (x + thick, y, w - thick, h) if w >= h else (x, y + thick, w, h - thick)
    return boxes


def _worst(row: Sequence[float], scale: float, side: float) -> float:
    """Largest ratio of the sides of the rectangles of one row [-]."""
    total = sum(row) * scale
    return max(max(side**2 * size * scale / total**2, total**2 / (side**2 * size * scale)) for size in row)


def _line(x: NDArray[np.float64], y: NDArray[np.float64], color: str) -> str:
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="1.2"/>'


def _short(tag: str) -> str:
    return tag if len(tag) <= 24 else "…" + tag[-23:]
