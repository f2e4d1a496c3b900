"""An OP moved by hand is no OP at its limit: by the mode, and by rests that no controller makes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stiction.records import LoopRecord, analysis_window, assess_quality
from stiction.records.quality import find_manual_steps
from stiction.records.quality.saturation import find_clipping, find_saturation, find_span_ends

N, FIRST, LAST = 2000, 400, 1200
LEVELS = [50.0, 56.0, 44.0, 44.0, 51.0, 56.0, 49.0, 56.0]


@pytest.fixture
def bumps():
    """A loop whose OP stays in 48 to 52 %, and eight bumps of a hundred samples: 56 % and 44 % are its extremes."""
    k, rng = np.arange(N), np.random.default_rng(3)
    op = 50.0 + 2.0 * np.sin(2 * np.pi * k / 90.0) + rng.normal(0.0, 0.1, N)
    op[FIRST:LAST] = np.repeat(LEVELS, 100)
    pv = 200.0 + np.convolve(op - 50.0, np.exp(-np.arange(80) / 8.0) / 8.0)[:N] + rng.normal(0.0, 0.2, N)
    return LoopRecord("TIC-1", 1.0, op=op, pv=pv)


def checks(record):
    return {check.name: check for check in assess_quality(record).checks}


@pytest.mark.parametrize("has_mode", [True, False])
def test_bumps_in_manual_are_no_limit(bumps, has_mode):
    auto = np.ones(N, dtype=bool)
    auto[FIRST:LAST] = False
    record = replace(bumps, auto=auto) if has_mode else bumps
    assert not find_saturation(record.op, record.pv, record.auto).any()
    assert np.array_equal(find_manual_steps(record.op), ~auto)
    found = checks(record)
    assert (found["saturation"].severity, found["manual"].severity) == ("ok", "warn")
    assert found["manual"].value == pytest.approx(100.0 * (LAST - FIRST) / N)
    assert ("mode is not automatic" if has_mode else "OP moves in steps") in found["manual"].why
    assert analysis_window(record) == (LAST, N)


def test_a_line_that_the_historian_drew_between_two_levels_parts_no_steps(bumps):
    op = bumps.op.copy()
    op[FIRST + 100] = 53.0
    assert find_manual_steps(op)[FIRST:LAST].all()


def test_op_clipped_in_automatic_is_found_although_manual_steps_go_farther(bumps):
    auto = np.ones(N, dtype=bool)
    auto[FIRST:LAST] = False
    op = np.where(auto, np.minimum(bumps.op, 51.5), bumps.op)
    for record in (replace(bumps, op=op, auto=auto), replace(bumps, op=op)):
        assert find_clipping(record.op, record.pv, record.auto)[auto].mean() > 0.15
        assert not find_clipping(record.op, record.pv, record.auto)[~auto].any()


def test_what_no_hand_did_is_no_step_test(bumps):
    k = np.arange(N)
    # A controller slower than the record goes from rest to rest all the time.
    assert not find_manual_steps(np.repeat(bumps.op[::20], 20)).any()
    # So does one of few levels, and one that is rounded where it moves slowly.
    assert not find_manual_steps(np.where(k % 60 < 30, 20.0, 80.0) + (k % 120 < 60)).any()
    assert not find_manual_steps(np.round(50.0 + 5.0 * np.sin(2 * np.pi * k / 400.0))).any()
    # From one limit to the other an OP may leap where the set point does.
    op = bumps.op.copy()
    op[FIRST:LAST] = np.repeat([20.0, 80.0], 400)
    assert not find_manual_steps(op).any()
    assert find_saturation(op, bumps.pv)[FIRST:LAST].all()
    # A single constant run is left to the rule for constant runs.
    op[FIRST:LAST] = bumps.op[LAST:]
    op[FIRST : FIRST + 100] = 50.0
    assert not find_manual_steps(op).any()


def test_what_the_operator_sets_to_0_or_100_is_no_limit_of_the_loop(bumps):
    op, auto = bumps.op.copy(), np.ones(N, dtype=bool)
    op[FIRST:LAST], auto[FIRST:LAST] = 100.0, False
    record = replace(bumps, op=op)
    assert find_saturation(record.op, record.pv, record.auto)[FIRST:LAST].all()
    assert find_span_ends(record.op, record.auto)[FIRST:LAST].all()
    record = replace(record, auto=auto)
    assert not find_saturation(record.op, record.pv, record.auto).any()
    assert not find_span_ends(record.op, record.auto).any()
    assert checks(record)["saturation"].severity == "ok"
