"""What each feature of the record contributes to the log odds of stiction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.report import labels
from stiction.report.blocks import Figure
from stiction.report.figures.bars import horizontal_bars

if TYPE_CHECKING:
    from stiction.diagnosis.verdict.diagnosis import Diagnosis
    from stiction.report.loop_view import LoopView

__all__ = ["contributions", "feature_table"]


def contributions(view: LoopView) -> Figure | None:
    """Return a bar for each feature, the strongest at the top; None where the record was not judged."""
    found = view.diagnosis.contributions
    if not found:
        return None
    log_odds = np.array([one.log_odds for one in found])
    names = [row[0] for row in feature_table(view.diagnosis)]
    text = [f"{x:+.2f}" for x in log_odds]
    plot = horizontal_bars(names, log_odds, text, "Contribution to the log odds of stiction [-]")
    caption = (
        f"A bar to the right speaks for stiction, a bar to the left against it. With the prior of "
        f"{labels.format_probability(view.diagnosis.prior)} the sum gives a probability of stiction of "
        f"{labels.format_probability(view.diagnosis.probability)}."
    )
    return Figure(plot, "What each feature contributes", caption, height=90 + 24 * len(found))


def feature_table(diagnosis: Diagnosis) -> list[list[str]]:
    """Return name, formula, value and log odds of each feature, the strongest first."""
    from stiction.diagnosis.verdict.features import FEATURES

    features = {feature.name: feature for feature in FEATURES}
    return [
        [
            features[one.feature].label,
            features[one.feature].formula,
            labels.format_number(one.value),
            f"{one.log_odds:+.2f}",
        ]
        for one in diagnosis.contributions
    ]
