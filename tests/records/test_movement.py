"""What OP must do for a valve to be seen: turn round, slower than the samples, and be another signal than PV."""

from __future__ import annotations

import numpy as np
import pytest

from stiction.records import LoopRecord, assess_quality


def find_check(record, name):
    return next(check for check in assess_quality(record).checks if check.name == name)


@pytest.mark.parametrize(("ways", "severity"), [(2, "warn"), (6, "warn"), (7, "ok")])
def test_turns_of_op_and_no_ripple_on_its_way(ways, severity):
    way = np.linspace(0.0, 10.0, 200)
    op = np.concatenate([way if k % 2 == 0 else way[::-1] for k in range(ways)])
    ripple = 0.004 * np.sin(np.arange(op.size))
    found = find_check(LoopRecord("FIC-101", 1.0, op=50.0 + op + ripple, pv=2.0 * op), "op reversals")
    assert (found.severity, found.value, found.limit) == (severity, ways - 1, 6)


@pytest.mark.parametrize("seed", range(60))
def test_turns_are_those_of_the_longest_zigzag(seed):
    rng = np.random.default_rng(seed)
    op = 50.0 + np.round(np.cumsum(rng.normal(size=rng.integers(5, 60))), seed % 3)
    reach = 0.15 * float(np.subtract(*np.percentile(op, (99, 1))))
    # Legs of the longest way through the samples of which each goes further than `reach`, and back from the one before.
    up, down = np.zeros(op.size, dtype=int), np.zeros(op.size, dtype=int)
    for k in range(op.size):
        for i in range(k):
            if op[k] - op[i] > reach:
                up[k] = max(up[k], down[i] + 1)
            if op[i] - op[k] > reach:
                down[k] = max(down[k], up[i] + 1)
    found = find_check(LoopRecord("FIC-101", 1.0, op=op, pv=2.0 * op), "op reversals")
    assert found.value == max(up.max(), down.max()) - 1


def test_a_column_taken_twice_is_no_loop():
    op = 50.0 + np.sin(np.arange(400.0))
    twice = find_check(LoopRecord("FIC-101", 1.0, op=op, pv=op), "pv movement")
    assert twice.severity == "reject"
    assert "same numbers" in twice.why
    assert find_check(LoopRecord("FIC-101", 1.0, op=op, pv=2.0 * op), "pv movement").severity == "ok"


@pytest.mark.parametrize(("likeness", "severity"), [(-0.59, "warn"), (-0.61, "reject")])
def test_what_alternates_faster_than_three_samples_a_cycle_is_refused(likeness, severity):
    """The correlation of a sine with its last value is the cosine of the phase between two samples."""
    phase = np.arccos(likeness) * np.arange(6000)
    found = find_check(LoopRecord("FIC-1", 1.0, op=50.0 + np.sin(phase), pv=np.cos(phase)), "sampling")
    assert found.value == pytest.approx(likeness, abs=1e-3)
    assert found.severity == severity
