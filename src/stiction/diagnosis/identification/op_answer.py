"""Whether PV answers OP at all: the best of some first-order answers, and the best with the wrong sign."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["OpAnswer", "answers", "find_answer", "find_answers"]

LAGS, DELAYS = (0.0, 2.0, 5.0, 12.0, 30.0), (1, 2, 3, 5, 8, 12)
"""Time constants and dead times of the answers [samples]."""
GONE = 15.0
"""Time constants after which an answer has gone [-]."""
MIN_OWN = 1e-6
"""Share of an answer that what is known beside it must leave [-]."""

OpAnswer = tuple[float, float]
"""Twice the log likelihood ratio of the best answer with the sign that the controller expects, and of the best one with
the other sign, over none [-]. A stem that does not move has either by chance."""


def find_answers(
    op: NDArray[np.float64],
    sp: NDArray[np.float64] | None,
    target: NDArray[np.float64],
    known: tuple[NDArray[np.float64], NDArray[np.float64]],
    first: int,
    action: float,
) -> tuple[OpAnswer, OpAnswer, float]:
    """Find the answers of PV to OP beside each of two sets of orthonormal rows, and to SP beside the first set.

    `target` is PV from sample `first` of `op` and `sp` on, `known` the two sets, `action` as for `find_answer`. Only
    where the stem moves does PV follow SP; the answer to it is 0 where `sp` is None.
    """
    tried = answers(op, first)
    beside, plain = (find_answer(tried, target, rows, action) for rows in known)
    return beside, plain, 0.0 if sp is None else find_answer(answers(sp, first), target, known[0], 1.0)[0]


def answers(op: NDArray[np.float64], first: int) -> NDArray[np.float64]:
    """First-order answers to OP from sample `first` on, shape (n_answers, n_samples - first)."""
    away = op - op[0]
    padded, found = np.zeros(max(DELAYS) + op.size), []
    for lag in LAGS:
        padded[max(DELAYS) :] = np.convolve(away, first_order(lag))[: op.size]
        found += [padded[max(DELAYS) - delay + first : padded.size - delay].copy() for delay in DELAYS]
    return np.array(found)


def first_order(lag: float) -> NDArray[np.float64]:
    """Answer of a first-order lag to an impulse, until it has gone [-]; `lag` in samples."""
    if lag == 0.0:
        return np.ones(1)
    kept = math.exp(-1.0 / lag)
    return np.asarray((1.0 - kept) * kept ** np.arange(math.ceil(GONE * lag)), dtype=np.float64)


def find_answer(
    tried: NDArray[np.float64], target: NDArray[np.float64], known: NDArray[np.float64], action: float
) -> OpAnswer:
    """Fit each answer (rows of `tried`) to PV (`target`) beside the orthonormal rows that are `known`.

    `action` is the sign of the answer that the controller expects, 0 when unknown [-].
    """
    left = target - (known @ target) @ known
    own = tried - (tried @ known.T) @ known
    size = np.einsum("ij,ij->i", own, own)
    usable = size > MIN_OWN * np.einsum("ij,ij->i", tried, tried)
    product = own @ left
    share = np.where(usable, product**2 / np.maximum(size, 1e-300) / max(float(left @ left), 1e-300), 0.0)
    evidence = -target.size * np.log1p(-np.minimum(share, 1.0 - 1e-9)) * np.sign(product) * (action or 1.0)
    return float(max(evidence.max(), 0.0)), float(max(-evidence.min(), 0.0))
