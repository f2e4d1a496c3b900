"""The population is what it says: causes, seeds, valves, noise, periods."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import stiction as st
from stiction.errors import ParameterError
from stiction.simulation.population import CAUSES, population

OWN = ("stiction", "deadband", "tight tuning")
"""Causes that make the loop oscillate by itself."""


@cache
def drawn(cause):
    return tuple(population(6, (cause,), seed=11))


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


def test_nothing_and_nonsense():
    assert list(population(0)) == []
    with pytest.raises(ParameterError, match="'bent stem' is unknown"):
        list(population(1, ("bent stem",)))


@pytest.mark.parametrize("cause", CAUSES)
def test_records_are_what_a_plant_would_have(cause):
    for case in drawn(cause):
        record = case.record
        assert record.mv is None
        assert record.pv.size == record.op.size == record.sp.size >= 300
        assert np.isfinite(record.op).all()
        assert np.isfinite(record.pv).all()
        assert record.op.min() >= 0.0
        assert record.op.max() <= 100.0
        assert np.mean((record.op <= 0.1) | (record.op >= 99.9)) < 0.05
        integrates = case.loop.process.den[-1] == 0.0
        assert record.loop_type == ("level" if integrates else "flow")
        assert record.integrating == integrates


def test_sticky_valves_are_in_their_ranges():
    for case in drawn("stiction"):
        valve = case.loop.valve
        assert isinstance(valve, st.Kano)
        assert 1.0 <= valve.S <= 10.0
        assert 0.2 <= valve.J / valve.S <= 1.0


def test_deadband_is_play_on_an_integrating_process():
    for case in drawn("deadband"):
        assert isinstance(case.loop.valve, st.Kano)
        assert case.loop.valve.J == 0.0
        assert case.record.integrating


@pytest.mark.parametrize("cause", [cause for cause in CAUSES if cause not in ("stiction", "deadband")])
def test_other_loops_have_good_valves(cause):
    assert all(isinstance(case.loop.valve, st.Ideal) for case in drawn(cause))


@pytest.mark.parametrize("cause", OWN)
def test_periods_are_as_counted_in_the_op(cause):
    for case in population(6, (cause,), seed=11, noise=0.0):
        stated = len(case.record) / case.cycles
        assert np.median(np.diff(rises(case.record.op))) == pytest.approx(stated, rel=0.1)


@pytest.mark.parametrize("cause", OWN)
def test_noise_leaves_a_cycle(cause):
    # Noise sets slips off early or late: the cycle is no longer quite that of the loop without noise.
    for case in drawn(cause):
        assert case.cycles >= 8.0
        assert rises(case.record.op).size >= 6


def test_an_external_disturbance_leaves_its_period_in_the_pv():
    for case in drawn("external disturbance"):
        pv = case.record.pv - case.record.pv.mean()
        t = np.arange(pv.size)
        power = np.abs(np.fft.rfft(pv * np.hanning(pv.size))) ** 2
        assert np.argmax(power) == pytest.approx(t.size / (len(case.record) / case.cycles), abs=1.0)


def test_tight_loops_are_stable_and_die_out_slowly():
    for case in drawn("tight tuning"):
        run = st.simulate(
            case.loop.__class__(case.loop.controller, case.loop.valve, case.loop.process, case.loop.dt),
            50.0, 12_000.0, np.where(np.arange(12_000) < 20, 3.0, 0.0), pv_start=50.0, op_start=50.0,
        )  # fmt: skip
        early, late = np.ptp(run.pv[1000:4000]), np.ptp(run.pv[9000:12_000])
        assert late < early


def test_coarse_sensors_show_few_values():
    for case in drawn("sensor"):
        assert np.unique(case.record.pv).size < 40
        steps = np.diff(np.unique(case.record.pv))
        assert steps.min() > 0.1 * np.subtract(*np.percentile(case.record.pv, (99, 1)))


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_noise_is_a_share_of_the_swing(noise):
    for case in population(6, ("stiction",), seed=11, noise=noise):
        swing = np.ptp(case.record.pv)
        assert case.loop.noise <= noise * swing
        assert (case.loop.noise > 0.0) == (noise > 0.0)
