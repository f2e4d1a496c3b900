"""How much more data of the same kind would settle an open question."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.evidence.pooling import effective_windows, pooled_features, pooling_model
from stiction.diagnosis.verdict.decision import Costs, decide
from stiction.diagnosis.verdict.model import log_odds, logistic

if TYPE_CHECKING:
    from stiction.diagnosis.evidence.pooling import WindowTable

__all__ = ["windows_needed"]

MOST_NEEDED = 50
"""Further windows up to which an answer is predicted [-]."""


def windows_needed(
    table: WindowTable, evidence: float, prior: float, costs: Costs, S_detectable: float | None
) -> int | None:
    """Foretell how many further windows like those so far would give a verdict.

    Parameters
    ----------
    table : WindowTable
        The windows of today's valve.
    evidence : float
        What they say together, log odds beyond those of the prior [-].
    prior : float
        Share of sticky valves where the records come from [-].
    costs : Costs
        What each call costs when it is wrong.
    S_detectable : float or None
        Smallest S that the windows would have shown [% of span]; None where none would show.

    Returns
    -------
    int or None
        Further windows, 0 where the verdict is there [-]; None where more of the same will not decide.
    """
    model, n = pooling_model(), table.evidence.size
    score = float(np.array(model["coefficients"]) @ pooled_features(table))
    independent = effective_windows(n, model["correlation"])
    for further in range(MOST_NEEDED + 1):
        gained = (effective_windows(n + further, model["correlation"]) - independent) * score
        verdict = decide(logistic(log_odds(prior) + evidence + gained), costs, excluded=S_detectable is not None)
        if verdict != "undecided":
            return further
    return None
