"""A reliability plot and a risk-coverage curve side by side, as SVG."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["curve_svg"]

SIZE, MARGIN = 260, 46


def curve_svg(title: str, reliability: NDArray, risk: NDArray, max_risk: float = 0.3) -> str:
    """Draw both plots.

    Parameters
    ----------
    title : str
        What was validated.
    reliability : ndarray, shape (n_bins, 2)
        Mean probability and share of sticky loops of each bin [-].
    risk : ndarray, shape (n_loops, 2)
        Share of loops decided and share of these that are wrong [-].
    max_risk : float
        Upper end of the axis of wrong calls [-].

    Returns
    -------
    str
        An SVG document.
    """
    points = " ".join(f"{MARGIN + SIZE * x:.1f},{MARGIN + SIZE * (1 - y):.1f}" for x, y in reliability)
    dots = "".join(
        f'<circle cx="{MARGIN + SIZE * x:.1f}" cy="{MARGIN + SIZE * (1 - y):.1f}" r="4"/>' for x, y in reliability
    )
    left = 2 * MARGIN + SIZE + 20
    every = max(len(risk) // 150, 1)
    curve = " ".join(
        f"{left + SIZE * x:.1f},{MARGIN + SIZE * (1 - min(y / max_risk, 1)):.1f}" for x, y in risk[every::every]
    )
    return f"""<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {left + SIZE + 20} {SIZE + 2 * MARGIN}"
 font-family="sans-serif" font-size="12" role="img" aria-label="{escape(title)}">
<rect width="100%" height="100%" fill="#fff"/>
<g fill="none" stroke="#888">{_frame(MARGIN)}{_frame(left)}
<path d="M{MARGIN} {MARGIN + SIZE}L{MARGIN + SIZE} {MARGIN}" stroke-dasharray="4"/></g>
<g fill="#0b62a4" stroke="none">{dots}</g>
<polyline points="{points}" fill="none" stroke="#0b62a4"/>
<polyline points="{curve}" fill="none" stroke="#0b62a4" stroke-width="2"/>
<g fill="#222"><text x="{MARGIN}" y="{MARGIN - 10}">Share of sticky loops over probability</text>
<text x="{left}" y="{MARGIN - 10}">Wrong calls (0 to {max_risk:g}) over share decided</text>
<text x="{MARGIN}" y="{MARGIN + SIZE + 18}">0</text><text x="{MARGIN + SIZE - 8}" y="{MARGIN + SIZE + 18}">1</text>
<text x="{left}" y="{MARGIN + SIZE + 18}">0</text><text x="{left + SIZE - 8}" y="{MARGIN + SIZE + 18}">1</text></g>
</svg>
"""


def _frame(x: float) -> str:
    return f'<rect x="{x}" y="{MARGIN}" width="{SIZE}" height="{SIZE}"/>'
