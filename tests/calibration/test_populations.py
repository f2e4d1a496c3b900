"""The population is what it says: causes, seeds, valves and their truth, margins, periods, noise, historian."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import stiction as st
from calibration.historian import EFFECTS
from calibration.populations import (
    CAUSES,
    plant_population,
    population,
    two_fault_population,
    upset_population,
    wandering_population,
)
from calibration.populations.loads import SHAPES, lagged_noise, wave
from calibration.populations.processes import KINDS, draw_loop, gain_margin, scale_gain
from calibration.populations.scenario import Scenario
from calibration.populations.upsets import upset_series
from calibration.populations.valves import MODELS, PUBLISHED_BODIES, physical_valve, sticky_valve
from calibration.populations.wandering import SHAPES as WANDERING
from calibration.populations.wandering import wandering_wave
from stiction.errors import ParameterError

OWN = ("stiction", "deadband", "tight tuning")
"""Causes that make the loop oscillate by itself."""


@cache
def drawn(cause):
    return tuple(population(12, (cause,), seed=11, historian=False))


def test_causes_come_in_turn():
    cases = list(population(7, ("none", "sensor", "stiction"), seed=3))
    assert [case.cause for case in cases] == ["none", "sensor", "stiction", "none", "sensor", "stiction", "none"]
    assert [case.sticky for case in cases] == [False, False, True, False, False, True, False]
    assert len({case.record.tag for case in cases}) == 7


def test_a_seed_is_a_population():
    first, again, other = (list(population(3, ("stiction", "none"), seed=seed)) for seed in (5, 5, 6))
    longer = list(population(5, ("stiction", "none"), seed=5))
    for one, two, three in zip(first, again, longer, strict=False):
        np.testing.assert_array_equal(one.record.op, two.record.op)
        np.testing.assert_array_equal(one.record.pv, two.record.pv)
        np.testing.assert_array_equal(one.record.pv, three.record.pv)
    assert not np.array_equal(first[0].record.op, other[0].record.op)


def test_bad_arguments_are_errors():
    assert list(population(0)) == []
    with pytest.raises(ParameterError, match="'bent stem' is unknown"):
        list(population(1, ("bent stem",)))


@pytest.mark.parametrize("cause", CAUSES)
def test_records_are_what_a_plant_would_have(cause):
    for case in drawn(cause):
        record = case.record
        assert record.mv is None
        assert 490 <= record.op.size == record.pv.size <= 4000
        assert np.isfinite(record.op).all()
        assert np.isfinite(record.pv).all()
        assert record.op.min() >= 0.0
        assert record.op.max() <= 100.0
        at_limit = np.mean((record.op <= 0.1) | (record.op >= 99.9))
        assert (0.05 < at_limit < 0.75) if cause == "saturation" else at_limit < 0.05
        assert record.integrating == (case.loop.process.den[-1] == 0.0)
        assert record.dt / case.loop.dt == pytest.approx(round(record.dt / case.loop.dt))
        if np.isfinite(case.period):
            assert 5.9 <= case.cycles <= 63.0
            assert 7.9 <= case.period / record.dt <= 200.1


def test_the_variety_that_is_promised_is_there():
    cases = list(population(70, seed=2))
    assert {case.cause for case in cases} == set(CAUSES)
    assert any(case.record.sp is None for case in cases)
    assert any(case.loop.controller.Kc < 0.0 for case in cases)
    assert any(case.loop.controller.Td > 0.0 for case in cases)
    assert any(case.record.dt > case.loop.dt and not case.effects for case in cases)
    spoiled = [case for case in cases if case.effects]
    assert 13 <= len(spoiled) <= 34
    assert {effect for case in spoiled for effect in case.effects} <= set(EFFECTS)
    assert not any(case.effects for case in population(14, seed=2, historian=False))


@pytest.mark.parametrize("model", MODELS)
def test_drawn_sticky_valve_has_the_stated_band_and_jump(model):
    # Told from outside: up far enough to stick on the way, back by what does and what does not free the stem.
    rng = np.random.default_rng(4)
    for _ in range(3):
        valve, S, J = sticky_valve(rng, 1.0, model)
        assert 0.0 < J <= S * (1.0 + 1e-9)
        level = 50.0
        gain = valve.gain if isinstance(valve, st.PhysicalValve) else 1.0
        offset = valve.offset if isinstance(valve, st.PhysicalValve) else 0.0
        up = level + (S + J) / 2.0 * 1.001
        signal = offset + np.repeat([level, up, up - 0.99 * S, up - 1.01 * S], 300)
        mv = st.stroke(valve, signal, dt=1.0, mv_start=gain * level).mv / gain
        rest, pushed, held, freed = (mv[k * 300 + 299] for k in range(4))
        assert pushed - rest == pytest.approx(J, abs=0.01 * S), "the slip out of the middle of the band"
        assert held == pytest.approx(pushed, abs=1e-6)
        assert freed - pushed == pytest.approx(-J - 0.01 * S, abs=0.02 * S), "the slip on the way back"


@pytest.mark.parametrize("body", PUBLISHED_BODIES)
def test_a_physical_valve_keeps_its_body(body):
    from stiction.models.parameter_sets import published_valve

    valve, S, J = physical_valve(body, 3.0, 2.0)
    assert (valve.mass, valve.spring_rate) == (published_valve(body).mass, published_valve(body).spring_rate)
    assert 0.0 < J <= S


def test_sticky_valves_stick_and_play_does_not():
    for case in drawn("stiction"):
        assert case.S > 0.0
        assert 0.0 < case.J <= case.S * (1.0 + 1e-9)
    for case in drawn("deadband"):
        assert 0.0 <= case.J < 0.1 * case.S
        assert case.record.integrating


@pytest.mark.parametrize("cause", [cause for cause in CAUSES if cause not in ("stiction", "deadband")])
def test_other_loops_have_good_valves(cause):
    for case in drawn(cause):
        assert isinstance(case.loop.valve, st.Ideal)
        assert case.S == case.J == 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_loops_have_their_margin(kind):
    rng = np.random.default_rng(1)
    for _ in range(5):
        drawn_loop = draw_loop(rng, 2.0, kind)
        if drawn_loop is None:
            continue
        loop = drawn_loop[0]
        found, period = gain_margin(loop)
        assert found >= 1.7 * (1.0 - 1e-6)
        load = np.where(np.arange(4000) < 20, 1.0, 0.0)
        open_ended = replace(loop, controller=replace(loop.controller, op_limits=(-np.inf, np.inf)))
        for factor, grows in ((0.98, False), (1.02, True)):
            pv = st.simulate(scale_gain(open_ended, found * factor), 0.0, 8000.0, load).pv
            early, late = np.ptp(pv[500:1500]), np.ptp(pv[3000:])
            assert (late > early) == grows
        turns = np.flatnonzero((pv[3000:-1] < 0.0) & (pv[3001:] >= 0.0))
        assert np.diff(turns).mean() * 2.0 == pytest.approx(period, rel=0.05)


def rises(x):
    """Samples at which x comes up through its mean, after having gone below by a tenth of its swing."""
    level, band = x.mean(), 0.1 * np.ptp(x)
    low, found = False, []
    for k, value in enumerate(x - level):
        if value < -band:
            low = True
        elif value > band and low:
            low = False
            found.append(k)
    return np.array(found)


def test_periods_are_as_counted_in_the_op():
    counted = 0
    for cause in OWN:
        for case in population(12, (cause,), seed=11, noise=0.0, historian=False):
            if case.load or " " in case.kind or case.kind in ("intermittent", "excited"):
                continue
            found = np.median(np.diff(rises(case.record.op))) * case.record.dt
            counted += abs(found / case.period - 1.0) < 0.12
    assert counted >= 10


def test_an_external_disturbance_leaves_its_period_in_the_pv():
    found = 0
    for case in drawn("external disturbance"):
        pv = case.record.pv - case.record.pv.mean()
        power = np.abs(np.fft.rfft(pv * np.hanning(pv.size))) ** 2
        found += abs(np.argmax(power[3:]) + 3 - case.cycles) <= 1.0 + 0.05 * case.cycles
    assert found >= 10


def test_tight_loops_are_stable():
    for case in drawn("tight tuning"):
        assert 1.0 < gain_margin(case.loop)[0] < 1.15


def test_a_coarse_sensor_reports_whole_steps():
    for case in drawn("sensor"):
        pv = case.record.pv
        if case.kind == "coarse":
            assert np.diff(np.unique(pv)).min() > 0.05 * np.ptp(pv)
        if case.kind == "sticking":
            assert np.mean(np.diff(pv) == 0.0) > 0.15


@pytest.mark.parametrize("sticks", [True, False])
def test_time_varying_driver_equals_the_plain_one_without_changes(sticks):
    valve = st.Kano(4.0, 2.0)
    loop = st.Loop(st.PID(0.4, 12.0, op_limits=(0.0, 100.0)), valve, st.SOPDT(1.5, 9.0, 3.0, 2.5), dt=1.0)
    load = lagged_noise(np.random.default_rng(1), 600, 20.0)
    nothing = np.zeros(600)
    plan = Scenario(loop, nothing, load, nothing, "", sticks=np.full(600, sticks))
    plain = replace(plan, sticks=None, loop=loop if sticks else replace(loop, valve=st.Ideal()))
    np.testing.assert_allclose(plan.run().pv, plain.run().pv, atol=1e-6)
    assert (np.ptp(plan.run().pv) > 1.0) or not sticks


def test_intermittent_valve_sticks_in_the_stated_periods():
    cases = [c for c in population(60, ("stiction",), seed=7, historian=False) if c.kind == "intermittent"]
    assert cases
    for case in cases:
        ((first, last),) = case.sticking
        assert 0 <= first < last <= len(case.record)
        assert 0.35 < (last - first) / len(case.record) < 0.75


def test_one_event_moves_a_quiet_loop():
    cases = [c for c in population(150, ("none",), seed=3, historian=False, noise=0.0) if "event" in c.kind]
    assert {case.kind for case in cases} == {"event", "event of the set point"}
    for case in cases:
        op = case.record.op
        moved = [np.ptp(part) for part in np.array_split(op, 20)]
        assert max(moved) > 5.0 * np.median(moved)


@pytest.mark.parametrize("shape", SHAPES)
def test_waves_have_their_period_and_size(shape):
    x = wave(np.random.default_rng(3), shape, 4000, 50.0)
    assert np.abs(x).max() == pytest.approx(1.0, abs=0.05)
    np.testing.assert_allclose(x[:-50], x[50:], atol=1e-6)
    assert np.argmax(np.abs(np.fft.rfft(x - x.mean()))) == 80


def test_lagged_noise_has_its_spread_and_its_correlation():
    x = lagged_noise(np.random.default_rng(0), 200_000, 10.0)
    assert x.std() == pytest.approx(1.0, rel=0.05)
    assert np.corrcoef(x[:-10], x[10:])[0, 1] == pytest.approx(np.exp(-1.0), abs=0.03)


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_noise_is_a_share_of_the_swing(noise):
    for case in population(6, ("stiction",), seed=11, noise=noise, historian=False):
        swing = np.ptp(case.record.pv)
        assert case.noise == case.loop.noise <= noise * swing
        assert (case.noise > 0.0) == (noise > 0.0)


@cache
def kept_by_a_plant():
    return tuple(plant_population(90, seed=4))


def test_a_plants_loops_are_a_seed_and_one_in_three_sticks():
    cases, again = kept_by_a_plant(), list(plant_population(4, seed=4))
    for one, two in zip(cases, again, strict=False):
        np.testing.assert_array_equal(one.record.op, two.record.op)
        np.testing.assert_array_equal(one.record.pv, two.record.pv)
    assert [case.sticky for case in cases] == [i % 3 == 0 for i in range(90)]
    assert {case.cause for case in cases} == {"stiction", "none", "external disturbance", "tight tuning"}
    assert len({case.record.tag for case in cases}) == 90


def test_a_plants_records_are_slower_than_its_controllers():
    for case in kept_by_a_plant():
        record = case.record
        assert record.mv is None
        assert 490 <= record.op.size == record.pv.size <= 2000
        assert np.isfinite([record.op, record.pv]).all()
        assert np.mean((record.op <= 0.1) | (record.op >= 99.9)) < 0.03
        assert record.dt / case.loop.dt == pytest.approx(round(record.dt / case.loop.dt))
        assert bool(set(case.effects) & {"averaging", "sampling"}) == (record.dt > case.loop.dt)
        assert record.integrating == (record.loop_type == "level")
        assert set(case.effects) <= set(EFFECTS)
    slower = [case.record.dt > case.loop.dt for case in kept_by_a_plant()]
    assert np.mean(slower) > 0.7
    moved = [np.ptp(case.record.sp) > 0.0 for case in kept_by_a_plant() if case.record.sp is not None]
    assert 0.3 < np.mean(moved) < 0.8


def test_a_plants_sticky_valve_has_a_band_and_is_asked_to_leave_it():
    for case in kept_by_a_plant():
        if not case.sticky:
            assert (case.S, case.J) == (0.0, 0.0)
            continue
        assert 0.2 <= case.S <= 10.0
        assert 0.1 * case.S * (1.0 - 1e-9) <= case.J <= case.S * (1.0 + 1e-9)
        assert np.ptp(case.record.op) > 0.2 * case.S


def test_loops_that_something_upsets_rest_in_between():
    cases = list(upset_population(30, seed=3))
    assert [case.sticky for case in cases] == [True, False, False] * 10
    assert {case.kind.rpartition(" ")[0].rpartition(", ")[2] for case in cases} >= {"steps of the", "pulses of the"}
    for one, again in zip(cases[:3], upset_population(3, seed=3), strict=True):
        np.testing.assert_array_equal(one.record.op, again.record.op)
    for case in cases:
        assert case.record.mv is None
        assert case.S > 0.0 if case.sticky else case.S == case.J == 0.0


def test_loops_that_a_wandering_wave_moves_are_drawn_again_alike():
    cases = list(wandering_population(30, seed=3))
    assert [case.sticky for case in cases] == [True, False, False] * 10
    assert {case.cause for case in cases} == {"stiction", "external disturbance"}
    for one, again in zip(cases[:3], wandering_population(3, seed=3), strict=True):
        np.testing.assert_array_equal(one.record.op, again.record.op)
    for case in cases:
        assert case.record.mv is None
        assert case.S > 0.0 if case.sticky else case.S == case.J == 0.0


@pytest.mark.parametrize("shape", WANDERING)
def test_a_wandering_wave_has_one_size_and_no_clock(shape):
    wave = wandering_wave(np.random.default_rng(5), shape, 60_000, 100.0, 0.2)
    assert np.abs(wave).max() == pytest.approx(1.0, abs=0.03)
    rises = np.flatnonzero((wave[:-1] < 0.0) & (wave[1:] >= 0.0))
    lengths = np.log(np.diff(rises))
    # A period is measured from the middle of one to the middle of the next.
    assert np.exp(np.median(lengths)) == pytest.approx(100.0, rel=0.05)
    assert 0.1 < lengths.std() < 0.25


def test_a_loop_with_two_faults_has_both():
    cases = list(two_fault_population(40, seed=3))
    assert {case.cause for case in cases} == {"stiction"}
    for one, again in zip(cases[:3], two_fault_population(3, seed=3), strict=True):
        np.testing.assert_array_equal(one.record.op, again.record.op)
    faults = [case.kind.rpartition(", ")[2] for case in cases]
    assert set(faults) == {"at a limit", "spikes", "coarse", "sticking"}
    for case, fault in zip(cases, faults, strict=True):
        assert case.record.mv is None
        assert 0.0 < case.J <= case.S * (1.0 + 1e-9)
        pv, op = case.record.pv[np.isfinite(case.record.pv)], case.record.op
        if case.effects:
            continue
        if fault == "at a limit":
            assert np.mean((op > 99.9) | (op < 0.1)) > 0.03
        if fault == "spikes":
            far = np.abs(pv - np.median(pv))
            assert far.max() > 1.2 * np.quantile(far, 0.97)
        if fault == "coarse":
            assert np.unique(np.round(pv, 6)).size < 200


def test_a_short_record_is_cut_out_of_a_long_one_where_the_cause_shows():
    causes = ("stiction", "tight tuning")
    long, short = (list(population(60, causes, 17, historian=False, samples=size)) for size in (None, (100, 300)))
    sizes = [len(case.record) for case in short]
    assert min(sizes) >= 100
    assert max(sizes) <= 300
    assert len(set(sizes)) > 30
    starts = []
    for whole, cut in zip(long, short, strict=True):
        n = len(cut.record)
        inside = np.lib.stride_tricks.sliding_window_view(whole.record.pv, n)
        (at,) = np.flatnonzero((inside == cut.record.pv).all(axis=1))
        np.testing.assert_array_equal(cut.record.op, whole.record.op[at : at + n])
        assert cut.cycles == pytest.approx(n * cut.record.dt / cut.period, nan_ok=True)
        if whole.kind == "ringing":
            assert at == 0
        elif whole.sticking:
            (first, last), (begin, end) = whole.sticking[0], cut.sticking[0]
            assert (begin, end) == (max(first - at, 0), min(last - at, n))
            assert end - begin >= 0.9 * min(n, last - first)
        else:
            starts.append(at)
    assert {case.kind for case in short} >= {"ringing", "intermittent"}
    assert len(set(starts)) > 30


@pytest.mark.parametrize(("shape", "least"), [("steps", 0.95), ("pulses", 0.9), ("ramps", 0.0)])
def test_upsets_are_few_and_up_to_one_in_size(shape, least):
    for seed in range(20):
        series = upset_series(np.random.default_rng(seed), shape, 3000, 2)
        assert series.shape == (3000,)
        assert np.abs(series).max() <= 1.0
        assert np.mean(np.diff(series) == 0.0) >= least
