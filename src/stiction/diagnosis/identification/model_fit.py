"""What the searches of all valve models share: costs, fits, independent samples, intervals, and Kano's valve."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from stiction.diagnosis.identification.candidates import combinations, joined, pattern_search

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.candidates import Candidates

__all__ = [
    "ModelFit",
    "PositionCosts",
    "fit_kano",
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
    """Fit Kano's valve, whose stem moves on with OP.

    Parameters
    ----------
    costs : PositionCosts
        The record.

    Returns
    -------
    ModelFit
        Rows of (S, J / S, 0, start).
    """
    swing = float(np.ptp(costs.op))
    S, zero = np.geomspace(0.04 * swing, swing, 32), np.zeros(1)
    found = costs.evaluate(combinations(S, np.linspace(0.0, 1.0, 6), zero, zero))
    large = costs.evaluate(combinations(S[0.3 * swing < S], np.array([0.2, 0.6]), zero, np.array([-0.6, 0.6])))
    found = pattern_search(costs.evaluate, joined(found, large), STEPS, swing, diagonal=True)
    return model_fit(costs, found, costs.positions(np.array([found.best]))[0])


STEPS = (
    (0.05, 0.15, 0.3, 10), (0.025, 0.08, 0.15, 8), (0.012, 0.04, 0.08, 6), (0.006, 0.02, 0.04, 4),
    (0.003, 0.01, 0.02, 3), (0.0015, 0.005, 0.01, 2),
)  # fmt: skip
"""Pattern searches: steps in ln S, in J / S and in the start, and candidates refined [-]."""


def likely_candidates(fit: ModelFit, *, chi_square: float = 3.84) -> NDArray[np.bool_]:
    """Which valves lie in the likelihood region of one parameter, 95 % at the default, shape (n_valves,)."""
    return fit.share * (fit.found.cost - fit.cost) < chi_square


def likely_range(values: NDArray[np.float64], likely: NDArray[np.bool_], margin: float) -> tuple[float, float]:
    """Ends of a parameter among the likely valves, wider by a margin, at least 0 [unit of the values]."""
    return max(float(values[likely].min()) - margin, 0.0), float(values[likely].max()) + margin


def independent_share(residual: NDArray[np.float64]) -> float:
    r"""Share of the samples of a residual that are independent.

    Parameters
    ----------
    residual : ndarray, shape (n_samples,)
        Residual about zero [any unit].

    Returns
    -------
    float
        :math:`1 / (1 + 2 \sum_k \rho_k)`, with the autocorrelation up to its first zero [-].

    Examples
    --------
    >>> white = np.random.default_rng(0).normal(size=5000)
    >>> round(independent_share(white), 1), round(independent_share(np.repeat(white, 5)), 1)
    (1.0, 0.2)
    """
    spectrum = np.fft.rfft(residual, 2 * residual.size)
    acf = np.fft.irfft(spectrum.real**2 + spectrum.imag**2)[: residual.size]
    if not acf[0] > 0.0:
        return 1.0
    negative = np.flatnonzero(acf <= 0.0)
    positive = acf[1 : negative[0] if negative.size else residual.size]
    return 1.0 / (1.0 + 2.0 * float(positive.sum()) / float(acf[0]))
