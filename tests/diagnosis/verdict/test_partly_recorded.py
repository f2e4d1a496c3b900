"""Set points stored late and positions recorded for a part of the record: neither hides nor feigns anything."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis import find_oscillation
from stiction.diagnosis.detection import detect_all
from stiction.diagnosis.identification.position import LONGEST, longest_seen
from stiction.diagnosis.verdict.findings import findings
from stiction.diagnosis.verdict.stem import stem_shown
from stiction.records import usable_segment
from stiction.records.analysis_window import forward_fill_sp
from stiction.simulation.historian import missing

N, LONG = 2000, 14_000
K = np.arange(N)


@cache
def sticky(n):
    """A flow loop that cycles because its valve, S = 5 and J = 3, sticks."""
    made = st.Loop(st.PID(0.4, 5.0), st.Kano(5.0, 3.0), st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.1)
    run = st.simulate(made, 70.0, float(n), 6.0, seed=1, pv_start=70.0, op_start=50.0, loop_type="flow")
    return replace(run, mv=run.mv + 0.05 * np.random.default_rng(0).normal(size=n))


@cache
def healthy():
    """A flow loop with a good valve that a load moves every 60 s."""
    made = st.Loop(st.PID(0.35, 6.0), st.Ideal(), st.FOPDT(1.5, 4.0, 2.0), dt=1.0, noise=0.1)
    load = 3.0 * np.sin(2.0 * np.pi * K / 60.0)
    run = st.simulate(made, 70.0, float(N), load, seed=1, pv_start=70.0, op_start=50.0, loop_type="flow")
    return replace(run, mv=run.mv + 0.1 * np.random.default_rng(0).normal(size=N))


def blank(x, where):
    return np.where(where, np.nan, x)


def test_the_longest_seen_is_where_most_was_recorded():
    y = np.zeros(LONG)
    assert longest_seen(y) == slice(4000, 10_000)
    assert longest_seen(y[:LONGEST]) == slice(0, LONGEST)
    assert longest_seen(blank(y, np.arange(LONG) >= 3500)) == slice(0, 3500)
    assert longest_seen(blank(y, np.arange(LONG) < 9000)) == slice(9000, LONG)
    assert longest_seen(blank(y, np.arange(LONG) % 7000 > 6500)) == slice(7000, 13_000)
    assert longest_seen(np.full(LONG, np.nan)) == slice(0, 0)


def test_a_position_of_a_part_of_a_long_record_shows_what_it_does_by_itself():
    run, k = sticky(LONG), np.arange(LONG)
    for first, last in ((0, 3500), (LONG - 3000, LONG)):
        shown = stem_shown(replace(run, mv=blank(run.mv, (k < first) | (k >= last))))
        assert shown.why == stem_shown(run.window(first, last)).why
        assert shown.what == "stiction"
        assert pytest.approx(5.0, rel=0.2) == shown.valve.S  # as near as the search comes in these
    few = (k < 3500) | np.isin(k, [5000, 6000, 7000, 7001, 7002])
    assert pytest.approx(5.0, rel=0.2) == stem_shown(replace(run, mv=blank(run.mv, ~few))).valve.S


def test_a_position_that_hangs_in_the_middle_of_a_long_record_is_told_as_frozen():
    run, k = sticky(LONG), np.arange(LONG)
    assert stem_shown(replace(run, mv=np.where((k > 3800) & (k < 10_200), 50.0, run.mv))).what == "frozen"


def test_a_position_is_compared_with_what_the_valve_was_sent():
    run = sticky(N)
    for gap in (K < 20, (K > 500) & (K < 800)):
        shown = stem_shown(replace(run, valve_signal=blank(run.op, gap)))
        assert shown.what == "stiction"
        assert pytest.approx(5.0, rel=0.05) == shown.valve.S
    assert stem_shown(replace(run, valve_signal=blank(run.op, K > 40))).what == "missing"


def test_a_good_position_gives_no_S():
    run = healthy()
    found, without = st.diagnose(run), st.diagnose(replace(run, mv=None))
    assert stem_shown(run).what == "good"
    assert found.identification == without.identification
    assert (found.evidence[1].method, found.evidence[1].vote) == ("stem", "no_stiction")


@pytest.mark.parametrize("late", [600, 1000, 1001, 1300])
def test_a_set_point_that_is_stored_late_did_not_change_before(late):
    plain = st.diagnose(replace(healthy(), mv=None)).to_dict()
    told = st.diagnose(replace(healthy(), mv=None, sp=blank(healthy().sp, late > K))).to_dict()
    what = "assumed to be the first stored one" if late <= N // 2 else "unknown, so the set point is not used"
    assert f"The set point of the first {late} of {N} samples is {what}." in told["reason"]
    for key in ("verdict", "cause", "probability", "stiction"):
        assert told[key] == plain[key], key
    assert told["oscillation"]["period_s"] == pytest.approx(60.0, rel=0.02)


def test_a_set_point_that_is_stored_on_change_is_the_whole_set_point():
    sp = np.repeat(np.random.default_rng(2).uniform(60.0, 80.0, 20), 100)
    made = st.Loop(st.PID(0.35, 6.0), st.Ideal(), st.FOPDT(1.5, 4.0, 2.0), dt=1.0, noise=0.1)
    run = replace(st.simulate(made, sp, float(N), seed=1, pv_start=70.0, op_start=50.0, loop_type="flow"), mv=None)
    changed = np.diff(run.sp, prepend=np.nan) != 0.0
    stored = replace(run, sp=blank(run.sp, ~changed))
    np.testing.assert_array_equal(forward_fill_sp(stored)[0], run.sp)
    # What was stored before the stretch that is analysed holds in it.
    torn = usable_segment(replace(stored, op=blank(run.op, (K > 930) & (K < 990))))
    np.testing.assert_array_equal(torn.sp, run.sp[990:])
    assert torn.provenance.assumptions == ()
    # Without its first value the hundred samples before the next one are all that is guessed.
    stored.sp[0] = np.nan
    held, told = forward_fill_sp(stored)
    np.testing.assert_array_equal(held[100:], run.sp[100:])
    assert set(held[:100]) == {run.sp[100]}
    assert told == "The set point of the first 100 of 2000 samples is assumed to be the first stored one."
    assert usable_segment(stored).provenance.assumptions[-1] == told


def test_where_the_set_point_is_missing_the_pv_is_looked_at_and_that_is_said():
    run = healthy()
    found = find_oscillation(replace(run, sp=blank(run.sp, K < 1300)))
    assert found.oscillating
    assert found.period == pytest.approx(60.0, rel=0.02)
    assert "SP is missing in the first half of the record or more: PV was looked at alone." in found.reason
    assert "SP is missing" not in find_oscillation(run).reason
    assert find_oscillation(replace(run, sp=run.pv)).reason.startswith("PV is where SP is")
    assert find_oscillation(replace(run, pv=np.ones(N))).reason.startswith("PV does not move, it stands at 1")


@pytest.mark.parametrize("last", [300, 600, 900, 1200, 1600])
def test_where_a_position_ends_the_valve_does_not_stick(last):
    seen = findings(replace(healthy(), mv=blank(healthy().mv, last <= K)))
    rows = {row.method: row for row in seen.evidence}
    assert rows["stem"].vote == "no_stiction"
    for name in ("yamashita", "kano_patterns"):
        row = rows[name]
        assert row.vote == "no_stiction", row
        assert row.valid is (last >= N // 2)
        assert (f"recorded for only {last} of {N} samples" in row.why) is not row.valid


def test_a_position_with_short_gaps_is_bridged_and_long_ones_are_not():
    run = healthy()
    gaps = (K % 100 < 5) & (K > 10)
    part = usable_segment(replace(run, mv=blank(run.mv, gaps), valve_signal=blank(run.op, gaps | (K > 1500))))
    np.testing.assert_array_equal(part.mv, run.mv[np.where(gaps, K - K % 100 - 1, K)])
    assert np.isfinite(part.valve_signal[:1500]).all()
    assert not np.isfinite(part.valve_signal[1500:]).any()
    rows = {row.method: row for row in detect_all(replace(run, mv=blank(run.mv, gaps)), find_oscillation(run))}
    assert rows["yamashita"].valid
    assert rows["kano_patterns"].valid


def agrees(row):
    """Whether a row's vote is what its index and threshold say."""
    return not row.valid or (row.vote == "stiction") is (row.index >= row.threshold)


def test_votes_of_the_evidence_are_those_of_its_indices():
    rng = np.random.default_rng(0)
    apart = replace(healthy(), mv=None, pv=70.0 + rng.normal(size=N).cumsum() / 20.0)
    deadband = st.Loop(st.PID(0.35, 6.0), st.Kano(4.0, 0.0), st.FOPDT(1.5, 4.0, 2.0), dt=1.0, noise=0.1)
    play = st.simulate(deadband, 70.0, 900.0, 3.0 * np.sin(K[:900] / 9.5), seed=1, pv_start=70.0, op_start=50.0)
    found = [st.diagnose(one) for one in (sticky(N), replace(sticky(N), mv=None), healthy(), play, apart)]
    assert all(agrees(row) for one in found for row in one.evidence)
    own = [one.evidence[0] for one in found]
    assert [row.method for row in own] == ["simulation_error"] * 5
    assert [row.vote for row in own[:3]] == ["stiction", "stiction", "no_stiction"]
    assert [row.valid for row in own] == [True, True, True, True, False]
    assert "Not valid here: OP does not move the PV." in own[-1].why
    assert [one.evidence[1].vote for one in found if one.record.mv is not None] == ["stiction", *["no_stiction"] * 2]


@pytest.mark.parametrize("share", [0.05, 0.15])
def test_samples_lost_one_by_one_hide_neither_the_controllers_own_nor_S(share):
    # What is held over a lost sample is a value that the controller never saw, and may trip the valve a sample late.
    found = st.diagnose(missing(replace(sticky(N), mv=None), share, seed=3))
    assert found.verdict == "stiction"
    assert found.identification.own_samples
    assert found.identification.S_low <= 5.0 <= found.identification.S_high
    assert found.identification.S_high < 1.2 * found.identification.S_low


def test_a_steady_error_is_told_as_one():
    still = st.LoopRecord("FC1", 1.0, op=np.linspace(50.0, 51.0, 300), pv=np.full(300, 50.0), sp=np.full(300, 51.0))
    assert "1 below SP: a steady error" in find_oscillation(still).reason
    assert "missing" in find_oscillation(replace(still, pv=np.full(300, np.nan))).reason
