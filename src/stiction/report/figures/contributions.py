"""What each feature of the record contributes to the log odds of stiction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.report import labels
from stiction.report.blocks import Figure, Table
from stiction.report.figures.bars import horizontal_bars

if TYPE_CHECKING:
    from stiction.diagnosis.verdict.diagnosis import Diagnosis
    from stiction.report.loop_view import LoopView

__all__ = ["contributions", "feature_table"]

MIN_PLOTTED = 0.005
"""Smallest contribution with a bar [log odds]."""


def contributions(view: LoopView) -> Figure | None:
    """Return a bar for each feature that contributes, the strongest at the top; None where no feature does."""
    rows = zip(feature_table(view.diagnosis)[:-1], view.diagnosis.contributions, strict=True)
    plotted = [(row, part.log_odds) for row, part in rows if abs(part.log_odds) >= MIN_PLOTTED]
    if not plotted:
        return None
    names, text = [name for (name, *_), _ in plotted], [row[-1] for row, _ in plotted]
    log_odds = np.array([value for _, value in plotted])
    plot = horizontal_bars(names, log_odds, text, "Log odds of stiction [-]")
    caption = (
        "A bar to the right is evidence for stiction, a bar to the left evidence against it. With a prior of "
        f"{labels.format_probability(view.diagnosis.prior)} and the average of all loops "
        f"({view.diagnosis.average_log_odds:+.2f}) they give a probability of stiction of "
        f"{labels.format_probability(view.diagnosis.probability)}."
    )
    if others := len(view.diagnosis.contributions) - len(plotted):
        caption += f" {labels.count_noun(others, 'feature')} without a contribution: see the numbers below."
    table = Table(["Feature", "Formula", "Value", "Log odds"], feature_table(view.diagnosis))
    return Figure(plot, "What each feature contributes", caption, 90 + 36 * len(plotted), table)


def feature_table(diagnosis: Diagnosis) -> list[list[str]]:
    """Return name, formula, value and log odds of each feature, the strongest first, and of the average last."""
    from stiction.diagnosis.verdict.features import FEATURES

    formulas = {feature.name: feature.formula for feature in FEATURES}
    rows = [
        [
            part.label,
            formulas.get(part.feature, "number of windows that were pooled"),
            labels.format_number(part.value),
            f"{part.log_odds:+.2f}",
        ]
        for part in diagnosis.contributions
    ]
    return [*rows, ["average of all loops", "constant of the model", "\u2013", f"{diagnosis.average_log_odds:+.2f}"]]
