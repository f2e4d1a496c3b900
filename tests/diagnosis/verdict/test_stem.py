"""A recorded valve position decides where it is one, and changes nothing where it is not."""

from __future__ import annotations

import importlib
import math
from dataclasses import replace
from functools import cache
from itertools import islice

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import stiction as st
from calibration.populations import CAUSES, population
from stiction.diagnosis.identification.position import watch
from stiction.diagnosis.verdict.probability import causes
from stiction.diagnosis.verdict.stem import AGAINST, MOST, Shown, stem_shown
from stiction.report.story import story

page = importlib.import_module("stiction.diagnosis.verdict.diagnose")

N = 900


@cache
def loop(S, J, seed=1):
    """A flow loop that a load moves, with the position as a good transmitter gives it."""
    valve = st.Kano(S, J) if S else st.Ideal()
    made = st.Loop(st.PID(0.35, 6.0), valve, st.FOPDT(1.5, 4.0, 2.0), dt=1.0, noise=0.1)
    load = 3.0 * np.sin(2.0 * np.pi * np.arange(N) / 60.0)
    run = st.simulate(made, 70.0, float(N), load, seed=seed, pv_start=70.0, op_start=50.0, tag="FC1", loop_type="flow")
    assert run.mv is not None
    return replace(run, mv=run.mv + 0.1 * np.random.default_rng(seed).normal(size=N))


def not_a_stem():
    """What is recorded as the position and says nothing of the stem."""
    op = loop(5.0, 3.0).op
    rng = np.random.default_rng(0)
    return {
        "echo": op,
        "echo, coarse and late, in mA": 4.0 + 0.16 * np.round(np.concatenate([op[:1], op[:-1]]) / 0.5) * 0.5,
        "frozen": np.full(N, 43.0),
        "unrelated": 50.0 + 5.0 * np.sin(np.arange(N) / 7.3) + 0.1 * rng.normal(size=N),
        "missing": np.where(np.arange(N) < 30, op, np.nan),
    }


@pytest.mark.parametrize("kind", list(not_a_stem()))
def test_a_position_that_is_none_changes_nothing_but_the_reason(kind):
    record = replace(loop(5.0, 3.0), mv=not_a_stem()[kind])
    found, without = st.diagnose(record), st.diagnose(replace(record, mv=None))
    row, *others = found.evidence[1:]
    told, before = found.to_dict(), without.to_dict()
    assert not row.valid
    assert row.why in found.reason
    assert kind.partition(",")[0] == stem_shown(record).what
    assert [other.to_dict() for other in others] == [other.to_dict() for other in without.evidence[1:]]
    for key in told.keys() - {"reason", "evidence"}:
        assert told[key] == before[key], key
    assert found.reason.replace(f" {row.why}", "") == without.reason


def test_without_a_position_nothing_of_it_is_asked(monkeypatch):
    asked = []
    stem = importlib.import_module("stiction.diagnosis.verdict.stem")
    monkeypatch.setattr(stem, "watch", lambda *signals: asked.append(signals) or watch(*signals))
    with_one = loop(5.0, 3.0)
    told = [st.diagnose(record).to_dict() for record in (replace(with_one, mv=None), with_one)]
    assert len(asked) == 1
    np.testing.assert_array_equal(asked[0][1], with_one.mv)
    named = [{row["method"] for row in one["evidence"]} | {row["feature"] for row in one["counted"]} for one in told]
    assert ["stem" in names for names in named] == [False, True]


@pytest.mark.parametrize(
    ("S", "J", "what", "verdict"),
    [(5.0, 3.0, "stiction", "stiction"), (4.0, 0.0, "deadband", "no_stiction"), (0.0, 0.0, "good", "no_stiction")],
)
def test_a_position_shows_what_the_valve_is(S, J, what, verdict):
    record = loop(S, J)
    found = st.diagnose(record)
    assert stem_shown(record).what == what
    assert (found.verdict, found.evidence[1].vote) == (verdict, verdict)
    assert found.cause in ({"none", "external disturbance"} if what == "good" else {what})
    assert found.evidence[1].why in found.reason
    if S:
        assert pytest.approx(S, rel=0.05) == found.identification.S
        assert pytest.approx(J, abs=0.15 * S) == found.identification.J
        assert found.identification.S_low <= S <= found.identification.S_high


def test_what_the_position_shows_is_counted_and_told():
    record = loop(5.0, 3.0)
    found, seen = st.diagnose(record), page.findings(record)
    told = seen.stem.weighed(causes(seen.features))
    odds = told["stiction"] / (1.0 - told["stiction"] - told["deadband"])
    assert math.log(odds) == pytest.approx(sum(one.log_odds for one in found.counted), abs=1e-6)
    assert sum(found.causes.values()) == pytest.approx(1.0)
    assert found.evidence[1].why in next(step.lines for step in story(found) if "position" in step.title)


def test_doubts_about_the_data_hold_back_a_position_too():
    record = loop(5.0, 3.0)
    held = replace(record, op=np.repeat(record.op[::6], 6), pv=np.repeat(record.pv[::6], 6))
    found = st.diagnose(held)
    assert found.quality.warnings or found.quality.rejections
    assert found.probability <= 0.9


@settings(deadline=None, max_examples=12)
@given(
    unit=some.sampled_from([(0.16, 4.0), (0.01, 0.0), (-1.0, 100.0), (-0.16, 20.0)]), offset=some.floats(-5.0, 5.0),
    S=some.sampled_from([0.0, 5.0]),
)  # fmt: skip
def test_scale_and_offset_of_the_position_do_not_matter(unit, offset, S):
    record = loop(S, 0.6 * S)
    plain = stem_shown(record)
    other = stem_shown(replace(record, mv=unit[0] * (record.mv + offset) + unit[1]))
    assert other.what == plain.what
    assert pytest.approx(plain.valve.S, rel=0.02, abs=0.1) == other.valve.S
    assert abs(other.band - plain.band) < 1.0


def test_a_scale_that_is_no_unit_gives_the_same_verdict():
    record = loop(5.0, 3.0)
    assert stem_shown(replace(record, mv=3.7 * record.mv - 20.0)).what == "stiction"


@settings(deadline=None)
@given(shares=some.tuples(*[some.floats(1e-6, 1.0)] * 3), band=some.floats(-MOST, MOST), jump=some.floats(-9.0, 9.0))
def test_odds_of_a_band_are_multiplied_and_a_jump_is_for_stiction(shares, band, jump):
    before = dict(zip(("stiction", "deadband", "none"), np.array(shares) / sum(shares), strict=True))
    after = Shown("good", "", None, band, jump).weighed(before)
    assert sum(after.values()) == pytest.approx(1.0)
    other = max(math.log(1.0 / before["none"] - 1.0), -AGAINST)
    assert math.log(1.0 / after["none"] - 1.0) == pytest.approx(band + other, abs=1e-6)
    more = Shown("good", "", None, band, jump + 1.0).weighed(before)
    assert more["stiction"] > after["stiction"]


def shown(n, causes, seed, position="stem"):
    """What the positions of short records of a population show; the historian's effects are other tests' matter."""
    drawn = population(20 * n, causes, seed, historian=False, position=position)
    short = (case for case in drawn if len(case.record) <= 1500)
    return [(case, stem_shown(case.record)) for case in islice(short, n)]


def test_bands_are_seen_and_good_valves_are_not_called_sticky():
    sticky = shown(30, ("stiction", "deadband"), 811)
    good = shown(30, tuple(cause for cause in CAUSES if cause not in ("stiction", "deadband")), 812)
    # 28 where this was written, 27 on another kind of processor: the last digits of a loop decide.
    assert sum(seen.band > 0.0 for _, seen in sticky) >= 27
    assert sum(seen.band > 0.0 for _, seen in good) <= 1


@pytest.mark.parametrize("position", ["echo", "frozen", "another"])
def test_what_is_no_stem_is_not_used(position):
    assert not any(seen.used for _, seen in shown(14, CAUSES, 813, position))


def test_S_is_measured_where_the_record_has_the_controllers_samples():
    cases = [
        (case, seen)
        for case, seen in shown(45, ("stiction",), 814)
        if case.record.dt == case.loop.dt and "Kano" in case.kind and seen.what == "stiction"
    ]
    close = sum(abs(seen.valve.S / case.S - 1.0) < 0.05 for case, seen in cases)
    assert len(cases) >= 8
    assert close >= 0.85 * len(cases)


@pytest.mark.slow
@pytest.mark.xfail(
    reason="31 of 38 sticky ones found, 19 in 20 are asked: four pass for play, three hardly move", strict=True
)
def test_a_population_with_positions():
    sticky, good = [], []
    for case in population(280, CAUSES, 815, position="stem"):
        found = st.diagnose(case.record)
        if found.identification is None or not found.evidence[1].valid:
            continue
        called = found.verdict == "stiction"
        if case.cause == "stiction":
            sticky.append(called)
        elif case.cause != "deadband":
            good.append(called)
    assert sum(sticky) >= 0.95 * len(sticky)
    assert sum(good) <= 0.01 * len(good)


@cache
def drifting(S, J, drift, n=2000):
    """A flow loop that a wave of 1 % and a slow load of `drift` move, with a good position of the stem."""
    made = st.Loop(st.PID(0.35, 6.0), st.Kano(S, J) if S else st.Ideal(), st.FOPDT(1.5, 4.0, 2.0), dt=1.0, noise=0.05)
    t = np.arange(n)
    load = 1.5 * np.sin(2.0 * np.pi * t / 60.0) + 0.75 * drift * np.sin(2.0 * np.pi * t / n)
    run = st.simulate(made, 70.0, float(n), load, seed=1, pv_start=70.0, op_start=50.0, tag="FC1", loop_type="flow")
    assert run.mv is not None
    return replace(run, mv=(run.mv + 0.02 * np.random.default_rng(1).normal(size=n)).round(2))


@pytest.mark.parametrize("drift", [0.0, 10.0, 20.0, 40.0])
def test_how_far_OP_drifts_does_not_hide_a_band(drift):
    record = drifting(1.5, 0.9, drift)
    seen, found = stem_shown(record), st.diagnose(record)
    assert (seen.what, found.verdict) == ("stiction", "stiction")
    assert pytest.approx(1.5, rel=0.03) == seen.valve.S
    assert pytest.approx(0.9, rel=0.1) == seen.valve.J
    play = drifting(1.5, 0.0, drift)
    seen, found = stem_shown(play), st.diagnose(play)
    assert (seen.what, found.verdict) == ("deadband", "no_stiction")
    assert pytest.approx(1.5, rel=0.03) == seen.valve.S


@pytest.mark.parametrize("drift", [10.0, 20.0, 40.0])
@pytest.mark.parametrize(("S", "J"), [(0.0, 0.0), (0.2, 0.1), (0.4, 0.3)])
def test_a_small_band_is_that_of_a_good_valve_where_OP_goes_far(S, J, drift):
    record = drifting(S, J, drift)
    seen = stem_shown(record)
    assert seen.what == "good"
    assert seen.band == -MOST
    assert st.diagnose(record).verdict == "no_stiction"


@pytest.mark.parametrize("lag", [0.5, 3.0, 8.0])
@pytest.mark.parametrize("fastest", [0.5, 2.0, 100.0])
def test_a_good_valve_that_comes_slowly_after_steps_of_OP_has_no_band(lag, fastest):
    rng = np.random.default_rng(2)
    op = np.repeat(rng.uniform(25.0, 75.0, 20), 100) + np.convolve(rng.normal(size=2019), np.ones(20) / 20.0, "valid")
    stem = op.copy()
    for k in range(1, op.size):
        stem[k] = stem[k - 1] + np.clip((op[k] - stem[k - 1]) / (lag + 0.5), -fastest, fastest)
    seen = stem_shown(st.LoopRecord(op=op, pv=op, dt=1.0, tag="FC1", mv=stem + 0.02 * rng.normal(size=op.size)))
    assert not seen.used or seen.what == "good"


def test_a_band_within_the_noise_of_the_position_is_that_of_a_good_valve():
    noise = 0.5 * np.random.default_rng(0).normal(size=2000)
    shown = {
        S: stem_shown(replace(drifting(S, 0.6 * S, 20.0), mv=drifting(S, 0.6 * S, 20.0).mv + noise)) for S in (0.8, 3.0)
    }
    assert [seen.what for seen in shown.values()] == ["good", "stiction"]


def test_no_size_is_small_in_a_unit_of_which_the_span_is_not_known():
    record = drifting(0.4, 0.3, 20.0)
    counts = replace(record, op=40.95 * record.op)
    assert counts.op_unit_short != "%"
    assert stem_shown(counts).what == "good"


@cache
def driven(S=3.0, J=0.6, swing=2.4):
    """A flow loop that a wave from outside drives, with the stem's own position."""
    made = st.Loop(st.PID(0.309, 14.0), st.Kano(S, J), st.FOPDT(1.186, 14.0, 9.17), dt=1.0, noise=0.06)
    load = swing * np.sin(2.0 * np.pi * np.arange(1500) / 137.0)
    return st.simulate(made, 150.0, 1500.0, load, seed=11, pv_start=150.0, op_start=50.0, tag="FC1", loop_type="flow")


@pytest.mark.parametrize("decimals", [None, 4, 3, 2, 1])
def test_decimals_of_a_position_do_not_matter(decimals):
    record = driven()
    seen = stem_shown(record if decimals is None else replace(record, mv=np.round(record.mv, decimals)))
    assert seen.what == "stiction"
    assert pytest.approx(3.0, rel=0.02) == seen.valve.S
    assert pytest.approx(0.6, abs=0.06) == seen.valve.J


def test_a_position_that_shows_sticking_is_heard_beside_a_wave_from_outside():
    record = driven()
    assert st.diagnose(replace(record, mv=None)).probability <= 0.1
    found = st.diagnose(replace(record, mv=record.mv.round(3)))
    assert found.verdict == "stiction"
    assert found.probability < 0.95  # the other findings speak for a good valve
    assert "Check packing" in found.action


def test_a_position_hangs_where_pv_follows_a_moved_set_point():
    steps = 150.0 + 12.0 * (np.arange(1500) // 150 % 2)
    loop = st.Loop(st.PID(0.3, 10.0), st.Ideal(), st.FOPDT(1.5, 8.0, 3.0), dt=1.0, noise=0.1)
    run = st.simulate(loop, steps, 1500.0, seed=5, pv_start=150.0, op_start=50.0, tag="FC1", loop_type="flow")
    still = replace(run, mv=np.full(1500, 46.7))
    assert stem_shown(still).what == "hangs"
    assert st.diagnose(still).verdict == "no_stiction"
    assert stem_shown(replace(still, sp=None)).what == "frozen"
    wave = 156.0 + 4.0 * np.sin(np.arange(1500) / 20.0)
    assert stem_shown(replace(still, pv=wave)).what == "frozen"


def test_a_position_that_starts_from_zero_is_that_of_a_good_valve():
    op = 50.0 + 1.5 * np.sin(np.arange(1200.0) / 20.0) + 0.02 * np.random.default_rng(0).normal(size=1200)
    record = st.LoopRecord(op=op, pv=op, dt=1.0, tag="FC1", mv=np.convolve(op, [0.0, 0.5, 0.3, 0.2])[:1200].round(3))
    assert record.mv[0] == 0.0
    assert stem_shown(record).what == "good"


def test_a_stem_that_stands_still_is_not_called_good_where_pv_moves_without_it():
    stuck = driven(S=12.0, J=12.0)
    assert np.ptp(stuck.mv) == 0.0
    found = st.diagnose(stuck)
    assert found.verdict == "undecided"
    assert found.probability >= 0.1
    assert "stands still" in found.reason
    assert "Watch the stem" in found.action
    assert st.diagnose(replace(stuck, mv=None)).verdict == "no_stiction"
    noise = 0.05 * np.random.default_rng(0).normal(size=1500)
    assert st.diagnose(replace(stuck, mv=(stuck.mv + noise).round(2))).verdict == "undecided"
    coarse = stem_shown(replace(stuck, mv=stuck.mv + 20.0 * noise))
    assert coarse.what == "unrelated"  # a stem that follows would be lost in such noise
    rings = st.Loop(st.PID(0.9, 6.0), st.Ideal(), st.FOPDT(1.5, 6.0, 6.0), dt=1.0, noise=0.3)
    moved = st.simulate(rings, 70.0, 1500.0, seed=3, pv_start=70.0, op_start=50.0, tag="FC1", loop_type="flow")
    assert st.diagnose(replace(moved, mv=np.full(1500, 46.7))).verdict == "no_stiction"


def test_the_loop_does_not_depend_on_its_position():
    with_one, without = (list(population(7, seed=5, position=position)) for position in (True, False))
    for one, other in zip(with_one, without, strict=True):
        assert other.record.mv is None
        assert one.position
        np.testing.assert_array_equal(one.record.op, other.record.op)
        np.testing.assert_array_equal(one.record.pv, other.record.pv)
