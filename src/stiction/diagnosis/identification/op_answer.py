"""Whether PV answers OP at all: the best of some first-order answers, and the best with the wrong sign."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["OpAnswer", "find_answer"]

LAGS, DELAYS = (0.0, 2.0, 5.0, 12.0, 30.0), (1, 2, 3, 5, 8, 12)
"""Time constants and dead times of the answers [samples]."""
GONE = 15.0
"""Time constants after which an answer has gone [-]."""
MIN_OWN = 1e-6
"""Share of an answer that what is known beside it must leave [-]."""

OpAnswer = tuple[float, float]
"""Twice the log likelihood ratio of the best answer with the sign that the controller expects, and of the best one with
the other sign, over none [-]. A stem that does not move has either by chance."""


def answers(op: NDArray[np.float64], first: int) -> NDArray[np.float64]:
    """First-order answers to OP from sample `first` on, shape (n_answers, n_samples - first)."""
    away = op - op[0]
    padded = np.zeros(max(DELAYS) + op.size)
    found = []
    for lag in LAGS:
        padded[max(DELAYS) :] = np.convolve(away, first_order(lag))[: op.size]
        found += [padded[max(DELAYS) - delay + first : padded.size - delay].copy() for delay in DELAYS]
    return np.array(found)


def first_order(lag: float) -> NDArray[np.float64]:
    """Answer of a first-order lag to an impulse, until it has gone [-]; `lag` in samples.

    Examples
    --------
    >>> first_order(0.0), first_order(2.0)[:2].round(3), round(float(first_order(2.0).sum()), 4)
    (array([1.]), array([0.393, 0.239]), 1.0)
    """
    if lag == 0.0:
        return np.ones(1)
    kept = math.exp(-1.0 / lag)
    return (1.0 - kept) * kept ** np.arange(math.ceil(GONE * lag))


def find_answer(
    tried: NDArray[np.float64], target: NDArray[np.float64], known: NDArray[np.float64], action: float
) -> OpAnswer:
    """Fit each answer beside what is known.

    Parameters
    ----------
    tried : array
        Answers to OP, shape (n_answers, n_samples).
    target : array
        PV, shape (n_samples,).
    known : array
        Orthonormal rows that explain PV without OP, shape (n_known, n_samples).
    action : float
        Sign of the answer that the controller expects; 0 when unknown [-].

    Returns
    -------
    OpAnswer
        Evidence with the expected sign and with the other.

    Examples
    --------
    >>> op = np.random.default_rng(1).normal(size=400)
    >>> pv = np.r_[0.0, 0.0, 0.0, op[:-3]] + np.random.default_rng(2).normal(size=400)
    >>> right, wrong = find_answer(answers(op, 12), pv[12:], np.full((1, 388), 388**-0.5), 1.0)
    >>> right > 200.0 > 30.0 > wrong
    True
    """
    left = target - (known @ target) @ known
    own = tried - (tried @ known.T) @ known
    size = np.einsum("ij,ij->i", own, own)
    usable = size > MIN_OWN * np.einsum("ij,ij->i", tried, tried)
    product = own @ left
    share = np.where(usable, product**2 / np.maximum(size, 1e-300) / max(float(left @ left), 1e-300), 0.0)
    evidence = -target.size * np.log1p(-np.minimum(share, 1.0 - 1e-9)) * np.sign(product) * (action or 1.0)
    return float(max(evidence.max(), 0.0)), float(max(-evidence.min(), 0.0))
