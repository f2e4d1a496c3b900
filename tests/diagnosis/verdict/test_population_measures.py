"""The counts that judge the verdict, on rows whose counts are plain to see."""

from __future__ import annotations

import numpy as np
import pytest

from .fault_injection import Trial
from .population import Judged, balanced_accuracy, by_position, calibration_error, measures


def row(truth, cause, probability, S=5.0, S_found=5.0, verdict="stiction", S_detectable=np.nan):
    return Judged(
        "x", truth, "", (), S, True, 500, 0.1, verdict, cause, probability, False, S_found, S_found - 1.0,
        S_found + 1.0, True, False, "stem", True, S_detectable,
    )  # fmt: skip


def test_each_cause_weighs_the_same_and_unknown_is_wrong():
    rows = [row("stiction", "stiction", 0.9)] * 9 + [row("stiction", "unknown", 0.5, verdict="undecided")]
    rows += [row("none", "none", 0.1), row("none", "sensor", 0.1)]
    assert balanced_accuracy(rows) == pytest.approx((0.9 + 0.5) / 2.0)


def test_calibration_error_of_two_tenths():
    # 0.75 told, half sticky: 0.25 off in two rows; 0.1 told, none sticky: 0.1 off in three.
    rows = [row("stiction", "stiction", 0.75), row("none", "none", 0.75), *[row("none", "none", 0.1)] * 3]
    assert calibration_error(rows) == pytest.approx((2 * 0.25 + 3 * 0.1) / 5)


def test_what_would_have_shown_is_told_denied_or_hidden():
    rows = [row("stiction", "stiction", 0.95, S_detectable=S) for S in (4.0, 6.0, np.inf, np.nan)]
    rows += [row("stiction", cause, 0.05, verdict="no_stiction", S_detectable=4.0) for cause in ("none", "deadband")]
    found = measures(rows)
    assert (found["detectable"], found["detectable_and_told"], found["detectable_and_denied"]) == (3, 1, 1)


def test_stiction_found_alarms_and_intervals():
    rows = [row("stiction", "stiction", 0.95, S_found=5.4), row("stiction", "stiction", 0.95, S_found=6.5)]
    rows += [row("stiction", "none", 0.05, S_found=np.nan), row("none", "stiction", 0.95)]
    found = measures(rows)
    assert found["S_close_of_the_visible"] == pytest.approx(1.0 / 3.0)
    assert found["interval_holds_S"] == pytest.approx(0.5)
    assert found["confident_false_alarms"] == 1.0
    assert found["confident_misses"] == pytest.approx(1.0 / 3.0)


def test_what_positions_do_is_counted():
    rows = [row("stiction", "stiction", 0.95, S_found=5.2), row("stiction", "none", 0.05, 5.0, 6.5, "no_stiction")]
    told = by_position(rows)
    assert told.split("\n")[2].split() == ["stem", "2", "2", "1"]
    assert told.split("\n")[5].split() == ["own", "samples", "2", "1", "1", "1", "1"]
    assert told.split("\n")[6].split() == ["slower", "0", "0", "0", "0", "0"]


@pytest.mark.parametrize(
    ("before", "after", "flipped"),
    [(0.95, 0.05, True), (0.05, 0.95, True), (0.95, 0.5, False), (0.85, 0.05, False), (0.95, 0.99, False)],
)
def test_a_flip_is_from_one_confident_verdict_to_the_other(before, after, flipped):
    trial = Trial("x", "stiction", ("gaps",), (0.5,), 1, before, after, after, False, (), ())
    assert trial.flipped == flipped


def test_a_refusal_is_right_where_a_gate_of_its_effect_is_told():
    for gates, right in ((("missing values",), True), (("compression",), False), ((), False)):
        assert Trial("x", "none", ("gaps",), (0.5,), 1, 0.1, 0.5, 0.5, True, gates, ()).right_reason == right
