"""The valve tests that confirm a finding: made once for a loop; next step, work list and work order show the same."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stiction.errors import require_finite, require_positive
from stiction.simulation.ramp_plan import plan_ramp_test
from stiction.simulation.step_plan import plan_step_test

if TYPE_CHECKING:
    from stiction.simulation.valve_test_plan import TestPlan

__all__ = ["plan_confirming_ramp", "plan_confirming_step"]

RANGE_PER_S = 3.0
"""Range of the ramps over S [-]: the stem slips in both directions, and S and J are read."""
MIN_HALF_RANGE = 1.5
"""Smallest departure of the ramps from the usual OP [% of span]."""
MIN_RAMP_S, SETTLING_TIMES = 200.0, 5.0
"""Shortest time of one ramp [s], and time of one ramp over that in which the process settles [-]."""


def plan_confirming_ramp(
    op: float, S: float, *, S_high: float = 0.0, settling: float = 0.0, dt: float = 1.0
) -> TestPlan:
    """Plan the ramp up and down that shows whether a valve has the deadband plus stickband `S`.

    Parameters
    ----------
    op : float
        Usual OP [% of span]; the ramps are moved where they would leave the span.
    S : float
        Deadband plus stickband [% of span].
    S_high : float
        Upper end of its interval [% of span]; the range is at least twice this, up to twice S.
    settling : float
        Time in which the process settles [s]; without a valve position PV has to follow the ramp.
    dt : float
        Sampling period [s].

    Returns
    -------
    TestPlan
        The test; it starts and ends at the usual OP.

    Raises
    ------
    ParameterError
        When `op` is not a number, or `S` or `dt` is not positive.

    References
    ----------
    srinivasan2008, section III: ramps of 10 % in 150 to 1000 s.

    Examples
    --------
    >>> plan = plan_confirming_ramp(50.0, 4.0)
    >>> plan.settings["low"], plan.settings["high"], plan.settings["rates"]
    (44.0, 56.0, [0.06])
    """
    op, S = require_finite("op", op, "% of span"), require_positive("S", S, "% of span")
    wanted = max(0.5 * RANGE_PER_S * S, min(S_high, 2.0 * S), MIN_HALF_RANGE)
    half = min(math.ceil(10.0 * wanted - 1e-9) / 10.0, 50.0)
    centre = _within_span(op, half)
    low, high = max(round(centre - half, 1), 0.0), min(round(centre + half, 1), 100.0)
    time = max(MIN_RAMP_S, SETTLING_TIMES * settling, 20.0 * require_positive("dt", dt, "s"))
    rate = (high - low) / time
    digits = 2 - math.floor(math.log10(rate))
    rate = math.floor(rate * 10.0**digits) / 10.0**digits
    return plan_ramp_test(low, high, rates=[rate], start=centre, dt=dt)


def plan_confirming_step(op: float, size: float, *, settling: float = 0.0, dt: float = 1.0) -> TestPlan:
    """Plan a step of OP each way that shows whether the valve follows.

    `op`: usual OP [% of span]. `size`: step [% of span]. `settling`: time at each step [s], at least ten samples. `dt`:
    sampling period [s]. Raises ParameterError when one is outside its limits.

    Examples
    --------
    >>> plan = plan_confirming_step(50.0, 2.0, settling=30.0)
    >>> plan.upset, plan.duration
    (2.0, 150.0)
    """
    hold = float(math.ceil(max(settling, 10.0 * dt)))
    return plan_step_test(_within_span(op, size), fine_range=0.0, sizes=[size], hold=hold, dt=dt)


def _within_span(op: float, upset: float) -> float:
    """Closest OP to `op` at which a test that moves OP by `upset` stays within the span [% of span]."""
    return round(min(max(op, upset), 100.0 - upset), 1)
