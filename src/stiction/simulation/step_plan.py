"""Plan of a step test: a fine staircase up and down for S and resolution, then larger steps for the response."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import ParameterError, require_finite, require_not_negative, require_positive, require_samples
from stiction.simulation.valve_test_plan import TestPlan

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["plan_step_test"]


def plan_step_test(
    start: float,
    *,
    fine_step: float = 0.1,
    fine_range: float = 2.0,
    sizes: float | Sequence[float] = (0.5, 1.0, 2.0, 5.0),
    hold: float = 30.0,
    dt: float = 1.0,
) -> TestPlan:
    """Plan OP steps about `start`.

    Parameters
    ----------
    start : float
        OP before, amid and after the test [% of span].
    fine_step : float
        Step of the staircase [% of span]: S and resolution are read to within one such step.
    fine_range : float
        Staircase from `start` up by this much, down to as much below, and back [% of span]; make it at least twice
        the S expected. 0 leaves the staircase out.
    sizes : float or sequence of float
        Steps for the response time [% of span], each given up, down, down and up.
    hold : float
        Time at each step [s], longer than the valve needs to settle.
    dt : float
        Sampling period [s].

    Returns
    -------
    TestPlan
        The OP over time, duration and upset, with `to_csv` and `summary`.

    Raises
    ------
    ParameterError
        When a step or a time is not positive, the OP would leave 0 to 100 %, or a hold has fewer than five samples.

    Notes
    -----
    A stem rests while OP is within (S + J) / 2 of it. From the middle of this band a `fine_range` of R moves it when
    R > (S + J) / 2, from anywhere when 2 R > S + J, which is the same R. From the top of the staircase, 2 R down, the
    reversal takes up to S + J and the resolution J more: both are read when R > S / 2 + J.

    References
    ----------
    isa75_25_01: baseline, small-step and response-time tests, after recollection of the standard.

    Examples
    --------
    >>> import stiction as st
    >>> plan = st.plan_step_test(50.0, fine_step=0.1, fine_range=1.0, sizes=[2.0], hold=10.0)
    >>> float(plan.op.min()), float(plan.op.max()), plan.duration
    (48.0, 52.0, 450.0)
    """
    start = require_finite("start", start, "% of span")
    fine_step, fine_range = (
        require_positive("fine_step", fine_step, "%"),
        require_not_negative("fine_range", fine_range, "%"),
    )
    steps = [require_positive("size", size, "% of span") for size in np.atleast_1d(sizes).tolist()]
    hold, dt = require_positive("hold", hold, "s"), require_positive("dt", dt, "s")
    samples = round(hold / dt)
    if samples < 5:
        raise ParameterError(f"hold = {hold:g} s is {samples} samples of {dt:g} s; give 5 samples or more.")
    if not steps and fine_range < fine_step:
        raise ParameterError("The plan has no step; give sizes, or a fine_range of one fine_step or more.")
    require_samples("the steps together", (4.0 * fine_range / fine_step + 4.0 * len(steps)) * hold, dt)
    n = round(fine_range / fine_step)
    stairs = [*range(1, n + 1), *range(n - 1, -n - 1, -1), *range(-n + 1, 1)] if n else []
    levels = [start, *(start + fine_step * k for k in stairs)]
    for size in steps:
        levels += [start + size, start, start - size, start]
    upset = max([n * fine_step, *steps])
    if start - upset < 0.0 or start + upset > 100.0:
        raise ParameterError(
            f"start = {start:g} % with steps of up to {upset:g} % would leave 0 to 100 %; give another start or "
            "smaller steps."
        )
    listed = ", ".join(f"{size:g}" for size in steps)
    notes = (
        f"Staircase of {fine_step:g} % steps over {n * fine_step:g} % up and down, then steps of {listed or 'no'} %, "
        f"each constant for {hold:g} s.",
        "The OP travel from a reversal to the first response (dead band of ISA) lies between S and S + J, because the "
        "stem can reverse anywhere in the stick band; the staircase measures S too.",
        "Steps cannot measure the rate r at which the stem starts to follow OP; use a ramp test for r.",
    )
    if n:
        reach = n * fine_step
        notes = (
            *notes,
            f"A fine range of {reach:g} % may not move a stem whose (S + J) / 2 is {reach:g} % or more; for such a "
            "valve "
            "give a wider fine range (--fine-range).",
        )
    settings = {"start": start, "fine_step": fine_step, "fine_range": fine_range, "sizes": steps, "hold": hold}
    return TestPlan("step test", dt, np.repeat(np.round(levels, 9), samples), start, upset, notes, settings)
