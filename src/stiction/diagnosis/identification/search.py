"""Search for the valve that predicts the PV best: a coarse grid, then pattern searches about the best candidates."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.candidates import Candidates, combinations, halved_steps, joined, pattern_search
from stiction.diagnosis.identification.stems import first_order_lags

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.diagnosis.identification.candidates import Valve
    from stiction.diagnosis.identification.regression import Regression

__all__ = ["first_grid", "refine_valve", "search_behind_lags", "search_deadband", "search_valve"]


def first_grid(max_S: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Values of S [% of span] and of J / S [-] of the first search."""
    return np.geomspace(0.04 * max_S, max_S, 28), np.linspace(0.0, 1.0, 5)


def search_valve(coarse: Regression, fine: Regression, max_S: float) -> tuple[Candidates, Candidates]:
    """Find the most likely sticky valve.

    `coarse` is the record in few samples, for the grid, `fine` the one in all samples used; they may be the same. S is
    `max_S` at most [% of span]: a stem that moves in both directions sticks by no more than the swing of OP. Returns
    all valves compared on `fine`, and those of the first grid on `coarse`, in the order S, J / S, rule.
    """
    S, ratio = first_grid(max_S)
    rules = np.array([0.0, 1.0])
    grid = coarse.evaluate(combinations(S, ratio, rules, np.zeros(1)))
    started = coarse.evaluate(combinations(S[0.3 * max_S < S], ratio, rules, START_PLACES))
    found = pattern_search(coarse.evaluate, joined(grid, started), COARSE_STEPS, max_S)
    return pattern_search(fine.evaluate, fine.evaluate(found.local_minima(6, 0.02, 0.1)), FINE_STEPS[:2], max_S), grid


def refine_valve(finest: Regression, found: Candidates, max_S: float) -> Candidates:
    """Refine S, J / S and the start of the best candidates, on the record in blocks that are as short as is useful."""
    found = finest.evaluate(found.local_minima(8, 0.02, 0.1))
    S = np.minimum(found.best.S * np.exp(DENSE_STEP * np.arange(-6.0, 25.0)), max_S)
    dense = combinations(S, np.array([0.2, 0.5, 0.9]), np.array([0.0, 1.0]), np.zeros(1))
    return pattern_search(finest.evaluate, joined(found, finest.evaluate(dense)), SHARP_STEPS, max_S)


START_PLACES = 0.6 * np.array([-1.0, 1.0])
"""First positions tried for a large S, whose stem may not move for a while [half bands from OP]."""
COARSE_STEPS = halved_steps(0.05, 0.16, 0.3, 10)[:3]
"""Pattern searches on the coarse signals: steps in ln S, in J / S and in the start, and candidates refined [-]."""
DENSE_STEP = 0.005
"""Step in ln S of the values that are all tried about the best valve [-]: with little noise, S is as sharp as that."""
FINE_STEPS = halved_steps(0.02, 0.08, 0.2, 4)[:4]
"""The same on the fine signals."""
SHARP_STEPS = halved_steps(0.004, 0.12, 0.1, 4)[:4]
"""The same on the shortest blocks."""


def search_deadband(fine: Regression, found: Candidates, max_S: float) -> float:
    """Smallest cost of a valve with deadband and without slip jump, about the best candidates [-]."""
    rows = found.local_minima(6, 0.02, 0.1)
    rows[:, 1:3] = 0.0
    grid = combinations(np.geomspace(0.3, 1.0, 8) * max_S, np.zeros(1), np.zeros(1), np.zeros(1))
    started = fine.evaluate(np.concatenate([rows, grid]))
    return float(pattern_search(fine.evaluate, started, _without_jump(FINE_STEPS), max_S).cost.min())


def search_behind_lags(coarse: Regression, fine: Regression, best: Valve, max_S: float) -> tuple[float, float]:
    """Smallest costs of a sticky valve and of a valve with deadband only whose actuators follow OP with a lag [-].

    `best` is the most likely valve without a lag; by OP alone a lagging valve looks stickier than it is.
    """
    S = np.minimum(best.S * np.exp(np.linspace(-0.6, 0.1, 10)), max_S)
    grid = combinations(S, np.linspace(0.0, 1.0, 4), np.array([best.rests]), np.zeros(1))
    lags = [float(lag) for lag in ACTUATOR_LAGS]
    found = [_behind_lag(coarse, lag * coarse.per_block / fine.per_block).evaluate(grid) for lag in lags]
    costs = []
    for rows, steps in ((grid[:, 1] >= 0.0, LAG_STEPS), (grid[:, 1] == 0.0, _without_jump(LAG_STEPS))):
        likeliest = int(np.argmin([one.cost[rows].min() for one in found]))
        behind_lag = _behind_lag(fine, lags[likeliest])
        starts = Candidates(grid[rows], found[likeliest].cost[rows]).local_minima(3, 0.05, 0.2)
        refined = pattern_search(behind_lag.evaluate, behind_lag.evaluate(starts), steps, max_S)
        costs.append(float(refined.cost.min()))
    return costs[0], costs[1]


def _behind_lag(regression: Regression, lag: float) -> Regression:
    """A regression with an actuator that follows OP with a lag [samples of its OP]."""
    return replace(regression, op=first_order_lags(regression.op, lag, settled=True))


ACTUATOR_LAGS = 0.8 * np.array([1.0, 2.0, 2.0**2])
"""Time constants of the actuator that are tried [samples of OP]."""
LAG_STEPS = halved_steps(0.04, 0.15, 0.2, 2)[:2]
"""Pattern searches behind a lag, as `FINE_STEPS` [-]."""


def _without_jump(steps: Sequence[tuple[float, float, float, int]]) -> list[tuple[float, float, float, int]]:
    """Steps of a pattern search that leave J / S as it is."""
    return [(S, 0.0, start, count) for S, _, start, count in steps]
