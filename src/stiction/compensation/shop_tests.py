"""The tests that go with a repair: before, to confirm what was found; after, to accept the valve.

Before: ramps over four times S, so that the stem slips in both directions, and a staircase whose steps are about a
tenth of S over twice S up and down, with two larger steps, one that the stem should ignore and one that it should
follow. After: a staircase fine enough to read what a repair may leave: 1 %, or half of an S below twice that. The sizes
follow from S; the times are those of the field (0.01 to 0.07 %/s for a span of 10 %), the step sizes those of
ISA-75.25.01, after recollection of both.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stiction.compensation.repair import kept
from stiction.errors import require_finite, require_positive
from stiction.valvetests import plan_ramp_test, plan_step_test

if TYPE_CHECKING:
    from stiction.valvetests.plan import TestPlan

__all__ = ["acceptance", "plan_acceptance", "plan_before"]

SIZES = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
"""Steps of a valve test [% of span]."""
RAMP_TIMES = (200.0, 800.0)
"""Time of one ramp, fast and slow [s]."""
LARGEST = 16.0
"""S beyond which no staircase of twice S is planned [% of span]."""
FINE, STEPS = (0.02, 0.05, 0.1), 20
"""Steps of a staircase that reads a limit [% of span], about ten to the limit, and their number each way [-]."""
USUAL = sum(kept(math.inf))
"""What a repair may leave of a valve whose S is large or not known, deadband and resolution together [% of span]."""


def plan_before(op: float, S: float) -> tuple[TestPlan, ...]:
    """Plan the tests that confirm a deadband plus stickband `S` about the OP `op`.

    Parameters
    ----------
    op : float
        Usual OP of the loop [% of span]; moved where the test would leave the span.
    S : float
        Largest deadband plus stickband expected [% of span].

    Returns
    -------
    tuple of TestPlan
        Ramp test and step test; above an S of 16 % the ramp test over the whole span only.

    Raises
    ------
    ParameterError
        When `op` is not a number or `S` not positive.

    References
    ----------
    isa75_25_01, after; srinivasan2008, section III: ramps of 10 % in 150 to 1000 s.

    Examples
    --------
    >>> ramp, steps = plan_before(50.0, 4.0)
    >>> ramp.settings["rates"], steps.settings["fine_step"], steps.settings["sizes"]
    ([0.08, 0.02], 0.2, [2.0, 5.0])
    """
    op, S = require_finite("op", op, "% of span"), require_positive("S", S, "% of span")
    if S > LARGEST:
        return (plan_ramp_test(0.0, 100.0, rates=[100.0 / time for time in RAMP_TIMES], start=_room(op, 0.0)),)
    half = max(math.ceil(20.0 * S) / 10.0, 2.0)
    centre = _room(op, half)
    low, high = round(centre - half, 1), round(centre + half, 1)
    rates = [round((high - low) / time, 9) for time in RAMP_TIMES]
    ramp = plan_ramp_test(low, high, rates=rates, start=centre, S=S)
    fine = max(size for size in SIZES[:3] if size <= max(0.1 * S, SIZES[0]))
    reach = fine * math.ceil(round(2.0 * S / fine, 6))
    ignored = max((size for size in SIZES if size < 0.8 * S), default=SIZES[0])
    followed = min(size for size in SIZES if size >= 1.2 * S)
    steps = plan_step_test(_room(op, max(reach, followed)), fine_step=fine, fine_range=reach, sizes=(ignored, followed))
    return ramp, steps


def plan_acceptance(op: float, S: float = math.inf) -> TestPlan:
    """Plan the step test of a repaired valve about the OP `op`, `S` as found [% of span]: fine steps, then up to 5 %.

    Examples
    --------
    >>> plan = plan_acceptance(50.0)
    >>> plan.settings["fine_step"], plan.settings["sizes"], plan_acceptance(50.0, S=0.6).settings["fine_step"]
    (0.1, [0.5, 1.0, 2.0, 5.0], 0.02)
    """
    fine = max((size for size in FINE if size <= sum(kept(S)) / 10.0), default=FINE[0])
    return plan_step_test(
        _room(require_finite("op", op, "% of span"), 5.0), fine_step=fine, fine_range=round(STEPS * fine, 6)
    )


def acceptance(S: float = math.inf) -> tuple[str, ...]:
    """Say what an accepted valve keeps, whose `S` was found [% of span].

    Examples
    --------
    >>> acceptance()[0]
    'deadband plus stickband, S, at most 1 % of span (the customary limit of EnTech 1998, after recollection)'
    """
    limit, source = sum(kept(S)), "EnTech 1998, after recollection"
    why = f"the customary limit of {source}"
    if limit < USUAL:
        why = f"half of what was found: the customary {USUAL:g} % would leave more of it; read with --limit {limit:.2g}"
    return (
        f"deadband plus stickband, S, at most {limit:.2g} % of span ({why})",
        f"overshoot at most 20 % of the step ({source})",
        "T86 of the 2 and 5 % steps within the maker's figure for this size of valve",
    )


def _room(op: float, upset: float) -> float:
    """The OP moved as little as it takes for a test of `upset` to stay within the span, to the nearest percent."""
    return float(min(max(round(op), math.ceil(upset)), 100 - math.ceil(upset)))
