"""The response to one step: dead time, T63, T86, T98 and overshoot."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["measure_response"]

T86_SHARE = 1.0 - math.exp(-2.0)
"""Share of the response at T86, two time constants of a first-order response [-]."""
T63_SHARE = 1.0 - math.exp(-1.0)
"""Share of the response at T63, one time constant of a first-order response [-]."""


def measure_response(
    time: NDArray[np.float64], stem: NDArray[np.float64], begin: float, before: float, after: float, sigma: float
) -> tuple[float, float, float, float, float]:
    """Return (dead time, T63, T86, T98, overshoot) of one step, NaN where the noise hides them.

    `time`, `stem`, of shape (n_hold + 1,): times [s] and stem from the last sample before the step to the end of the
    hold. `begin`: time of the step [s]. `before`, `after`: stem at rest before and at the end [unit of the stem].
    `sigma`: noise and rounding of the stem [its unit].
    """
    travel = after - before
    done = (stem - before) / travel
    doubt = 3.0 * sigma / abs(travel)
    if doubt > 1.0 - T63_SHARE:
        return math.nan, math.nan, math.nan, math.nan, math.nan
    lead = _time_of_level(time, done, max(doubt, 0.01), begin) - begin
    t63, t86 = (
        _time_of_level(time, done, T63_SHARE, begin) - begin,
        _time_of_level(time, done, T86_SHARE, begin) - begin,
    )
    t98 = _time_of_level(time, done, 0.98, begin) - begin if doubt <= 0.02 else math.nan
    over = float(done.max()) - 1.0
    return lead, t63, t86 if doubt <= 1.0 - T86_SHARE else math.nan, t98, 100.0 * over if over > doubt else 0.0


def _time_of_level(time: NDArray[np.float64], done: NDArray[np.float64], level: float, begin: float) -> float:
    """Return the first time after the step at which `done` reaches `level`, on the straight line between samples.

    A response within the sample of the step counts from that sample on: 0 s means less than a sample.
    """
    above = np.flatnonzero(done >= level)
    if above.size == 0:
        return math.nan
    k = int(above[0])
    if k == 0:
        return begin
    part = (level - done[k - 1]) / (done[k] - done[k - 1])
    return max(float(time[k - 1] + part * (time[k] - time[k - 1])), begin)
