"""Plan the valve tests for a repair: before it, to confirm the stiction; after it, to accept the valve.

Before: the test of the diagnosis (`Diagnosis.valve_test`), and a staircase over twice S up and down with steps of about
S / 10, with one larger step that the stem should ignore and one that it should follow. After: a staircase that is fine
enough to measure the acceptance limit, 1 % or half of a small S. The step sizes are those of ISA-75.25.01, recalled.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stiction.compensation.repair import residual_stiction
from stiction.errors import require_finite, require_positive
from stiction.simulation.step_plan import plan_step_test

if TYPE_CHECKING:
    from stiction.simulation.valve_test_plan import TestPlan

__all__ = ["acceptance_criteria", "plan_acceptance_test", "plan_staircase"]

STEP_SIZES_PERCENT = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
"""Steps of a valve test [% of span]."""
MAX_STAIRCASE_S_PERCENT = 16.0
"""Largest S for which a staircase of twice S is planned [% of span]."""
FINE_STEPS_PERCENT, FINE_STEP_COUNT = (0.02, 0.05, 0.1), 20
"""Step sizes of an acceptance staircase [% of span], about a tenth of the limit, and number of steps each way [-]."""
CUSTOMARY_LIMIT_PERCENT = sum(residual_stiction(math.inf))
"""Limit on deadband plus resolution after the repair of a valve with a large or unknown S [% of span]."""


def plan_staircase(op: float, S: float) -> TestPlan | None:
    """Plan the staircase that measures a deadband plus stickband `S` near the OP `op`; None for an S above 16 %.

    `op`: usual OP of the loop [% of span]; moved if the test would leave the span. `S`: largest expected deadband plus
    stickband [% of span]. Raises ParameterError when `op` is not a number or `S` not positive.

    References
    ----------
    isa75_25_01, recalled.

    Examples
    --------
    >>> steps = plan_staircase(50.0, 4.0)
    >>> steps.settings["fine_step"], steps.settings["sizes"], plan_staircase(50.0, 20.0)
    (0.2, [2.0, 5.0], None)
    """
    op, S = require_finite("op", op, "% of span"), require_positive("S", S, "% of span")
    if S > MAX_STAIRCASE_S_PERCENT:
        return None
    fine = max(size for size in STEP_SIZES_PERCENT[:3] if size <= max(0.1 * S, STEP_SIZES_PERCENT[0]))
    reach = fine * math.ceil(round(2.0 * S / fine, 6))
    ignored = max((size for size in STEP_SIZES_PERCENT if size < 0.8 * S), default=STEP_SIZES_PERCENT[0])
    followed = min(size for size in STEP_SIZES_PERCENT if size >= 1.2 * S)
    return plan_step_test(
        _centre_within_span(op, max(reach, followed)), fine_step=fine, fine_range=reach, sizes=(ignored, followed)
    )


def plan_acceptance_test(op: float, S: float = math.inf) -> TestPlan:
    """Plan the step test of a repaired valve near the OP `op`, with `S` before the repair [% of span].

    Examples
    --------
    >>> plan = plan_acceptance_test(50.0)
    >>> plan.settings["fine_step"], plan.settings["sizes"], plan_acceptance_test(50.0, S=0.6).settings["fine_step"]
    (0.1, [0.5, 1.0, 2.0, 5.0], 0.02)
    """
    fine = max(
        (size for size in FINE_STEPS_PERCENT if size <= sum(residual_stiction(S)) / 10.0), default=FINE_STEPS_PERCENT[0]
    )
    return plan_step_test(
        _centre_within_span(require_finite("op", op, "% of span"), 5.0),
        fine_step=fine,
        fine_range=round(FINE_STEP_COUNT * fine, 6),
    )


def acceptance_criteria(S: float = math.inf) -> tuple[str, ...]:
    """Return the acceptance criteria for a valve with `S` before the repair [% of span].

    Examples
    --------
    >>> acceptance_criteria()[0]
    'deadband plus stickband, S, at most 1 % of span (customary limit)'
    """
    limit, why = sum(residual_stiction(S)), "customary limit"
    if limit < CUSTOMARY_LIMIT_PERCENT:
        usual = f"{CUSTOMARY_LIMIT_PERCENT:g} %"
        why = f"half of S before the repair, less than the customary {usual}; analyse with --limit {limit:.2g}"
    return (
        f"deadband plus stickband, S, at most {limit:.2g} % of span ({why})",
        "overshoot at most 20 % of the step (customary limit)",
        "T86 of the 2 and 5 % steps within the maker's figure for this size of valve",
    )


def _centre_within_span(op: float, upset: float) -> float:
    """Return the OP closest to `op` at which a test that moves OP by `upset` stays within the span, in whole %."""
    return float(min(max(round(op), math.ceil(upset)), 100 - math.ceil(upset)))
