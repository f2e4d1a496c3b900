r"""Stenman's valve with one parameter.

Stenman's :math:`d` is eq. 5 repaired with :math:`sb = sj = d` and :math:`r = \infty`: the stem breaks away when OP is
more than d from it, slips to OP, and rests again at once. Of the two-parameter valves with S = J = d Kano's breaks
away at the same distance and slips as far, but then moves on with OP until OP turns or stops. The two are never more
than d apart.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.candidates import combinations, joined, pattern_search
from stiction.diagnosis.identification.model_fit import model_fit

if TYPE_CHECKING:
    from stiction.diagnosis.identification.model_fit import ModelFit, PositionCosts

__all__ = ["fit_stenman"]

STEPS = (
    (0.006, 0.0, 0.1, 40), (0.004, 0.0, 0.1, 24), (0.002, 0.0, 0.05, 12), (0.001, 0.0, 0.03, 6),
    (0.0005, 0.0, 0.02, 4), (0.0002, 0.0, 0.01, 4),
)  # fmt: skip
"""Pattern searches: steps in ln d, in J / S and in the start, and candidates refined [-]."""


def fit_stenman(costs: PositionCosts) -> ModelFit:
    """Fit Stenman's valve.

    Parameters
    ----------
    costs : PositionCosts
        The record.

    Returns
    -------
    ModelFit
        Rows of (d, 1, 1, start).

    References
    ----------
    stenman2003; srinivasan2008, eq. 4.
    """
    swing = float(np.ptp(costs.op))
    d, one = np.geomspace(0.04 * swing, swing, 300), np.ones(1)
    found = costs.evaluate(combinations(d, one, one, np.linspace(-0.9, 0.9, 10)))
    found = pattern_search(costs.evaluate, found, STEPS, swing)
    for d, _, _, start in found.local_minima(4, 0.002, 0.0):
        around = d * np.exp(np.linspace(-0.03, 0.03, 241))
        found = joined(found, costs.evaluate(combinations(around, one, one, np.array([start]))))
    found = pattern_search(costs.evaluate, found, STEPS[3:], swing)
    return model_fit(costs, found, costs.positions(np.array([found.best]))[0])
