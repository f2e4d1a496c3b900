"""What makes the loop oscillate: a bar for each cause."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.verdict.causes import CAUSES, cause_models
from stiction.report import labels, style
from stiction.report.blocks import Figure, Table
from stiction.report.figures.bars import horizontal_bars

if TYPE_CHECKING:
    from stiction.report.loop_view import LoopView

__all__ = ["oscillation_causes"]


def oscillation_causes(view: LoopView) -> Figure | None:
    """Return the score of each cause; None where the loop is not in control."""
    if not view.diagnosis.loop_state.in_control:
        return None
    scores = np.array([getattr(view.diagnosis.oscillation_cause, name) for name in CAUSES])
    names = [labels.CAUSES[name] for name in CAUSES]
    text = [f"{score:.2f}" for score in scores]
    limit = cause_models().named
    plot = horizontal_bars(names, scores, text, "Score [-]")
    plot["layout"]["xaxis"] |= {"range": [0.0, 1.12], "dtick": 0.25}
    plot["layout"]["shapes"] = [style.vertical_line(limit)]
    main = labels.cause_label(view.diagnosis)
    result = f"no cause reaches {limit:g}" if main == "none" else f"the main cause is {main}"
    caption = (
        f"Each cause has its own score from 0 to 1; the scores do not sum to 1. From {limit:g} on (dotted line) a "
        f"cause counts: {result}."
    )
    table = Table(["Cause", "Score [-]"], list(zip(names, text, strict=True)))
    return Figure(plot, "Causes of the oscillation", caption, 240, table)
