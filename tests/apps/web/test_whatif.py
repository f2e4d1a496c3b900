"""The functions of the what-if screen against the library and against the exact limit cycles."""

from __future__ import annotations

import math
from dataclasses import asdict, replace

import numpy as np
import pytest

import stiction as st
from stiction.apps.web.trend_data import thin_columns
from stiction.apps.web.whatif import make_start_load, predict_cycles, simulate_trend
from stiction.apps.web.whatif_settings import COMPENSATORS, VALVE_MODELS, WhatIfSettings
from stiction.apps.web.whatif_start import start_from_diagnosis
from stiction.errors import ParameterError
from stiction.simulation.swing import find_first_rise, measure_swing


def test_the_trend_is_a_part_of_the_simulation_of_the_same_loop() -> None:
    settings = WhatIfSettings(S=4.0, J=1.5, Kc=0.15, Ti=12.0, gain=2.0, tau=15.0, dead_time=5.0, duration=400.0)
    loop = st.Loop(
        st.PID(0.15, 12.0, N=10.0, op_limits=(0.0, 100.0)), st.Kano(4.0, 1.5), st.FOPDT(2.0, 15.0, 5.0), dt=1.0
    )
    n = round(settings.settling_time) + 2 * 400
    record = st.simulate(loop, settings.sp, float(n), make_start_load(settings, n), pv_start=settings.sp, op_start=50.0)
    trend = simulate_trend(settings)
    windows = np.lib.stride_tricks.sliding_window_view(record.op, 400)
    [first, *_] = np.flatnonzero((windows == trend.op).all(axis=1))
    assert record.pv is not None
    assert record.mv is not None
    np.testing.assert_array_equal(trend.pv, record.pv[first : first + 400])
    np.testing.assert_array_equal(trend.mv, record.mv[first : first + 400])
    np.testing.assert_array_equal(trend.time, np.arange(400.0))


@pytest.mark.parametrize("model", ["kano", "choudhury", "he", "stenman"])
def test_the_simulated_loop_falls_into_the_exact_limit_cycle(model: str) -> None:
    settings = WhatIfSettings(model=model, dt=0.1, duration=1500.0)
    valves = {
        "kano": st.Kano(5.0, 2.0),
        "choudhury": st.Choudhury(5.0, 2.0),
        "he": st.He(3.5, 1.5),
        "stenman": st.Stenman(3.5),
    }
    loop = st.Loop(st.PID(0.2, 10.0), valves[model], st.FOPDT(3.0, 10.0, 10.0), dt=0.1)
    exact = [cycle.exact or cycle for cycle in st.predict_limit_cycles(loop) if cycle.stable]
    trend = simulate_trend(settings)
    nearest = min(exact, key=lambda cycle: abs(cycle.period - trend.op_swing.period))
    assert trend.op_swing.period == pytest.approx(nearest.period, rel=0.03)
    assert trend.op_swing.amplitude == pytest.approx(nearest.amplitude, rel=0.05)
    assert trend.pv_swing.amplitude == pytest.approx(nearest.amplitude_pv, rel=0.05)
    assert trend.sentence.startswith("The simulated loop oscillates with a period of")


def test_each_valve_model_has_the_bands_of_S_and_J() -> None:
    made = {model: WhatIfSettings(model=model, S=3.0, J=1.0, r=0.2).valve() for model in VALVE_MODELS}
    assert made == {
        "kano": st.Kano(3.0, 1.0),
        "choudhury": st.Choudhury(3.0, 1.0),
        "he": st.He(2.0, 1.0),
        "stenman": st.Stenman(2.0),
        "srinivasan": st.Srinivasan(2.0, 1.0, 0.2),
        "ideal": st.Ideal(),
    }


@pytest.mark.parametrize("name", [name for name in COMPENSATORS if name != "none"])
def test_a_compensator_has_the_settings_of_the_library(name: str) -> None:
    settings = WhatIfSettings(compensator=name, S=4.0, J=1.0, gain=-2.0, Kc=-0.2, noise=0.1)
    expected = getattr(st, name).for_stiction(4.0, 1.0, 1.0, gain=-2.0, noise=0.1)
    assert settings.loop.compensator == expected
    assert math.isfinite(simulate_trend(settings).op_swing.amplitude)


def test_a_good_valve_comes_to_rest_at_the_set_point() -> None:
    trend = simulate_trend(WhatIfSettings(model="ideal"))
    assert trend.sentence == "The simulated loop comes to rest: OP stays at 50 %, PV at the set point."
    np.testing.assert_allclose(trend.pv, 150.0, atol=1e-3)


def test_a_gain_of_the_wrong_sign_is_said() -> None:
    assert "Check the sign" in simulate_trend(WhatIfSettings(Kc=-0.2)).sentence
    unlimited = WhatIfSettings(Kc=-0.2, op_low=-1e9, op_high=1e9)
    assert simulate_trend(unlimited).sentence.startswith("The simulated loop is unstable")


def test_limit_cycles_are_those_of_the_library_without_the_compensator() -> None:
    found = predict_cycles(WhatIfSettings(compensator="Knocker"))
    loop = st.Loop(st.PID(0.2, 10.0, N=10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    [cycle] = st.predict_limit_cycles(loop)
    exact = cycle.exact
    assert exact is not None
    [row] = found["cycles"]
    assert (row["period_s"], row["amplitude_op"], row["stable"]) == (exact.period, exact.amplitude, True)
    assert found["sentence"].startswith("Without the compensator: one stable limit cycle is predicted: period 2.38 min")


def test_no_limit_cycle_is_explained() -> None:
    assert predict_cycles(WhatIfSettings(model="ideal")) == {
        "sentence": "No limit cycle: the valve does not stick.",
        "cycles": [],
    }


@pytest.mark.parametrize("name", list(WhatIfSettings.quantities()))
@pytest.mark.parametrize("side", ["low", "high"])
def test_a_number_outside_its_limits_is_refused_with_both_limits(name: str, side: str) -> None:
    quantity = WhatIfSettings.quantities()[name]
    outside = quantity.low - 1.0 if side == "low" else 2.0 * quantity.high
    with pytest.raises(ParameterError) as error:
        WhatIfSettings.from_mapping({name: outside})
    message = str(error.value)
    assert message.startswith(f"{quantity.label} = {outside:g}")
    assert f"{quantity.low:g} to {quantity.high:g}" in message


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"S": "wide"}, "must be a number in % of span"),
        ({"S": "nan"}, "must be a number"),
        ({"Q": 1.0}, "'Q' is not a setting of the what-if screen"),
        ({"model": "magic"}, "use one of kano"),
        ({"compensator": "magic"}, "use one of none"),
        ({"dt": 0.001, "duration": 1000.0}, "at most 20 s are simulated"),
        ({"dt": 0.01, "duration": 100.0, "dead_time": 3000.0}, "longer than 200,000 samples"),
        ({"duration": 5.0}, "shorter than 10 samples"),
        ({"op_low": 60.0, "op_high": 40.0}, "raise the upper one"),
    ],
)
def test_settings_that_make_no_loop_are_refused(values: dict[str, object], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        WhatIfSettings.from_mapping(values)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"model": "he", "S": 1.0, "J": 2.0}, "lower J"),
        ({"gain": 0.0}, "Give another gain"),
        ({"compensator": "Knocker", "S": 0.0}, "Raise S"),
        ({"tau": 0.0, "dead_time": 0.0}, "Add a lag or a dead time"),
    ],
)
def test_a_loop_that_cannot_be_made_says_what_to_move(values: dict[str, object], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        simulate_trend(WhatIfSettings.from_mapping(values))


def test_a_slow_process_and_a_long_record_are_simulated() -> None:
    assert math.isfinite(simulate_trend(WhatIfSettings(tau=1e6, dead_time=1e4)).op_swing.amplitude)
    diagnosis = good_diagnosis()
    record = diagnosis.record
    long = replace(record, **{name: np.tile(getattr(record, name), 40) for name in ("op", "pv", "sp")}, mv=None)
    start = start_from_diagnosis(replace(st.diagnose(long), identification=diagnosis.identification))
    assert start.settings.duration <= WhatIfSettings.max_duration(start.settings.dt)
    assert start.record["time"][-1] <= start.settings.duration


def test_texts_of_an_address_are_read_as_settings() -> None:
    settings = WhatIfSettings.from_mapping({"S": "3.5", "integrating": "true", "model": "he"})
    assert (settings.S, settings.integrating, settings.model) == (3.5, True, "he")
    assert WhatIfSettings.from_mapping(asdict(settings)) == settings


def test_thinning_keeps_the_extremes_of_each_pixel() -> None:
    x = np.random.default_rng(0).normal(size=20_000)
    signals = {"x": x, "y": np.cumsum(x)}
    signals["x"][:150] = np.nan  # a part of the second block, and all of the first
    samples, thinned = thin_columns(signals, 200)
    assert samples.size == 400
    assert np.all(np.diff(samples) > 0.0)
    assert np.isnan(thinned["x"][:2]).all()
    for name, signal in signals.items():
        for k in range(1, 200):
            block = signal[100 * k : 100 * (k + 1)]
            assert sorted(thinned[name][2 * k : 2 * k + 2]) == [np.nanmin(block), np.nanmax(block)]


def test_the_swing_of_a_sine_is_its_own_and_noise_is_averaged_out() -> None:
    time = np.arange(6000) * 0.5
    wave = 40.0 + 3.0 * np.sin(2.0 * math.pi * time / 120.0)
    swing = measure_swing(wave, 0.5)
    assert (swing.period, swing.amplitude, swing.middle) == pytest.approx((120.0, 3.0, 40.0), rel=1e-3)
    noisy = measure_swing(wave + np.random.default_rng(1).normal(0.0, 0.4, wave.size), 0.5, noisy=True)
    assert noisy.period == pytest.approx(120.0, rel=0.02)
    assert noisy.amplitude == pytest.approx(3.0, rel=0.15)
    assert math.isnan(measure_swing(np.full(100, 2.0), 1.0).period)
    assert find_first_rise(np.array([3.0, 0.0, 0.0, 2.0, 3.0])) == 3


def test_the_screen_starts_from_the_loop_that_made_the_record() -> None:
    truth = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.1)
    kick = np.r_[np.full(30, 3.0), np.zeros(2970)]
    record = st.simulate(truth, 150.0, 3000.0, kick, 3, pv_start=150.0, op_start=50.0, tag="FIC-1")
    start = start_from_diagnosis(st.diagnose(record))
    found = start.settings
    assert pytest.approx((5.0, 2.0), rel=0.1) == (found.S, found.J)
    assert (found.Kc, found.Ti) == pytest.approx((0.2, 10.0), rel=0.1)
    assert (found.gain, found.dead_time + found.tau) == pytest.approx((3.0, 20.0), rel=0.15)
    assert start.tag == "FIC-1"
    assert start.sentence.startswith("The record oscillates with a period of")
    assert set(start.record) == {"time", "pv", "op"}
    simulated = simulate_trend(found).op_swing
    recorded = measure_swing(start.record["op"], 1.0, noisy=True)
    assert simulated.amplitude == pytest.approx(recorded.amplitude, rel=0.2)


def test_a_loop_without_stiction_starts_with_a_good_valve() -> None:
    diagnosis = good_diagnosis()
    start = start_from_diagnosis(diagnosis)
    assert diagnosis.verdict == "no_stiction"
    assert start.settings.model == "ideal"
    assert "comes to rest" in simulate_trend(start.settings).sentence


def good_diagnosis() -> st.Diagnosis:
    """Diagnosis of a loop with a good valve, whose set point moves."""
    truth = st.Loop(st.PID(0.2, 10.0), st.Ideal(), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.3)
    sp = 150.0 + np.tile(np.repeat([-3.0, 3.0], 300), 5)
    return st.diagnose(st.simulate(truth, sp, 3000.0, None, 1, pv_start=150.0, op_start=50.0))


def test_a_process_gain_against_the_controller_is_turned_and_said() -> None:
    diagnosis = good_diagnosis()
    found, controller = diagnosis.identification, diagnosis.controller
    assert found is not None
    assert controller is not None
    wrong = replace(found, linear=replace(found.linear, gain=-abs(found.linear.gain)))
    start = start_from_diagnosis(replace(diagnosis, identification=wrong, controller=replace(controller, Kc=0.2)))
    assert start.settings.gain > 0.0
    assert any("wrong sign" in text for text in start.remarks)


def test_an_impossible_identification_starts_from_usual_values_and_is_said() -> None:
    diagnosis = good_diagnosis()
    assert diagnosis.identification is not None
    wild = replace(diagnosis.identification, linear=replace(diagnosis.identification.linear, gain=3e14))
    start = start_from_diagnosis(replace(diagnosis, identification=wild))
    assert start.settings.gain == WhatIfSettings().gain
    assert start.remarks[0].startswith("The identified loop cannot be simulated: Process gain = 3e+14")


def test_an_unstable_identification_is_said() -> None:
    diagnosis = good_diagnosis()
    found = diagnosis.identification
    assert found is not None
    strong = replace(found, linear=replace(found.linear, gain=50.0, time_constant=10.0, dead_time=10.0, lag=0.0))
    start = start_from_diagnosis(replace(diagnosis, identification=strong))
    assert any("unstable even with a good valve" in text for text in start.remarks)
