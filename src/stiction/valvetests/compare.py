"""Comparison of two tests of one valve, before and after a repair."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from stiction.display.json_form import Result
from stiction.errors import ParameterError, require_kind
from stiction.valvetests.result import Estimate, ValveTest, unit_of

__all__ = ["Change", "TestComparison", "compare_tests"]


@dataclass(frozen=True, slots=True)
class Change:
    """One quantity in two tests."""

    name: str
    """Name of the quantity."""
    unit: str
    """Its unit."""
    before: Estimate
    """In the first test."""
    after: Estimate
    """In the second test."""
    change: float
    """After minus before; NaN when one is unknown."""
    verdict: Literal["smaller", "larger", "no change seen", "cannot tell"]
    """`smaller` or `larger` when the intervals do not overlap."""


@dataclass(frozen=True)
class TestComparison(Result):
    """Two tests of one valve side by side."""

    before: ValveTest
    """The first test."""
    after: ValveTest
    """The second test."""
    changes: tuple[Change, ...]
    """Every quantity of both tests."""

    __test__ = False

    def summary(self) -> str:
        """Summary of the changes in a few lines."""
        head = f"{self.before.record.tag}: {self.before.verdict} before, {self.after.verdict} after."
        rows = [
            f"{c.name}: {c.before.value:.3g} -> {c.after.value:.3g} {c.unit}, {c.verdict}"
            for c in self.changes
            if c.verdict != "cannot tell"
        ]
        lost = [c.name for c in self.changes if c.verdict == "cannot tell"]
        rows += [f"Cannot tell for: {', '.join(lost)} (unknown in one of the tests)."] if lost else []
        return "\n".join([head, *rows])


def compare_tests(before: ValveTest, after: ValveTest) -> TestComparison:
    """Compare two tests of one valve, quantity by quantity.

    Parameters
    ----------
    before, after : ValveTest
        Two ramp tests or two step tests.

    Returns
    -------
    TestComparison
        A quantity has changed when the two intervals do not overlap.

    Raises
    ------
    ParameterError
        When an argument is not a valve test, the tests differ in kind, or they were read from different signals.

    Examples
    --------
    >>> import stiction as st
    >>> plan = st.plan_ramp_test(20.0, 40.0, threshold=0.05)
    >>> old, new = (st.analyse_ramp(st.stroke(st.Srinivasan(sb, 1.0, 0.05), plan.op, 1.0)) for sb in (4.0, 2.0))
    >>> {c.name: c.verdict for c in st.compare_tests(old, new).changes}["sb"]
    'smaller'
    """
    for name, test in (("before", before), ("after", after)):
        require_kind(name, test, ValveTest, "what analyse_ramp or analyse_steps returns")
    if before.kind != after.kind:
        raise ParameterError(f"A {before.kind} and a {after.kind} cannot be compared; give two tests of the same kind.")
    if before.signal != after.signal:
        raise ParameterError(
            f"One test uses {before.signal}, the other {after.signal}; analyse both with the same signal."
        )
    after_repair = after.quantities()
    return TestComparison(
        before, after, tuple(_change(name, old, after_repair[name]) for name, old in before.quantities().items())
    )


def _change(name: str, old: Estimate, new: Estimate) -> Change:
    difference = new.value - old.value
    if not math.isfinite(difference):
        return Change(name, unit_of(name), old, new, math.nan, "cannot tell")
    (old_low, old_high), (new_low, new_high) = _interval_of(old), _interval_of(new)
    if new_high < old_low:
        verdict = "smaller"
    elif new_low > old_high:
        verdict = "larger"
    else:
        verdict = "no change seen"
    return Change(name, unit_of(name), old, new, difference, verdict)


def _interval_of(estimate: Estimate) -> tuple[float, float]:
    """Interval of an estimate; without one, plus or minus two spreads or a tenth of the value."""
    if math.isfinite(estimate.low) and math.isfinite(estimate.high):
        return estimate.low, estimate.high
    half = 2.0 * estimate.spread if math.isfinite(estimate.spread) else 0.1 * abs(estimate.value)
    return estimate.value - half, estimate.value + half
