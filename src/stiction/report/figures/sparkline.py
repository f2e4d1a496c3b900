"""A signal as a small line in a table cell."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.report.blocks import TrustedHtml
from stiction.report.downsample import downsample

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["sparkline"]

WIDTH, HEIGHT, POINTS = 120.0, 26.0, 120
"""Size [px] and largest number of points [-]."""


def sparkline(y: NDArray[np.float64], label: str) -> TrustedHtml:
    """Return `y` as a small inline drawing; gaps stay gaps.

    `label`: text for screen readers; it is not escaped.
    """
    drawn = downsample(y, POINTS)
    values = y[drawn]
    good = np.isfinite(values)
    if not good.any():
        return TrustedHtml('<span class="muted">no data</span>')
    low, size = float(values[good].min()), float(np.ptp(values[good])) or 1.0
    x = 1.0 + drawn / max(len(y) - 1, 1) * (WIDTH - 2.0)
    height = HEIGHT - 3.0 - (values - low) / size * (HEIGHT - 6.0)
    parts: list[str] = []
    pen_up = True
    for k in range(len(drawn)):
        if not good[k]:
            pen_up = True
            continue
        parts.append(f"{'M' if pen_up else 'L'}{x[k]:.1f} {height[k]:.1f}")
        pen_up = False
    return TrustedHtml(
        f'<svg class="spark" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="{label}">'
        f'<path d="{"".join(parts)}"/></svg>'
    )
