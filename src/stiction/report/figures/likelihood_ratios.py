"""How much better the sticky valve predicts the PV than each other explanation."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.verdict.features import log_evidence
from stiction.report import labels
from stiction.report.blocks import Figure
from stiction.report.figures.bars import horizontal_bars

if TYPE_CHECKING:
    from stiction.diagnosis.identification.result import Identification
    from stiction.report.loop_view import LoopView

__all__ = ["ALTERNATIVES", "finite_likelihood_ratios", "likelihood_ratios"]

ALTERNATIVES = {
    "good": "good valve",
    "deadband": "deadband without slip jump",
    "nonlinear": "nonlinear valve characteristic",
    "dead_zone": "dead zone at a fixed OP",
    "relay_load": "switching load",
    "periodic_load": "periodic load",
    "beside_periodic_load": "good valve, periodic load added to both",
    "noise_gate": "good valve, PV without noise",
}
"""Explanation without a sticky valve -> its name."""
TICKS = (-10000, -1000, -100, -20, 0, 20, 100, 1000, 10000, 100000)
"""Likelihood ratios marked on the axis [-]."""


def likelihood_ratios(view: LoopView) -> Figure | None:
    """Return a bar for each other explanation, the strongest of them at the top; None without an identification."""
    found = view.diagnosis.identification
    ratios = finite_likelihood_ratios(found) if found is not None else []
    if not ratios:
        return None
    x = np.array([log_evidence(ratio) for _, ratio in ratios])
    text = [labels.format_number(ratio) for _, ratio in ratios]
    plot = horizontal_bars([name for name, _ in ratios], x, text, "Likelihood ratio [-]")
    ticks = [tick for tick in TICKS if min(x.min(), 0.0) - 0.1 <= log_evidence(tick) <= max(x.max(), 0.0) + 0.1]
    plot["layout"]["xaxis"] |= {"tickvals": [log_evidence(tick) for tick in ticks], "ticktext": [f"{k}" for k in ticks]}
    caption = (
        "Twice the log likelihood ratio of the sticky valve over each explanation. Bar to the right: the sticky valve "
        "predicts the PV better; to the left: the other explanation does. The first is the strongest alternative. The "
        "axis is linear up to 20 and logarithmic beyond."
    )
    return Figure(plot, "Sticky valve against other explanations", caption, height=90 + 36 * len(ratios))


def finite_likelihood_ratios(found: Identification) -> list[tuple[str, float]]:
    """Return name and twice the log likelihood ratio of each other explanation that was compared, smallest first."""
    ratios = [
        (ALTERNATIVES.get(name, name.replace("_", " ")), ratio) for name, ratio in found.likelihood_ratios.items()
    ]
    return sorted(((name, ratio) for name, ratio in ratios if math.isfinite(ratio)), key=lambda one: one[1])
