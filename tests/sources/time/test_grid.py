"""Rows on an even grid, against the grid from which they were taken."""

from __future__ import annotations

from datetime import datetime, timedelta
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from stiction.errors import RecordError
from stiction.sources.time.grid import regular_grid
from stiction.sources.time.stamps import Stamps
from stiction.sources.time.time_order import sort_by_time

N = 600
K = np.arange(N)

WRITTEN = {5: "5 s", 100: "100 s", 240: "4 min"}
"""Seconds -> how a message writes them."""


def grid_of(t, *, kind="relative", dt=None, resolution=0.0, values=None, **options):
    """Lay the grid; rows differ where `values` do, everywhere when not given."""
    differ = None if values is None else (lambda a, b: values[a] != values[b])
    stamps = Stamps(np.asarray(t, dtype=float), kind, resolution=resolution)
    return regular_grid(stamps, dt=dt, name="file.csv", first_line=2, rows_differ=differ, **options)


def local(moments):
    return np.array([(moment - datetime(1970, 1, 1)) / timedelta(seconds=1) for moment in moments])


@settings(deadline=None, max_examples=100)
@given(
    dt=some.sampled_from([0.1, 0.25, 1.0, 1.5, 9.999, 10.0, 60.0]),
    lost=some.sets(some.integers(1, 298), max_size=30),
    jitter=some.sampled_from([0.0, 0.09]),
    start=some.sampled_from([0.0, 1.7e9]),
)
def test_each_row_stands_at_its_sample(dt, lost, jitter, start):
    there = np.setdiff1d(np.arange(300), list(lost))
    noise = np.random.default_rng(len(lost)).uniform(-jitter, jitter, 300)
    grid = grid_of(start + (dt * (np.arange(300) + noise))[there])
    expected = np.full(300, -1)
    expected[there] = np.arange(there.size)
    assert grid.dt == pytest.approx(dt, rel=1e-3)
    np.testing.assert_array_equal(grid.source_row, expected)
    assert any(f"Missing: {len(lost)} sample" in note for note in grid.notes) == bool(lost)


def test_gaps_are_counted():
    grid = grid_of(10.0 * np.r_[0:50, 57:120])
    assert np.flatnonzero(grid.source_row < 0).tolist() == list(range(50, 57))
    assert grid.notes == ["Missing: 7 samples in 1 gap of the time stamps (not filled)."]


def test_newest_first_unsorted_and_repeated_rows():
    np.testing.assert_array_equal(grid_of(K[::-1]).source_row, K[::-1])
    order = np.r_[0:10, 11, 10, 12:N]
    grid = grid_of(order)
    assert (grid.clock_jumps, order[grid.source_row].tolist()) == (1, K.tolist())
    grid = grid_of(np.insert(K, 30, 29))
    assert len(grid.source_row) == N
    assert grid.notes == ["Left out: 1 row with the same time stamp as the next row, 1 row of them with other values."]


@pytest.mark.parametrize("seed", range(4))
def test_shuffled_rows_are_sorted_and_not_said_to_be_turned_round(seed):
    order = np.random.default_rng(seed).permutation(N)
    grid = grid_of(order)
    np.testing.assert_array_equal(order[grid.source_row], K)
    [note] = grid.notes
    assert note.startswith("The rows are not in the order of time")


@pytest.mark.parametrize("seed", range(5))
def test_uneven_stamps_are_held(seed):
    t = np.round(np.cumsum(np.random.default_rng(seed).uniform(0.2, 3.0, 300)), 2)
    grid = grid_of(t)
    for k, row in enumerate(grid.source_row):  # the last row at or before each moment, found the slow way
        moment = t[0] + k * grid.dt
        assert row == max(i for i in range(300) if t[i] <= moment + 1e-6)
    assert "each value is used until the next one" in grid.notes[0]


def test_a_value_of_uneven_stamps_is_held_for_ten_periods():
    steps = np.full(299, 10.0)
    steps[0:20:2], steps[1:20:2] = 4.0, 16.0
    steps[200] = 200.0
    t = np.concatenate([[0.0], np.cumsum(steps)])
    grid, last = grid_of(t), round(t[200] / 10.0)
    assert grid.dt == 10.0
    assert grid.source_row[last : last + 21].tolist() == [200] * 11 + [-1] * 9 + [201]


@pytest.mark.parametrize("seconds", [7, 8, 9, 10, 11, 13, 14.5, 17, 20, 25, 40, 42.5])
@pytest.mark.parametrize("first", [0.0, 3.0])
def test_stamps_rounded_to_a_minute_are_spread(seconds, first):
    grid = grid_of(np.floor((first + seconds * np.arange(120)) / 60.0) * 60.0)
    assert grid.dt == pytest.approx(seconds, rel=0.01)
    np.testing.assert_array_equal(grid.source_row, np.arange(120))
    assert "share each stamp" in grid.notes[0]


@settings(deadline=None, max_examples=40)
@given(
    seconds=some.sampled_from([1.0, 1.2, 1.5, 2.0, 3.0, 5.0]),
    lost=some.sets(some.integers(1, 398), max_size=40),
    gap=some.tuples(some.integers(40, 340), some.integers(0, 30)),
)
def test_rounded_serial_days_keep_their_gaps(seconds, lost, gap):
    there = np.setdiff1d(np.arange(400), [*lost, *range(gap[0], gap[0] + gap[1])])
    days = np.round(46054.54167 + seconds * there / 86400.0, 5)
    grid = grid_of(86400.0 * days, kind="local", resolution=0.864)
    assert grid.dt == pytest.approx(seconds, rel=1e-3)
    row = np.full(there[-1] + 1, -1)
    row[there] = np.arange(there.size)
    np.testing.assert_array_equal(grid.source_row, row)


def test_rounded_stamps_that_tell_no_period_are_refused_and_dt_cures_it():
    t = np.floor(np.cumsum(np.random.default_rng(2).uniform(5, 40, 120)) / 60.0) * 60.0
    with pytest.raises(RecordError, match=r"of 120 rows have the same time stamp .* are rounded; .* dt in seconds"):
        grid_of(t)
    grid = grid_of(t, dt=20.0)
    assert (grid.dt, grid.source_row.tolist()) == (20.0, list(range(120)))


@pytest.mark.parametrize("shared", [20, 21])
def test_a_tenth_of_the_rows_may_share_a_stamp_and_differ(shared):
    t = np.sort(np.concatenate([np.arange(200.0 - shared), 5.0 + 7.0 * np.arange(shared)]))
    if shared == 20:
        assert len(grid_of(t).source_row) == 180
    else:
        with pytest.raises(
            RecordError, match="21 of 200 rows have the same time stamp as the next row but other values"
        ):
            grid_of(t)


def test_rows_that_a_file_has_twice_are_read_once():
    grid = grid_of(np.repeat(K, 2), values=np.repeat(K, 2))
    assert (grid.dt, grid.source_row.tolist()) == (1.0, (2 * K + 1).tolist())
    pasted = grid_of(np.tile(K, 2), values=np.tile(K, 2))
    assert (pasted.dt, (pasted.source_row % N).tolist()) == (1.0, K.tolist())
    with pytest.raises(RecordError, match=r"have the same time stamp as another row .* two exports one below"):
        grid_of(np.tile(K, 2), values=np.arange(2 * N))


WRONG = [K, 7.0 * K, K // 2, K // 7, K[::-1], np.where(K < 60, K, K + 1e7)]


@pytest.mark.parametrize("wrong", WRONG)
def test_a_given_dt_stands_above_wrong_stamps_and_keeps_every_row(wrong):
    grid = grid_of(wrong, dt=2.5)
    assert (grid.dt, grid.source_row.tolist()) == (2.5, (K[::-1] if wrong[0] > wrong[-1] else K).tolist())
    assert "taken as 2.5 s apart" in grid.notes[-1]


def test_a_given_dt_that_the_stamps_confirm_keeps_their_gaps():
    there = np.r_[0:50, 57:120]
    grid = grid_of(10.002 * there, dt=10.0)
    assert np.flatnonzero(grid.source_row < 0).tolist() == list(range(50, 57))
    assert grid_of(np.floor(K / 6) * 60.0, dt=10.0).source_row.tolist() == K.tolist()
    assert grid_of(np.full(5, np.nan), dt=3.0).source_row.tolist() == [0, 1, 2, 3, 4]


def test_stamps_that_tell_nothing_are_refused():
    with pytest.raises(RecordError, match="line 2: all time stamps are equal; give dt"):
        grid_of(np.zeros(9))
    stamps = Stamps(np.full(9, np.nan), "local", first_unread=(3, "soon"))
    with pytest.raises(RecordError, match=r"line 5: 'soon' is not a known form of time stamp; give time_format"):
        regular_grid(stamps, dt=None, name="file.csv", first_line=2)
    with pytest.raises(RecordError, match=r"rows 300 and 301 of the data are 1e\+07 s apart"):
        grid_of(np.where(K < 300, K, K + 1e7))
    grid = grid_of(np.where(K == 7, np.nan, K))
    assert grid.source_row[7] == -1
    assert "1 row without a readable time stamp (first near line 9)" in grid.notes[0]


@pytest.mark.parametrize("start", [datetime(2026, 10, 24, 22), datetime(2026, 3, 28, 22)])
def test_a_wall_clock_of_summer_time_is_undone(start):
    utc = [start.replace(tzinfo=ZoneInfo("UTC")) + timedelta(minutes=int(k)) for k in range(300)]
    wall = [moment.astimezone(ZoneInfo("Europe/Berlin")).replace(tzinfo=None) for moment in utc]
    grid = grid_of(local(wall), kind="local")
    assert (grid.dt, grid.source_row.tolist()) == (60.0, list(range(300)))
    assert (grid.clock_jumps, grid.dst_changes, grid.start) == (1, 1, wall[0])


@pytest.mark.parametrize("by", [5, 100, 240])
@pytest.mark.parametrize("reverse", [False, True])
def test_a_clock_set_back_runs_on_and_counts_as_a_jump(by, reverse):
    t = np.r_[0:250, 250 - by : N - by]
    t = t[::-1] if reverse else t
    grid = grid_of(t, values=K)
    np.testing.assert_array_equal(grid.source_row, K[::-1] if reverse else K)
    row = N - 250 if reverse else 251
    assert any(f"set back by {WRITTEN[by]} at row {row} of the data" in note for note in grid.notes)
    assert (grid.dt, grid.clock_jumps) == (1.0, 1)


def test_an_hour_back_without_a_date_of_summer_time_is_a_clock_set_back():
    for start in (datetime(2026, 2, 3), datetime(2026, 10, 25, 9)):
        wall = [start + timedelta(minutes=int(k) - 60 * int(k >= 250)) for k in K]
        grid = grid_of(local(wall), kind="local", values=K)
        assert (len(grid.source_row), grid.clock_jumps, grid.dst_changes) == (N, 1, 0)
        assert any("set back by 60 min" in note for note in grid.notes)


ORDERS = {
    "buffered": np.r_[0:200, 300:400, 200:300, 400:N],
    "halves": np.r_[300:N, 0:300],
    "two rows": np.r_[0:100, 101, 100, 102:N],
    "overlap": np.r_[0:300, 250:N],
    "one row again": np.r_[0:100, 90, 100:N],
}


@pytest.mark.parametrize("order", ORDERS)
def test_rows_out_of_order_or_there_twice_are_sorted(order):
    rows = ORDERS[order]
    grid = grid_of(rows, values=rows)
    np.testing.assert_array_equal(rows[grid.source_row], K)
    assert any("they were sorted" in note for note in grid.notes)
    assert not any("set back" in note for note in grid.notes)


def test_without_values_to_compare_no_clock_is_set_back():
    result, _ = sort_by_time(Stamps(np.r_[0.0:250, 150:500], "relative"))
    assert result.clock_jumps == 1
    assert "sorted" in result.notes[0]
