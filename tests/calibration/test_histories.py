"""Histories: the truth of each window is what the plan says, and the same seed gives the same windows."""

from __future__ import annotations

import numpy as np
import pytest

from calibration.histories import COURSES, FAULTS, draw_history, draw_plan
from calibration.second_simulator.histories import try_history


def test_shares_add_up_to_one():
    assert sum(FAULTS.values()) == pytest.approx(1.0)
    assert sum(COURSES.values()) == pytest.approx(1.0)


@pytest.mark.parametrize("simulator", ["first", "second"])
def test_same_seed_gives_the_same_windows(simulator):
    one, two = ([window for _, window in draw_history(simulator, 3, 31)] for _ in range(2))
    assert [window.record for window in one] == [window.record for window in two]


@pytest.mark.parametrize("simulator", ["first", "second"])
def test_truth_follows_the_course(simulator):
    for number in range(8):
        drawn = list(draw_history(simulator, number, 31))
        plan = drawn[0][0]
        sticky = np.array([window.sticky for _, window in drawn])
        assert len(drawn) == plan.shares.size
        if not plan.sticky:
            assert not sticky.any()
        if plan.course == "constant" and plan.sticky:
            assert sticky.all()
        if plan.course == "repaired":
            assert sticky[0]
            assert not sticky[-1]
            assert np.count_nonzero(np.diff(sticky.astype(int))) == 1


def test_a_repaired_valve_of_the_second_simulator_has_little_friction():
    plan = draw_plan(np.random.default_rng(1))._replace(
        fault="sticky", course="repaired", shares=np.array([1.0, 0.0]), samples=1200, stored=False
    )
    for seed in range(200):
        windows = list(try_history(plan, np.random.default_rng(seed)))
        if len(windows) == 2:
            break
    assert windows[0].S >= 1.0
    assert windows[1].S == 0.0
