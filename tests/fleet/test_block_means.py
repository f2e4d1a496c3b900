"""Block means: against means by hand, on records that start at different times and have other sampling periods."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np
import pytest

from stiction.errors import RecordError
from stiction.fleet import common_clock, make_block_means
from stiction.records import LoopRecord

pytestmark = pytest.mark.quick

START = datetime(2026, 3, 2)


def record(n: int, dt: float = 5.0, start: datetime | None = None, seed: int = 0) -> LoopRecord:
    op, pv = np.random.default_rng(seed).normal(50.0, 1.0, (2, n))
    return LoopRecord(f"FIC-{seed}", dt, op=op, pv=pv, sp=np.full(n, 50.0), start=start)


def test_means_equal_those_by_hand():
    one = record(17280)
    clock = common_clock([one])
    means = make_block_means(one, clock)
    assert one.pv is not None
    assert (clock.dt, clock.count) == (25.0, 3456)
    assert means.error.dtype == np.float32
    np.testing.assert_allclose(means.op, one.op.reshape(-1, 5).mean(axis=1), rtol=1e-6)
    np.testing.assert_allclose(means.error, (50.0 - one.pv).reshape(-1, 5).mean(axis=1), atol=1e-5)
    first = round(clock.fast_first / 5.0)
    np.testing.assert_allclose(means.fast_op, one.op[first : first + 4096], rtol=1e-6)


def test_a_short_record_is_not_averaged():
    one = record(3000)
    means = make_block_means(one, common_clock([one]))
    np.testing.assert_allclose(means.op, one.op, rtol=1e-6)
    assert means.fast_op.size == 0


def test_a_later_record_is_put_at_its_time():
    early, late = record(1000, start=START), record(1000, start=START + timedelta(seconds=500.0), seed=1)
    clock = common_clock([early, late])
    means = make_block_means(late, clock)
    assert (clock.start, clock.count) == (START, 1100)
    np.testing.assert_allclose(means.op[100:], late.op, rtol=1e-6)
    np.testing.assert_allclose(means.op[:100], late.op.mean(), rtol=1e-5)


def test_a_slower_record_is_held_between_its_samples():
    fast, slow = record(100, dt=5.0), record(25, dt=20.0, seed=1)
    means = make_block_means(slow, common_clock([fast, slow]))
    np.testing.assert_allclose(means.op, np.repeat(slow.op, 4), rtol=1e-6)


def test_a_signal_that_does_not_move_is_empty():
    one = LoopRecord("FIC-1", 5.0, op=np.full(100, 50.0), pv=np.arange(100.0))
    assert make_block_means(one, common_clock([one])).op.size == 0


@pytest.mark.parametrize(
    ("records", "words"),
    [
        ([], "no record"),
        ([record(100), record(100, start=START, seed=1)], "FIC-0 has no start time"),
        ([record(100, start=START), record(100, start=START.astimezone(), seed=1)], "time zone"),
    ],
)
def test_records_without_a_common_time_are_refused(records, words):
    with pytest.raises(RecordError, match=words):
        common_clock(records)
