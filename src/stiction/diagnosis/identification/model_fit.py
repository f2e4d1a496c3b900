"""What the searches of all valve models share: costs, fits and intervals; the fits of Kano's and Stenman's valve."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from stiction.diagnosis.identification.candidates import combinations, halved_steps, joined, pattern_search
from stiction.records.correlation import lagged_products

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.candidates import Candidates

__all__ = [
    "ModelFit",
    "PositionCosts",
    "fit_kano",
    "fit_stenman",
    "independent_share",
    "likely_candidates",
    "likely_range",
    "model_fit",
]


class PositionCosts(Protocol):
    """A record with which valve positions are compared: its PV (`Regression`) or its recorded position."""

    @property
    def op(self) -> NDArray[np.float64]:
        """OP at the rate at which valve positions are simulated [% of span]."""
        ...

    @property
    def per_block(self) -> int:
        """Values of OP for each value compared [-]."""
        ...

    @property
    def n_predicted(self) -> int:
        """Values compared [-]."""
        ...

    def positions(self, valves: NDArray[np.float64]) -> NDArray[np.float64]:
        """Positions of candidates (S, J / S, rests, start) [% of span]."""
        ...

    def evaluate(self, valves: NDArray[np.float64]) -> Candidates:
        """Candidates (S, J / S, rests, start) with their costs."""
        ...

    def cost_of_positions(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Minus twice the log likelihood of positions, but for a constant [-]."""
        ...

    def residuals(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """What the positions leave unexplained."""
        ...


class ModelFit(NamedTuple):
    """A valve model fitted to a record."""

    found: Candidates
    """All valves compared; the third number of a row belongs to the model."""
    position: NDArray[np.float64]
    """Position of the best one [% of span], as `PositionCosts` compares it."""
    share: float
    """Share of the values compared that are independent, by the residual of the best one [-]."""

    @property
    def best(self) -> NDArray[np.float64]:
        """The best row, shape (4,)."""
        return np.array(self.found.best)

    @property
    def cost(self) -> float:
        """Its cost [-]."""
        return float(self.found.cost.min())


def model_fit(costs: PositionCosts, found: Candidates, position: NDArray[np.float64]) -> ModelFit:
    """A fit with the share of independent values that its best position leaves."""
    return ModelFit(found, position, independent_share(costs.residuals(position[np.newaxis])[0]))


def fit_kano(costs: PositionCosts) -> ModelFit:
    """Fit Kano's valve, whose stem moves on with OP: rows of (S, J / S, 0, start)."""
    swing = float(np.ptp(costs.op))
    S, zero = np.geomspace(0.04 * swing, swing, 32), np.zeros(1)
    found = costs.evaluate(combinations(S, np.linspace(0.0, 1.0, 6), zero, zero))
    large = costs.evaluate(combinations(S[0.3 * swing < S], np.array([0.2, 0.6]), zero, np.array([-0.6, 0.6])))
    found = pattern_search(costs.evaluate, joined(found, large), KANO_STEPS, swing, diagonal=True)
    return model_fit(costs, found, costs.positions(np.array([found.best]))[0])


def fit_stenman(costs: PositionCosts) -> ModelFit:
    r"""Fit Stenman's valve: rows of (d, 1, 1, start) [stenman2003; srinivasan2008, eq. 4].

    Its :math:`d` is eq. 5 repaired with :math:`sb = sj = d` and :math:`r = \infty`: the stem breaks away when OP is
    more than d from it, slips to OP, and rests again at once. Kano's with S = J = d then moves on with OP until OP
    turns or stops.
    """
    swing = float(np.ptp(costs.op))
    d, one = np.geomspace(0.04 * swing, swing, 300), np.ones(1)
    found = costs.evaluate(combinations(d, one, one, np.linspace(-0.9, 0.9, 10)))
    found = pattern_search(costs.evaluate, found, STENMAN_STEPS, swing)
    for d, _, _, start in found.local_minima(4, 0.002, 0.0):
        around = d * np.exp(np.linspace(-0.03, 0.03, 241))
        found = joined(found, costs.evaluate(combinations(around, one, one, np.array([start]))))
    found = pattern_search(costs.evaluate, found, STENMAN_STEPS[3:], swing)
    return model_fit(costs, found, costs.positions(np.array([found.best]))[0])


KANO_STEPS, STENMAN_STEPS = halved_steps(0.05, 0.15, 0.3, 10), halved_steps(0.006, 0.0, 0.1, 40)
"""Pattern searches: steps in ln S, in J / S and in the start, and candidates refined [-]."""
CHI_SQUARE = 3.84
"""95 % point of chi-square with one degree of freedom [-]."""


def likely_candidates(cost: NDArray[np.float64], share: float) -> NDArray[np.bool_]:
    """Which valves lie in the 95 % likelihood region of one parameter, shape (n_valves,)."""
    return share * (cost - cost.min()) < CHI_SQUARE


def likely_range(values: NDArray[np.float64], likely: NDArray[np.bool_], margin: float) -> tuple[float, float]:
    """Ends of a parameter among the likely valves, wider by a margin, at least 0 [unit of the values]."""
    return max(float(values[likely].min()) - margin, 0.0), float(values[likely].max()) + margin


def independent_share(residual: NDArray[np.float64]) -> float:
    r"""Share of the samples of a residual about zero that are independent [-].

    It is :math:`1 / (1 + 2 \sum_k \rho_k)`, with the autocorrelation up to its first zero.

    Examples
    --------
    >>> white = np.random.default_rng(0).normal(size=5000)
    >>> round(independent_share(white), 1), round(independent_share(np.repeat(white, 5)), 1)
    (1.0, 0.2)
    """
    acf = lagged_products(residual, residual, residual.size)
    if not acf[0] > 0.0:
        return 1.0
    negative = np.flatnonzero(acf <= 0.0)
    positive = acf[1 : negative[0] if negative.size else residual.size]
    return 1.0 / (1.0 + 2.0 * float(positive.sum()) / float(acf[0]))
