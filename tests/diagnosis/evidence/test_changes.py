"""Onset, growth and repair in windows drawn from stated distributions, and in simulated records."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np
import pytest

from stiction.diagnosis.evidence.changes import evidence_of_today, find_changes
from stiction.diagnosis.evidence.pool_diagnoses import judge_windows
from stiction.diagnosis.evidence.pooling import pool_windows, tabulate
from stiction.diagnosis.verdict.history import Window
from stiction.diagnosis.verdict.model import log_odds, logistic
from stiction.diagnosis.verdict.over_time import describe_disagreement

START = datetime(2026, 3, 1)


def window(day: int, evidence: float, cause: float, S: float) -> Window:
    """A window of a day."""
    return Window(
        START + timedelta(days=day), 86400.0 * day, 86400.0 * (day + 1), "in_control",
        logistic(log_odds(0.25) + evidence), S=S, S_low=0.8 * S, S_high=1.25 * S, J=0.4 * S, J_low=0.2 * S,
        J_high=0.6 * S, S_detectable=None if evidence > 0.0 else 0.4, causes=(cause, *[0.1] * 6), evidence=evidence,
        over_deadband=2.0 if evidence > 0.0 else 0.0,
    )  # fmt: skip


def course(shares: list[float], seed: int = 0) -> list[Window]:
    """Windows of a valve whose S is given for each day; 0 is a valve in order."""
    rng = np.random.default_rng(seed)
    found = []
    for day, S in enumerate(shares):
        if S > 0.0:
            found.append(window(day, rng.normal(2.5, 1.0), 0.85, S * np.exp(rng.normal(0.0, 0.1))))
        else:
            found.append(window(day, rng.normal(-2.0, 0.7), 0.08, np.exp(rng.normal(-0.7, 0.6))))
    return found


def test_repair_is_found_and_the_probability_is_that_of_today():
    windows = course([4.0] * 6 + [0.0] * 3)
    pooled, [change], first = judge_windows(windows)
    assert (change.kind, change.first, change.time) == ("repair", 6, START + timedelta(days=6))
    assert change.S_before == pytest.approx(4.0, abs=0.5)
    assert change.S_after == 0.4
    assert first == 6
    assert pooled.probability(0.25) < 0.1


def test_onset_is_found():
    windows = course([0.0] * 5 + [3.0] * 3)
    pooled, [change], _ = judge_windows(windows)
    assert (change.kind, change.first, change.S_before) == ("onset", 5, None)
    assert change.S_after == pytest.approx(3.0, abs=0.4)
    assert pooled.probability(0.25) > 0.7


def test_growth_is_reported_with_its_ends_before_a_repair():
    sizes = np.geomspace(1.5, 5.0, 9).tolist()
    growth, repair = find_changes(course(sizes + [0.0] * 3))
    assert (growth.kind, growth.first) == ("growth", 0)
    assert growth.S_before == pytest.approx(1.5, abs=0.3)
    assert growth.S_after == pytest.approx(5.0, abs=0.7)
    assert (repair.kind, repair.first, repair.S_before) == ("repair", 9, growth.S_after)


def test_steady_valves_have_no_change():
    found = [find_changes(course([size] * 20, seed)) for seed in range(10) for size in (0.0, 3.0)]
    assert sum(map(len, found)) <= 1


def test_a_window_out_of_control_is_passed_over():
    windows = course([4.0] * 5 + [0.0] * 4)
    windows.insert(2, Window(START, 0.0, 1.0, "manual", 0.25))
    [change] = find_changes(windows)
    assert (change.kind, change.first) == ("repair", 6)


def test_two_windows_that_disagree_are_both_named():
    steady, other = [window(k, 2.5, 0.8, 1.2) for k in range(3)], window(3, 2.5, 0.8, 4.0)
    assert describe_disagreement(steady, ()) == ""
    assert describe_disagreement([*steady, other], ()) == (
        "The windows disagree about S: 1.2 % (0.96 to 1.5) from 2026-03-01 00:00 on, and 4 % (3.2 to 5) from "
        "2026-03-04 00:00 on."
    )


def test_windows_before_a_repair_do_not_disagree_with_today():
    windows = course([4.0] * 6 + [0.0] * 3)
    assert describe_disagreement(windows, find_changes(windows)) == ""


def test_evidence_of_today_allows_for_a_change_too_unsure_to_tell():
    sticky, good = course([4.0] * 7), course([4.0] * 6 + [0.0])
    assert evidence_of_today(sticky[:1]) == sticky[0].evidence
    plain = pool_windows(tabulate(good)).evidence
    assert evidence_of_today(good) < plain - 2.0
    assert evidence_of_today(good) < evidence_of_today(sticky) - 2.0
