"""A dead zone at fixed values of OP, as between the two valves of a split range, apart from a band that moves.

A sticky valve and a dead zone both answer only after OP has gone some way. The band of a sticky valve begins where its
stem last came to rest, wherever OP was then; a dead zone lies at the same values of OP whatever the direction. The
two look the same until the stem has turned back twice.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.regression import Regression

__all__ = ["DeadZone", "flow_outside", "search_dead_zone"]

MIN_OP_REVERSALS = 4
"""Reversals of OP from which a sticky valve and a dead zone can be told apart: each end of the range is met twice."""


@dataclass(frozen=True, slots=True)
class DeadZone:
    """The most likely dead zone at fixed values of OP."""

    low: float
    """Its lower end [% of span]."""
    high: float
    """Its upper end [% of span]."""
    op_low: float
    """Smallest OP of the record [% of span]."""
    op_high: float
    """Largest OP of the record [% of span]."""
    likelihood_ratio: float
    """Twice its log likelihood ratio over a good valve without a dead zone [-]."""
    stem_reversals: int
    """How often the stem of the most likely sticky valve turns back in the record [-]."""
    op_reversals: int
    """How often OP turns back by a quarter of its range [-]."""

    @property
    def crossed_rarely(self) -> bool:
        """Whether OP crosses its range so few times that a dead zone and a sticky valve look the same."""
        return self.op_reversals < MIN_OP_REVERSALS


def flow_outside(
    op: NDArray[np.float64], low: float | NDArray[np.float64], high: float | NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distance of OP from a dead zone, signed [% of span]; 0 inside. Ends of shape (n_zones, 1) give as many rows.

    Examples
    --------
    >>> flow_outside(np.array([44.0, 50.0, 53.0]), 46.0, 52.0).tolist()
    [-2.0, 0.0, 1.0]
    """
    return np.maximum(op - high, 0.0) + np.minimum(op - low, 0.0)


def search_dead_zone(regression: Regression) -> tuple[float, float, float]:
    """Minus twice the log likelihood of the most likely dead zone [-], and its ends [% of span]."""
    bottom, top = float(regression.op.min()), float(regression.op.max())
    centres, halves = np.linspace(bottom, top, 13)[1:-1], (top - bottom) * np.array([0.05, 0.1, 0.2, 0.3])
    best, step = (np.inf, bottom, bottom), (top - bottom) / 12.0
    for _ in range(4):
        centre, half = (axis.ravel() for axis in np.meshgrid(centres, halves))
        low, high = centre - half, centre + half
        flow = flow_outside(regression.op, low[:, np.newaxis], high[:, np.newaxis])
        cost = regression.cost_of_positions(flow.reshape(centre.size, -1, regression.per_block).mean(axis=2))
        i = int(np.argmin(np.round(cost, 5)))
        best, step = min(best, (float(cost[i]), float(low[i]), float(high[i]))), 0.5 * step
        centres = centre[i] + step * np.array([-1.0, 0.0, 1.0])
        halves = np.maximum(half[i] + 0.5 * step * np.array([-1.0, 0.0, 1.0]), 1e-3 * (top - bottom))
    return best
