"""How much better the sticky valve predicts the PV than each other explanation."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.verdict.causes import STICKY_TOO
from stiction.diagnosis.verdict.features import log_evidence
from stiction.report import labels
from stiction.report.blocks import Figure, Table
from stiction.report.figures.bars import horizontal_bars

if TYPE_CHECKING:
    from stiction.diagnosis.identification.result import Identification
    from stiction.report.loop_view import LoopView

__all__ = ["ALTERNATIVES", "RATIO_LABEL", "finite_likelihood_ratios", "likelihood_ratios"]

ALTERNATIVES = {
    "good": "good valve",
    "deadband": "apart: sticky valve without slip jump",
    "dead_zone": "dead zone at a fixed OP",
    "relay_load": "switching load",
    "periodic_load": "periodic load",
    "beside_periodic_load": "apart: good valve, periodic load added to both",
}
"""Explanation -> its name; those "apart" are not counted among the other explanations."""
RATIO_LABEL = "2 ln(likelihood ratio) [-]"
"""Name of the numbers."""
TICKS = (-10000, -1000, -100, -20, 0, 20, 100, 1000, 10000, 100000)
"""Likelihood ratios marked on the axis [-]."""


def likelihood_ratios(view: LoopView) -> Figure | None:
    """Return a bar for each other explanation, the strongest of them at the top; None without an identification."""
    identification = view.diagnosis.identification
    ratios = finite_likelihood_ratios(identification) if identification is not None else []
    if not ratios:
        return None
    x = np.array([log_evidence(ratio) for _, ratio in ratios])
    text = [labels.format_number(ratio) for _, ratio in ratios]
    plot = horizontal_bars([name for name, _ in ratios], x, text, RATIO_LABEL)
    ticks = [tick for tick in TICKS if min(x.min(), 0.0) - 0.1 <= log_evidence(tick) <= max(x.max(), 0.0) + 0.1]
    plot["layout"]["xaxis"] |= {"tickvals": [log_evidence(tick) for tick in ticks], "ticktext": [f"{k}" for k in ticks]}
    caption = (
        "Twice the logarithm of the likelihood ratio. Bar to the right: the sticky valve "
        "predicts the PV better; to the left: the other explanation predicts it better. The first is the strongest "
        "alternative; those named 'apart' are not counted as alternatives. The axis is linear up to 20 and logarithmic "
        "beyond."
    )
    rows = [[name, number] for (name, _), number in zip(ratios, text, strict=True)]
    table = Table(["Other explanation", RATIO_LABEL], rows)
    return Figure(plot, "Sticky valve against other explanations", caption, 90 + 36 * len(ratios), table)


def finite_likelihood_ratios(identification: Identification) -> list[tuple[str, float]]:
    """Name and twice the log likelihood ratio of each alternative, ascending; ratios with an added load last."""
    finite = [(name, ratio) for name, ratio in identification.likelihood_ratios.items() if math.isfinite(ratio)]
    ranked = sorted(finite, key=lambda pair: (pair[0] in STICKY_TOO, pair[1]))
    return [(ALTERNATIVES.get(name, name.replace("_", " ")), ratio) for name, ratio in ranked]
