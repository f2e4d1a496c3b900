r"""Intervals of what a ramp test reads: the scatter from slip to slip, and what no scatter shows.

The scatter comes from a jackknife: each slip with its rows is left out in turn (cluster-robust covariance CR3), with
Student's factor for the few slips of a test. It does not hold what is wrong in every slip alike:

- the grain of the record: OP goes on by an increment from sample to sample, and signals are rounded;
- the slide: OP goes on while the stem slips, so the stem stops up to that much later than it broke loose, and its
  jump is larger;
- the lateness: a flow answers behind a lag and a dead time, and OP goes on meanwhile. At one rate that looks like
  friction. The time the flow takes for 86 % of a slip, two time constants, holds the lag and a dead time as long.

They are added to the scatter as they are, and not in squares: repeating the ramp does not make them smaller.
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
"""Chance below the upper end of an interval of 95 % [-]."""


@dataclass(frozen=True, slots=True)
class SystematicError:
    """What may be wrong in every slip alike."""

    grain: float
    """Half an increment of OP, and half a step of rounding [% of span]."""
    slide: float
    """OP travel while a slip is seen to go on [% of span]."""
    late: float
    """OP travel by which a slip may be seen late; 0 where it is told by several rates, or the stem is seen itself
    [% of span]."""
    trail: float
    """OP travel by which a flow may trail a stem that follows; 0 where it is told by several rates, or the stem is
    seen itself [% of span]."""
    flow: bool
    """Whether the stem is read from a flow, whose lag can hide a part of a jump."""

    def bounds(self, name: str) -> tuple[float, float]:
        """(below, above) the value of `name` that the truth may be [% of span].

        `behind` is the distance from the frictionless line after a jump, `follow` that of a stem that follows, `S` the
        sum of sb and `behind`.
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

    Rows of one slip share `slip` (n_rows,) and are wrong together.
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
