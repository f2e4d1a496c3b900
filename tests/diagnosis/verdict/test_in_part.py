"""A valve that sticks in part of a record is found there: by OP and PV of a long one, by a recorded position of any."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import stiction as st
from calibration.populations.loads import lagged_noise
from stiction.diagnosis.identification.glance import glance
from stiction.diagnosis.verdict.in_part import AFTER, PARTS, PICKED, SHORTEST, suspects, told_of_part
from stiction.diagnosis.verdict.objection import Objection
from stiction.diagnosis.verdict.stem import stem_shown
from stiction.diagnosis.verdict.windows import Window

S, J = 4.0, 2.0
GOOD, STICKY = st.Ideal(), st.Kano(S, J)


def run(valve, n, seed):
    """A flow loop that a load wanders in, its position with noise."""
    rng = np.random.default_rng([seed, n])
    loop = st.Loop(st.PID(0.35, 4.0), valve, st.FOPDT(1.2, 2.5, 1.0), dt=1.0, noise=0.15)
    load = 0.6 * lagged_noise(rng, n, 60.0)
    record = st.simulate(loop, 60.0, float(n), load, seed, pv_start=60.0, op_start=50.0, loop_type="flow")
    return replace(record, mv=record.mv + rng.normal(0.0, 0.05, n))


@cache
def record_of(*stretches, seed=1, position=True):
    """Stretches of a good and of a sticky valve, one after the other, and where they meet."""
    parts = [run(STICKY if sticks else GOOD, n, seed + k) for k, (sticks, n) in enumerate(stretches)]
    whole = {name: np.concatenate([getattr(part, name) for part in parts]) for name in ("op", "pv", "sp", "mv")}
    return replace(parts[0], **{**whole, "mv": whole["mv"] if position else None})


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_last_hours_of_a_long_record_are_found(seed):
    found = st.diagnose(record_of((False, 16_000), (True, 4000), seed=seed, position=False))
    assert found.verdict == "stiction"
    assert found.probability == pytest.approx(0.9)
    assert sum(found.causes.values()) == pytest.approx(1.0)
    assert pytest.approx(S, rel=0.1) == found.identification.S
    assert found.reason.startswith("The valve sticks in part of the record, from 15000 s to 20000 s.")
    assert (found.quality.first, found.quality.last, found.quality.rows) == (15_000, 20_000, 20_000)
    sticky = [window for window in found.windows if window.verdict == "stiction"]
    assert sticky
    assert min(window.first for window in sticky) >= 15_000
    assert max(window.last for window in found.windows) <= 20_000
    assert found.reason.endswith(PICKED)
    assert AFTER not in found.action
    assert len(found.record) == 20_000


def test_a_valve_that_was_repaired_is_told_when_it_stuck():
    found = st.diagnose(record_of((True, 4000), (False, 12_000), position=False))
    assert found.verdict == "stiction"
    assert "from 0 s to 4000 s" in found.reason
    assert found.action.endswith(AFTER)


@pytest.mark.parametrize("position", [False, True])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_valve_that_is_good_all_the_time_stays_good(seed, position):
    found = st.diagnose(record_of((False, 12_000), seed=seed, position=position))
    assert found.verdict == "no_stiction"
    assert found.windows == ()


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_position_shows_it_in_a_record_of_any_length(seed, first):
    record = record_of(*((True, 600), (False, 4000))[:: 1 if first else -1], seed=seed)
    found = st.diagnose(record)
    assert found.verdict == "stiction"
    assert pytest.approx(S, rel=0.1) == found.identification.S
    assert pytest.approx(J, rel=0.2) == found.identification.J


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_stretch_in_which_a_position_is_off_is_cut_out(seed):
    record = record_of((False, 4000), (True, 600), seed=seed)
    whole = stem_shown(record)
    assert whole.what == "good"
    [cut] = suspects(record, whole)
    assert abs(cut.start - 4000) <= 150
    assert cut.stop == 4600


def test_nothing_is_cut_out_where_the_position_follows_or_none_was_recorded():
    good = record_of((False, 4000))
    sticky = record_of((True, 4000))
    for record, stem in ((good, stem_shown(good)), (replace(good, mv=None), None), (sticky, stem_shown(sticky))):
        assert list(suspects(record, stem)) == []


def window(first, last, verdict="stiction"):
    return Window(first, last, verdict, 3.0, 1.0, 90.0, 80.0)


@pytest.mark.parametrize(
    ("shown", "cuts"),
    [
        ([window(0, 900, "no_stiction"), window(900, 1500), window(1500, 2000), window(2000, 4000, "undecided")],
         [(900, 2000)]),
        ([window(0, 400), window(400, 3000, "no_stiction"), window(3000, 4000)], [(3000, 4000)]),
        ([window(0, 2000), window(2000, 4000)], []),
        ([window(0, SHORTEST - 1), window(SHORTEST - 1, 4000, "no_stiction")], []),
        ([window(0, 2000, "no_stiction"), window(2000, 4000, "undecided")], []),
    ],
)  # fmt: skip
def test_the_longest_stretch_of_windows_that_stick_is_cut_out(shown, cuts):
    record = record_of((False, 4000), position=False)
    assert [(cut.start, cut.stop) for cut in suspects(record, None, shown)] == cuts


def stepped(valve, n, seed):
    """A flow loop whose set point steps every 700 samples."""
    loop = st.Loop(st.PID(0.4, 6.0), valve, st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=0.1)
    sp = 60.0 + 3.0 * (np.arange(n) // 700 % 2)
    return st.simulate(loop, sp, float(n), 0.0, seed, pv_start=60.0, op_start=50.0, loop_type="flow")


@pytest.mark.parametrize("seed", [3, 4, 5, 6, 7])
def test_a_valve_that_sticks_for_a_third_of_a_record_of_any_length_is_found(seed):
    parts = [
        stepped(valve, n, 10 * seed + k) for k, (valve, n) in enumerate([(GOOD, 1500), (STICKY, 1200), (GOOD, 1300)])
    ]
    whole = {name: np.concatenate([getattr(part, name) for part in parts]) for name in ("op", "pv", "sp")}
    found = st.diagnose(replace(parts[0], mv=None, **whole))
    assert found.verdict == "stiction"
    assert found.probability == pytest.approx(0.9)
    assert pytest.approx(S, rel=0.1) == found.identification.S
    assert found.windows[0].first >= 1500
    assert found.windows[-1].last <= 3200
    assert found.reason.startswith("The valve sticks in part of the record")


def test_a_part_that_is_not_surely_sticky_changes_nothing():
    record = record_of((False, 12_000), position=False)
    whole = st.diagnose(record)
    for part in (st.diagnose(record.window(0, 3000)), replace(whole, verdict="stiction", probability=0.85)):
        assert told_of_part(whole, part, 0) is whole


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_glance_ranks_the_part_that_sticks_first(seed):
    record = record_of((False, 9000), (True, 3000), seed=seed, position=False)
    n = len(record) // PARTS
    likelier = [glance(record.window(k * n, (k + 1) * n)) for k in range(PARTS)]
    assert int(np.argmax(likelier)) == PARTS - 1


def test_a_glance_at_nothing_sees_nothing():
    record = record_of((False, 4000), position=False)
    assert glance(replace(record, op=np.full(4000, 50.0))) == -np.inf
    assert glance(replace(record, pv=np.full(4000, np.nan))) == -np.inf


def test_a_position_that_does_not_go_with_op_keeps_a_good_valve_from_being_surely_good():
    record = record_of((False, 3000))
    other = replace(record, mv=run(GOOD, 3000, 99).mv)
    assert stem_shown(other).what == "unrelated"
    assert st.diagnose(replace(record, mv=None)).probability < 0.1
    found = st.diagnose(other)
    assert found.probability == pytest.approx(0.1)
    assert Objection.ANOTHER_STEM in found.reason


def test_a_stem_that_rests_in_its_band_beside_a_wave_is_the_valves_own():
    """OP goes along with the wave and a stem of S + J seldom: they hardly correlate, and S and J explain it all."""
    k = np.arange(4000.0)
    rng = np.random.default_rng(3)
    op = 50.0 + 1.9 * np.sin(2.0 * np.pi * k / 31.0) + 1.6 * np.sin(2.0 * np.pi * k / 310.0)
    stem = st.stroke(st.Kano(4.0, 2.5), op, dt=1.0).mv
    record = st.LoopRecord("FIC-101", 1.0, op=op, pv=rng.normal(size=4000), mv=stem + rng.normal(0.0, 0.05, 4000))
    shown = stem_shown(record)
    assert shown.what == "stiction"
    assert pytest.approx(4.0, rel=0.05) == shown.valve.S
