r"""Intervals of the results of a ramp test: scatter from slip to slip, and systematic errors.

The scatter comes from a jackknife: each slip with its rows is left out in turn (cluster-robust covariance CR3), with
Student's factor for the few slips of a test. Systematic errors, the same in every slip, are not in it:

- the grain of the record: OP goes on by an increment from sample to sample, and signals are rounded;
- the slide: OP moves on while the stem slips, so the stem stops later and its jump is larger;
- the delay: a flow reacts after a lag and a dead time, while OP moves on. At a single rate this looks like friction.
  The time of the flow for 86 % of a slip, two time constants, covers the lag and a dead time of the same length.

They are added to the scatter linearly, not in squares: repeating the ramp does not reduce them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.valvetests.result import Estimate

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["SystematicError", "make_estimate", "slip_covariance"]

INTERVAL_QUANTILE = 0.975
"""Probability below the upper end of a 95 % interval [-]."""


@dataclass(frozen=True, slots=True)
class SystematicError:
    """Systematic error of all slips."""

    grain: float
    """Half an increment of OP, and half a step of rounding [% of span]."""
    slide: float
    """OP travel during the visible part of a slip [% of span]."""
    late: float
    """Largest OP travel by which a slip is visible late; 0 with several rates or a measured position [% of span]."""
    trail: float
    """Largest OP travel by which a flow lags a stem that follows; 0 with several rates or a measured position
    [% of span]."""
    flow: bool
    """Whether the stem is read from a flow, whose lag can hide a part of a jump."""

    def bounds(self, name: str) -> tuple[float, float]:
        """Largest error of `name` (below, above) its value [% of span].

        `behind` is the distance from the frictionless line after a jump, `follow` the distance while following, `S`
        the sum of sb and `behind`.
        """
        grain, slide, late = self.grain, self.slide, self.late
        return {
            "sb": (grain + late, grain),
            "sj": (grain + slide, grain + slide * self.flow + self.trail),
            "S": (grain + 2.0 * late, grain + slide),
            "behind": (grain + late + self.trail, grain + slide),
            "follow": (grain + slide + self.trail, grain + slide),
        }[name]


def slip_covariance(
    slip: NDArray[np.int64], design: NDArray[np.float64], target: NDArray[np.float64], best: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Covariance of the least-squares solution `best` over slips, shape (n_columns, n_columns).

    Rows of one slip have the same number in `slip` (n_rows,) and a common error.
    """
    inverse = np.linalg.pinv(design.T @ design, hermitian=True)
    miss = target - design @ best
    total = np.zeros_like(inverse)
    members = np.unique(slip)
    for member in members:
        rows = design[slip == member]
        left = np.eye(len(rows)) - rows @ inverse @ rows.T
        without = inverse @ rows.T @ np.linalg.pinv(left, rcond=1e-9, hermitian=True) @ miss[slip == member]
        total += np.outer(without, without)
    return total * (members.size - 1.0) / max(members.size, 1)


def make_estimate(
    value: float, variance: float, readings: NDArray[np.float64], slips: int, doubt: tuple[float, float]
) -> Estimate:
    """Value [% of span] with its 95 % interval: Student's factor for `slips`, and the `doubt` below and above."""
    from scipy.special import stdtrit

    n = int(readings.size)
    spread = float(readings.std(ddof=1)) if n > 1 else math.nan
    if n < 3 or slips < 2:
        return Estimate(value, math.nan, math.nan, spread, n)
    half = float(stdtrit(slips - 1.0, INTERVAL_QUANTILE)) * math.sqrt(max(variance, 0.0))
    return Estimate(value, value - half - doubt[0], value + half + doubt[1], spread, n)
