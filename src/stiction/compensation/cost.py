"""Cost of a remedy: a weighted mean of its performance relative to doing nothing, which costs 1."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.compensation.run_trials import METRICS
from stiction.errors import ParameterError, require_not_negative

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

__all__ = ["WEIGHTS", "check_weights", "cost"]

WEIGHTS = {
    "pv_std": 1.0,
    "iae": 0.5,
    "offset": 0.25,
    "travel": 0.05,
    "reversals": 0.05,
    "op_travel": 0.02,
    "sp_step": 0.25,
    "load_step": 0.25,
    "errors": 0.5,
}
"""Default weights [-]. Wear counts little: a remedy may move the stem ten times as far as the loop does now."""


def check_weights(weights: Mapping[str, float] | None) -> dict[str, float]:
    """Check weights and add the defaults.

    `weights`: name -> weight [-]. Returns all weights; those not given have their default. Raises ParameterError when a
    name is unknown, a weight negative, or all are 0.
    """
    given = dict(weights or {})
    unknown = [name for name in given if name not in WEIGHTS]
    if unknown:
        raise ParameterError(f"weight {unknown[0]!r} is unknown; use {', '.join(WEIGHTS)}.")
    whole = WEIGHTS | {name: require_not_negative(f"weight {name}", value) for name, value in given.items()}
    if not sum(whole.values()) > 0.0:
        raise ParameterError("all weights are 0; give at least one above 0.")
    return whole


def cost(row: NDArray[np.float64], nothing: NDArray[np.float64], worst: float, weights: Mapping[str, float]) -> float:
    """Return the cost of a remedy.

    Parameters
    ----------
    row, nothing : ndarray, shape (8,)
        `METRICS` with the remedy and with doing nothing.
    worst : float
        Largest PV deviation relative to doing nothing when S and J are wrong by 30 % [-].
    weights : mapping
        All weights [-].

    Returns
    -------
    float
        The cost [-]; 1 for doing nothing.
    """
    ratios = row / np.maximum(nothing, 1e-12)
    # An oscillating loop has almost no offset, so the offset is taken relative to the PV deviation.
    at = METRICS.index("offset")
    ratios[at] = 1.0 + (row[at] - nothing[at]) / max(nothing[METRICS.index("pv_std")], 1e-12)
    total = sum(weights[name] * ratio for name, ratio in zip(METRICS, ratios, strict=True))
    return float((total + weights["errors"] * worst) / sum(weights.values()))
