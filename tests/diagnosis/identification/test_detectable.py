"""From which S on a valve that sticks would have shown in a record in which none was found."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identification.detectable import _answer
from stiction.diagnosis.identified import ProcessFit

N = 2000


def moved(seed, valve=None, noise=0.05):
    """A flow loop whose set point a master moves, and a load beside it."""
    rng = np.random.default_rng(seed)
    master = np.repeat(rng.uniform(-6.0, 6.0, N // 80), 80)
    load = np.convolve(rng.normal(size=N + 40), np.ones(40) / 40.0, "valid")[:N]
    loop = st.Loop(st.PID(0.4, 10.0), valve or st.Ideal(), st.FOPDT(1.0, 8.0, 2.0), dt=1.0, noise=noise)
    record = st.simulate(loop, 50.0 + master, float(N), load, seed=seed, pv_start=50.0, op_start=50.0)
    return replace(record, mv=None, loop_type="flow", integrating=False)


@pytest.mark.parametrize("seed", range(3))
def test_a_valve_with_that_much_is_told_where_it_is(seed):
    good = st.diagnose(moved(seed))
    S = good.identification.S_detectable
    assert good.verdict == "no_stiction"
    assert f"A valve that sticks with S of {S:.2g} % or more and jumps by half of it would most" in good.reason
    for more in (1.0, 1.5):
        sticky = st.diagnose(moved(seed, st.Kano(more * S, 0.5 * more * S)))
        assert sticky.verdict == "stiction"
        assert pytest.approx(more * S, rel=0.1) == sticky.identification.S


@pytest.mark.parametrize("seed", range(3))
def test_noise_hides_it(seed):
    calm, noisy = (st.identify(moved(seed, noise=noise)).S_detectable for noise in (0.05, 1.0))
    assert calm < noisy


def test_nothing_is_said_where_op_does_not_move_the_pv():
    record = moved(0)
    other = replace(record, pv=50.0 + np.random.default_rng(5).normal(size=N))
    assert not np.isfinite(st.identify(other).S_detectable)


def test_nothing_is_said_of_a_record_slower_than_its_controller():
    from stiction.simulation.historian import averaged

    assert math.isnan(st.identify(averaged(moved(1), 4.0)).S_detectable)


def test_nothing_is_said_beside_a_wave_from_outside():
    loop = st.Loop(st.PID(0.2, 10.0), st.Ideal(), st.FOPDT(1.0, 8.0, 2.0), dt=1.0, noise=0.05)
    wave = 3.0 * np.sin(2.0 * np.pi * np.arange(N) / 60.0)
    record = st.simulate(loop, 50.0, float(N), wave, seed=1, pv_start=50.0, op_start=50.0)
    found = st.diagnose(replace(record, mv=None))
    assert found.cause == "external disturbance"
    assert "would most likely have shown" not in found.reason


@pytest.mark.parametrize("period", [40.0, 150.0])
@pytest.mark.parametrize("integrating", [True, False])
def test_the_answer_to_a_sine_is_that_of_the_transfer_function(period, integrating):
    dt, k = 0.5, np.arange(20_000)
    s = 2j * np.pi / period
    fit = ProcessFit(0.3, 9.0, 4.0, integrating, lag=0.0 if integrating else 2.0)
    lags = (1.0 + 9.0 * s) if integrating else (1.0 + 7.0 * s) * (1.0 + 2.0 * s)
    expected = 0.3 / lags / (s if integrating else 1.0) * np.exp(-4.0 * s)
    stem = np.sin(2.0 * np.pi * k * dt / period)
    pv = _answer(fit, stem, dt)[-8000:]
    wave = np.exp(-s * k[-8000:] * dt)
    found = 2j * np.mean((pv - pv.mean()) * wave)
    assert abs(found) == pytest.approx(abs(expected), rel=0.02)
    assert np.angle(found / expected) == pytest.approx(0.0, abs=2.0 * np.pi * 1.5 * dt / period)
