"""A signal as a small line in a table cell."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.report.blocks import TrustedHtml
from stiction.report.downsample import downsample

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["SPARK_HALF_RANGE", "SPARK_TIME", "recent_swing", "sparkline"]

WIDTH, HEIGHT, POINTS = 120.0, 26.0, 120
"""Size [px] and largest number of points [-]."""


SPARK_TIME, SPARK_HALF_RANGE = 7200.0, 10.0
"""What a small line of OP shows, the same for all loops: time [s], and distance from its mean [% of span]."""


def recent_swing(x: NDArray[np.floating], dt: float) -> NDArray[np.float64]:
    """Return the last `SPARK_TIME` of a signal about its mean; what is missing at the front is NaN.

    Examples
    --------
    >>> recent_swing(np.array([1.0, 3.0]), 2400.0).tolist()
    [nan, -1.0, 1.0]
    """
    count = max(2, round(SPARK_TIME / dt))
    part = x[-count:].astype(np.float64)
    known = np.isfinite(part)
    about = part - (part[known].mean() if known.any() else 0.0)
    return np.concatenate([np.full(count - part.size, np.nan), about])


def sparkline(y: NDArray[np.float64], label: str, half_range: float | None = None) -> TrustedHtml:
    """Return `y` as a small inline drawing; gaps stay gaps.

    `label`: text for screen readers; it is not escaped. `half_range`: the drawing goes from minus to plus this; what
    is outside is cut [unit of `y`]. The range of `y` when not given.
    """
    if half_range is not None:
        y = np.clip(y, -half_range, half_range)
    drawn = downsample(y, POINTS)
    values = y[drawn]
    good = np.isfinite(values)
    if not good.any():
        return TrustedHtml('<span class="muted">no data</span>')
    low, size = float(values[good].min()), float(np.ptp(values[good])) or 1.0
    if half_range is not None:
        low, size = -half_range, 2.0 * half_range
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
