"""The count of agreement: shares and areas that can be told by hand."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest

from stiction.diagnosis.detection import FACTS

PLACE = importlib.util.spec_from_file_location("score", Path(__file__).with_name("score.py"))
assert PLACE is not None
assert PLACE.loader is not None
score = importlib.util.module_from_spec(PLACE)
PLACE.loader.exec_module(score)


def test_shares_weigh_loops_and_leave_out_what_is_not_valid():
    sticky = np.array([True, True, True, False, False, False])
    weight = np.array([0.5, 0.5, 1.0, 1.0, 1.0, 1.0])
    valid = np.array([True, True, True, True, True, False])
    vote = np.array([1, -1, 1, 1, 0, 1])
    index = np.array([2.0, -1.0, 3.0, 2.0, 0.0, 9.0])
    one = score._one("m", sticky, weight, valid, vote, index)
    assert one.valid == pytest.approx(4 / 5)
    assert one.hits == pytest.approx(1.5 / 2)
    assert one.alarms == pytest.approx(1 / 2)
    assert one.open == pytest.approx(1 / 4)
    # pairs: 2 against (2, 0), weight 0.5: 1.5 of 2; -1: none; 3, weight 1: both
    assert one.area == pytest.approx((0.5 * 1.5 + 1.0 * 2.0) / (2.0 * 2.0))


def test_what_nobody_can_answer_is_not_a_number():
    none = np.zeros(2, dtype=bool)
    one = score._one("m", np.array([True, False]), np.ones(2), none, np.zeros(2), np.zeros(2))
    assert one.valid == 0.0
    assert math.isnan(one.hits)
    assert math.isnan(one.area)
    assert "| - |" in score.table([one])


def test_every_method_has_a_row():
    samples = score.simulated(7, seed=7)
    assert {sample.sticky for sample in samples} == {True, False}
    rows = score.score(samples)
    assert [row.method for row in rows] == [*FACTS, "majority"]
    assert all(0.0 <= row.valid <= 1.0 for row in rows)


def test_labelled_loops_weigh_one_each(records):
    samples = score.labelled(records)
    assert len(samples) == 33
    assert sum(sample.weight for sample in samples) == pytest.approx(23.0)
