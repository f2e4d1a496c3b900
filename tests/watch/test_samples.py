"""Sample files: every sample in the window of its time, once, in order, also after a kill while one was written."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from stiction.watch.samples import SAMPLE, SampleFiles, window_name

BEGIN = 1_772_431_200_000_000
"""2026-03-02 06:00 UTC [microseconds since 1970]."""


def rows_at(seconds, tag=1):
    rows = np.zeros(len(seconds), SAMPLE)
    rows["tag"], rows["text"] = tag, -1
    rows["stamp"] = BEGIN + np.round(1e6 * np.asarray(seconds, float)).astype(np.int64)
    rows["value"] = np.arange(len(seconds))
    return rows


@given(order=some.permutations(range(12)), cuts=some.sets(some.integers(1, 11)), again=some.sets(some.integers(0, 11)))
def test_rows_of_any_order_come_back_once_and_sorted(tmp_path_factory, order, cuts, again):
    files = SampleFiles(tmp_path_factory.mktemp("samples"), 60.0)
    rows = rows_at(np.arange(12) * 10.0)[list(order)]
    for part in np.split(rows, sorted(cuts)):
        files.append(part, 0)
    files.append(rows[sorted(again)], 0)
    assert files.windows() == [BEGIN, BEGIN + 60_000_000]
    found = [files.read(start) for start in files.windows()]
    stamps = np.concatenate([one["stamp"] for one, _ in found])
    np.testing.assert_array_equal(stamps, BEGIN + np.arange(12) * 10_000_000)
    assert sum(doubles for _, doubles in found) == len(again)
    np.testing.assert_array_equal(files.last_stamps(3), [0, BEGIN + 110_000_000, 0])


def test_values_that_share_a_time_but_differ_are_both_kept(tmp_path):
    files = SampleFiles(tmp_path, 60.0)
    files.append(rows_at([1.0, 1.0]), 0)
    rows, doubles = files.read(BEGIN)
    assert (rows["value"].tolist(), doubles) == ([0.0, 1.0], 0)


def test_samples_of_a_closed_window_are_counted_and_left_out(tmp_path):
    files = SampleFiles(tmp_path, 60.0)
    assert files.append(rows_at([10.0, 70.0]), BEGIN + 60_000_000) == 1
    assert files.windows() == [BEGIN + 60_000_000]


@pytest.mark.parametrize("cut", [1, 11, 12, 13, 40])
def test_a_block_that_was_cut_off_is_left_out_and_the_next_one_is_sound(tmp_path, cut):
    files = SampleFiles(tmp_path, 60.0)
    files.append(rows_at([1.0, 2.0]), 0)
    files.append(rows_at([3.0, 4.0]), 0)
    [path] = tmp_path.iterdir()
    path.write_bytes(path.read_bytes()[:-cut])
    files.mend()
    files.append(rows_at([5.0]), 0)
    rows, _ = files.read(BEGIN)
    np.testing.assert_array_equal(rows["stamp"], BEGIN + np.array([1, 2, 5]) * 1_000_000)


def test_names_tell_the_time():
    assert window_name(BEGIN) == "20260302T060000Z"
