"""Search for the valve that predicts the PV best: a coarse grid, then pattern searches about the best candidates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.candidates import combinations, joined, pattern_search

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.candidates import Candidates
    from stiction.diagnosis.identification.regression import Regression

__all__ = ["first_grid", "search_valve"]


def first_grid(max_S: float, min_share: float = 0.04) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Values of S [% of span] and of J / S [-] of the first search."""
    return np.geomspace(min_share * max_S, max_S, 28), np.linspace(0.0, 1.0, 5)


def search_valve(coarse: Regression, fine: Regression, max_S: float) -> tuple[Candidates, Candidates]:
    """Find the most likely sticky valve.

    Parameters
    ----------
    coarse : Regression
        The record in few samples, for the grid.
    fine : Regression
        The record in all samples used, for the final comparison; it may be `coarse`.
    max_S : float
        Largest S [% of span]: a stem that moves in both directions sticks by no more than the swing of OP.

    Returns
    -------
    found : Candidates
        All valves compared on `fine`.
    grid : Candidates
        Those of the first grid, compared on `coarse`, in the order S, J / S, rule.
    """
    S, ratio = first_grid(max_S)
    rules = np.array([0.0, 1.0])
    grid = coarse.evaluate(combinations(S, ratio, rules, np.zeros(1)))
    started = coarse.evaluate(combinations(S[0.3 * max_S < S], ratio, rules, START_PLACES))
    found = pattern_search(coarse.evaluate, joined(grid, started), COARSE_STEPS, max_S)
    found = fine.evaluate(found.local_minima(6, 0.02, 0.1))
    return pattern_search(fine.evaluate, found, FINE_STEPS, max_S), grid


START_PLACES = np.array([-0.6, 0.6])
"""First positions tried for a large S, whose stem may not move for a while [half bands from OP]."""
COARSE_STEPS = ((0.05, 0.16, 0.3, 10), (0.03, 0.08, 0.15, 8), (0.012, 0.04, 0.08, 6))
"""Pattern searches on the coarse signals: steps in ln S, in J / S and in the start, and candidates refined [-]."""
FINE_STEPS = ((0.02, 0.08, 0.2, 4), (0.008, 0.04, 0.1, 4), (0.004, 0.02, 0.05, 3), (0.0015, 0.008, 0.03, 2))
"""The same on the fine signals."""
