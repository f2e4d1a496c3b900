"""Scores of verdicts against the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.verdict.decision import Costs, decide

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Scores", "calibration_error", "interval_coverage", "reliability", "risk_coverage", "scores"]


@dataclass(frozen=True, slots=True)
class Scores:
    """How good verdicts are."""

    loops: int
    """Loops judged."""
    auc: float
    """Area under the curve of sticky loops recognised over false alarms [-]."""
    brier: float
    """Mean squared error of the probability, sticky loops weighing as the prior says [-]."""
    calibration_error: float
    """Mean distance of probability and share of sticky loops over ten bins of equal weight [-]."""
    undecided: float
    """Share of the loops left undecided, weighed [-]."""
    right: float
    """Share of the decided loops that are right, weighed [-]."""
    found: float
    """Share of the sticky loops called `stiction` [-]."""
    false_alarms: float
    """Share of the good loops called `stiction`, weighed [-]."""


def weights_of(sticky: NDArray[np.bool_], prior: float) -> NDArray[np.float64]:
    """Weights with which the sticky loops make up the share `prior`, mean 1, shape (n_loops,); 1 of one kind alone."""
    share = float(sticky.mean())
    if share in (0.0, 1.0):
        return np.ones(sticky.size)
    return np.where(sticky, prior / share, (1.0 - prior) / (1.0 - share))


def scores(
    sticky: NDArray[np.bool_],
    probability: NDArray[np.float64],
    prior: float = 0.25,
    costs: Costs | None = None,
    *,
    weights: NDArray[np.float64] | None = None,
) -> Scores:
    """Score probabilities and the verdicts that follow from them.

    Parameters
    ----------
    sticky : ndarray of bool, shape (n_loops,)
        Whether the valve of each loop sticks.
    probability : ndarray, shape (n_loops,)
        Probability of stiction at `prior` [-].
    prior : float
        Share of sticky valves for which is scored [-].
    costs : Costs, optional
        Costs of wrong calls.
    weights : ndarray, shape (n_loops,), optional
        Weights of the loops [-]; by default such that sticky loops make up `prior`, all others being equal.

    Returns
    -------
    Scores
        The scores.
    """
    from sklearn.metrics import roc_auc_score

    weights = weights_of(sticky, prior) if weights is None else weights
    calls = np.array([decide(float(p), costs or Costs()) for p in probability])
    decided = calls != "undecided"
    right = np.where(sticky, calls == "stiction", calls == "no_stiction")
    return Scores(
        loops=sticky.size,
        auc=float(roc_auc_score(sticky, probability, sample_weight=weights))
        if 0 < sticky.sum() < sticky.size
        else np.nan,
        brier=float(np.average((probability - sticky) ** 2, weights=weights)),
        calibration_error=calibration_error(sticky, probability, weights),
        undecided=float(np.average(~decided, weights=weights)),
        right=float(np.average(right[decided], weights=weights[decided])),
        found=float(np.mean(calls[sticky] == "stiction")) if sticky.any() else np.nan,
        false_alarms=float(np.average(calls[~sticky] == "stiction", weights=weights[~sticky]))
        if not sticky.all()
        else np.nan,
    )


def reliability(
    sticky: NDArray[np.bool_], probability: NDArray[np.float64], weights: NDArray[np.float64], bins: int = 10
) -> NDArray[np.float64]:
    """Mean probability, share of sticky loops and weight of bins of equal weight, shape (n_bins, 3)."""
    order = np.argsort(probability, kind="stable")
    total = np.cumsum(weights[order])
    place = np.minimum((total - 0.5 * weights[order]) / total[-1] * bins, bins - 1e-9).astype(int)
    rows = []
    for k in range(bins):
        inside = order[place == k]
        if inside.size:
            w = weights[inside]
            rows.append((np.average(probability[inside], weights=w), np.average(sticky[inside], weights=w), w.sum()))
    return np.array(rows)


def calibration_error(
    sticky: NDArray[np.bool_], probability: NDArray[np.float64], weights: NDArray[np.float64]
) -> float:
    """Mean distance of probability and share of sticky loops over ten bins of equal weight [-]."""
    rows = reliability(sticky, probability, weights)
    return float(np.average(np.abs(rows[:, 0] - rows[:, 1]), weights=rows[:, 2]))


def risk_coverage(
    sticky: NDArray[np.bool_], probability: NDArray[np.float64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Share of loops decided and share of these that are wrong, the surest loops first, shape (n_loops, 2)."""
    order = np.argsort(-np.abs(probability - 0.5), kind="stable")
    w = weights[order]
    wrong = (probability[order] > 0.5) != sticky[order]
    return np.column_stack([np.cumsum(w) / w.sum(), np.cumsum(w * wrong) / np.cumsum(w)])


def interval_coverage(
    S: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[float, float]:
    """Share of intervals that hold the true S, and the median width over S [-]."""
    return float(np.mean((low <= S) & (high >= S))), float(np.median((high - low) / S))
