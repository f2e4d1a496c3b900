"""Clocks that were set back, and rows that are out of order for other reasons."""

from datetime import datetime, timedelta

import numpy as np
import pytest

from stiction.errors import RecordError
from stiction.records import analysis_window, assess_quality

N = 600
K = np.arange(N)
_NOISE = np.random.default_rng(3).normal(size=(2, N))
PV = np.round(50 + 3 * np.sin(K / 9) + 0.1 * _NOISE[0], 3)
OP = np.round(40 + 4 * np.cos(K / 9) + 0.1 * _NOISE[1], 3)

WRITTEN = {5: "5 s", 100: "100 s", 240: "4 min"}
"""Seconds -> how a message writes them."""


@pytest.fixture
def reading(table, read_text):
    """Read a loop by the times of its rows and which rows these are."""

    def read_rows(t, rows=K, **options):
        [record] = read_text(table("Time,PV,OP", [str(x) for x in t], PV[rows], OP[rows]), **options)
        return record

    return read_rows


def set_back(by, at=250):
    return np.r_[0:at, at - by : N - by]


@pytest.mark.parametrize("by", [5, 100, 240])
@pytest.mark.parametrize("turned", [False, True], ids=["oldest first", "newest first"])
def test_a_clock_set_back_runs_on_and_counts_as_a_jump(by, turned, reading):
    order = K[::-1] if turned else K
    record = reading(set_back(by)[order], order)
    assert (record.dt, len(record), record.provenance.clock_jumps) == (1.0, N, 1)
    np.testing.assert_array_equal(record.op, OP)
    row = N - 250 if turned else 251
    assert any(
        f"set back by {WRITTEN[by]} at row {row} of the data" in guess for guess in record.provenance.assumptions
    )
    found = next(gate for gate in assess_quality(record).checks if gate.name == "clock jumps")
    assert (found.value, found.severity) == (1, "warn")


def test_a_clock_set_back_where_rows_are_lost_is_cut_there(reading):
    rows = np.r_[0:250, 278:N]  # half a cycle is left out
    record = reading(np.where(rows < 250, rows, rows - 128), rows)
    first, last = analysis_window(record)
    assert first in (250, 251, 252)
    assert last == len(record) == len(rows)


def test_a_clock_set_back_twice_and_once_by_half_a_step(reading):
    t = 2.0 * K
    t[200:] -= 61.0
    t[400:] -= 100.0
    record = reading(t)
    assert (record.dt, len(record), record.provenance.clock_jumps) == (2.0, N, 2)
    np.testing.assert_array_equal(record.pv, PV)


def test_an_hour_back_without_a_date_of_summer_time_is_a_clock_set_back(reading):
    for start in (datetime(2026, 2, 3), datetime(2026, 10, 25, 9)):
        wall = [start + timedelta(minutes=int(k) - 60 * int(k >= 250)) for k in K]
        record = reading(wall)
        assert (len(record), record.provenance.clock_jumps, record.provenance.summer_time) == (N, 1, 0)
        np.testing.assert_array_equal(record.op, OP)
        assert any("set back by 60 min" in guess for guess in record.provenance.assumptions)


@pytest.mark.parametrize(("start", "sign"), [(datetime(2026, 10, 25), 1), (datetime(2026, 3, 29), -1)])
def test_a_change_of_summer_time_is_reported_as_one(start, sign, reading):
    wall = [start + timedelta(minutes=int(k) - sign * 60 * int(k >= (180 if sign > 0 else 120))) for k in K]
    record = reading(wall)
    assert (len(record), record.provenance.clock_jumps, record.provenance.summer_time) == (N, 1, 1)
    assert not any("set back" in guess for guess in record.provenance.assumptions)


@pytest.mark.parametrize(
    "order",
    [
        np.r_[0:200, 300:400, 200:300, 400:N],  # what was buffered comes behind what was sent at once
        np.r_[300:N, 0:300],
        np.r_[0:100, 101, 100, 102:N],
        np.r_[0:300, 250:N],  # two exports that overlap
        np.r_[0:100, 90, 100:N],
    ],
    ids=["buffered", "halves", "two rows", "overlap", "one row again"],
)
def test_rows_out_of_order_or_there_twice_are_sorted(order, reading):
    record = reading(order, order)
    assert len(record) == N
    np.testing.assert_array_equal(record.op, OP)
    assert not any("set back" in guess for guess in record.provenance.assumptions)
    assert any("they were sorted" in guess for guess in record.provenance.assumptions)


def test_two_exports_one_below_the_other_are_no_clock_set_back(reading):
    with pytest.raises(RecordError, match=r"have the same time stamp as another row .* two exports one below"):
        reading(K % 300)
