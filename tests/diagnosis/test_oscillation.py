"""Oscillation: known periods under every ill a plant record has, and noise that must not be taken for a wave."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from stiction import FOPDT, PID, Ideal, Integrating, Kano, Loop, simulate
from stiction.diagnosis.detection import detect_all
from stiction.diagnosis.oscillation import autocorrelation, cycle_average, find_oscillation, half_cycles
from stiction.diagnosis.oscillation.signals import about_drift, control_error, filled, smooth
from stiction.records.record import LoopRecord

SHAPES = {
    "sine": lambda phase: np.sin(2 * np.pi * phase),
    "triangle": lambda phase: 4 * np.abs(phase - 0.5) - 1,
    "square": lambda phase: np.where(phase < 0.5, 1.0, -1.0),
    "saw": lambda phase: 2 * phase - 1,
    "pulse": lambda phase: np.where(phase < 0.2, 1.0, -1.0),
}


def wave(shape: str, n: int, period: float) -> np.ndarray:
    return SHAPES[shape]((np.arange(n) / period + 0.123) % 1.0)


def loop(pv, op=None, dt=1.0, **known) -> LoopRecord:
    return LoopRecord("L", dt, op=50 - np.asarray(pv) if op is None else op, pv=pv, **known)


@pytest.mark.parametrize("cycles", [8, 25, 100])
@pytest.mark.parametrize("noise", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("shape", SHAPES)
def test_period_is_found_under_noise_drift_and_quantisation(shape, noise, cycles):
    n = 2000
    rng = np.random.default_rng(cycles)
    t = np.arange(n)
    drift = 3.0 * np.sin(2 * np.pi * 1.3 * t / n)
    pv = np.round(2 * (wave(shape, n, n / cycles) + 2 * noise * rng.standard_normal(n) + drift)) / 2
    found = find_oscillation(loop(pv, dt=5.0))
    assert found.oscillating
    assert found.period == pytest.approx(5.0 * n / cycles, rel=0.05)
    assert found.cycles == pytest.approx(cycles, rel=0.05)


def test_two_hundred_cycles_of_ten_samples():
    found = find_oscillation(loop(wave("triangle", 2000, 10.0)))
    assert found.oscillating
    assert found.period == pytest.approx(10.0, rel=0.01)


def test_of_two_waves_the_larger_is_reported():
    for large, small in ((1.0, 0.4), (0.4, 1.0)):
        pv = large * wave("sine", 2000, 200.0) + small * wave("sine", 2000, 23.0)
        found = find_oscillation(loop(pv))
        assert found.oscillating
        assert found.period == pytest.approx(200.0 if large > small else 23.0, rel=0.05)


@pytest.mark.parametrize(("main", "second", "size"), [(200, 23, 0.4), (23, 200, 0.4), (40, 27, 0.6), (100, 71, 0.6)])
@pytest.mark.parametrize("shape", ["sine", "square"])
def test_two_waves_are_two_oscillations(shape, main, second, size):
    """Shares: the square carries 1, a sine of amplitude a carries a^2 / 2; near 3 : 2 each takes a bit of the other."""
    rng = np.random.default_rng(main)
    pv = wave(shape, 2000, main) + size * wave("sine", 2000, second) + 0.1 * rng.standard_normal(2000)
    found = find_oscillation(loop(pv, dt=2.0))
    assert found.period == pytest.approx(2.0 * main, rel=0.03)
    assert [other.period for other in found.others] == [pytest.approx(2.0 * second, rel=0.03)]
    power = {"sine": 0.5, "square": 1.0}[shape], size**2 / 2.0
    assert found.share == pytest.approx(power[0] / (sum(power) + 0.01), abs=0.15)
    assert found.others[0].share == pytest.approx(power[1] / (sum(power) + 0.01), abs=0.12)
    assert "another oscillation" in found.reason
    assert found.to_dict()["others"][0]["period_s"] == found.others[0].period


def test_three_waves():
    pv = wave("sine", 2000, 200.0) + 0.7 * wave("sine", 2000, 61.0) + 0.5 * wave("sine", 2000, 17.0)
    assert [round(other.period) for other in find_oscillation(loop(pv)).others] == [61, 17]


@pytest.mark.parametrize("jitter", [0.0, 0.05, 0.1])
@pytest.mark.parametrize("shape", SHAPES)
def test_a_wave_with_its_harmonics_is_one_oscillation(shape, jitter):
    rng = np.random.default_rng(3)
    ends = np.concatenate(([0.0], np.cumsum(50 * np.exp(jitter * rng.standard_normal(80)))))
    pv = SHAPES[shape](np.interp(np.arange(2000), ends, np.arange(81)) % 1.0) + 0.1 * rng.standard_normal(2000)
    found = find_oscillation(loop(pv))
    assert found.oscillating
    assert found.others == ()
    assert found.share > 0.5


@pytest.mark.parametrize(
    ("process", "tune"),
    [
        (FOPDT(3.0, 10.0, 10.0), PID(0.2, 10.0)),
        (FOPDT(1.0, 2.0, 3.0), PID(0.4, 2.0)),
        (Integrating(0.05, 4.0), PID(1.2, 20.0)),
    ],
    ids=["lag", "fast", "integrating"],
)
def test_a_stiction_cycle_is_one_oscillation(process, tune):
    found = find_oscillation(simulate(Loop(tune, Kano(3.0, 1.0), process, dt=1.0, noise=0.02), 10.0, 2000.0, seed=1))
    assert found.oscillating
    assert found.others == ()


@pytest.mark.parametrize(("first", "last"), [(30.0, 60.0), (45.0, 55.0), (60.0, 30.0)])
def test_a_chirp_is_not_two_oscillations(first, last):
    pv = np.sin(2 * np.pi * np.cumsum(1.0 / np.linspace(first, last, 2000)))
    assert find_oscillation(loop(pv)).others == ()


def test_a_wave_that_comes_and_goes_is_one():
    pv = (1.0 + 0.5 * wave("sine", 2000, 700.0)) * wave("sine", 2000, 40.0)
    assert find_oscillation(loop(pv)).others == ()


def test_a_sine_in_coloured_noise_is_one():
    """100 records; at a rate of 1 % more than 5 have a probability of 0.05 %."""
    rng = np.random.default_rng(0)
    several = 0
    for k in range(100):
        noise = lfilter([1.0], [1.0, -(0.0, 0.5, 0.9, 0.98)[k % 4]], rng.standard_normal(1500))
        pv = 1.5 * wave("sine", 1500, float(np.exp(rng.uniform(np.log(12), np.log(120))))) + noise / noise.std()
        several += bool(find_oscillation(loop(pv)).others)
    assert several <= 5


def test_set_point_steps_do_not_make_an_oscillation_of_the_error():
    rng = np.random.default_rng(0)
    sp = 50.0 + 3.0 * np.repeat(rng.choice([-1.0, 0.0, 1.0], 16), 125)
    record = simulate(Loop(PID(0.4, 12.0), Ideal(), FOPDT(2.0, 10.0, 4.0), dt=1.0, noise=0.05), sp, 2000.0, seed=1)
    found = find_oscillation(record)
    assert not found.oscillating
    assert found.others == ()


def test_cycle_average_is_the_wave():
    """Noise falls by the root of the cycles; the wave stays, harmonics included."""
    clean = wave("triangle", 4000, 50.0)
    x = clean + 0.3 * np.random.default_rng(0).standard_normal(4000)
    inside = slice(100, -100)
    assert np.std(cycle_average(x, 50.0)[inside] - clean[inside]) < 0.3 * 0.35


def test_missing_values_are_bridged():
    pv = wave("square", 2000, 60.0)
    gaps = np.random.default_rng(0).random(2000) < 0.1
    found = find_oscillation(loop(np.where(gaps, np.nan, pv), op=50 + pv))
    assert found.oscillating
    assert found.period == pytest.approx(60.0, rel=0.02)


def test_jittered_periods_oscillate_and_lose_regularity():
    regular = []
    for jitter in (0.0, 0.1, 0.25):
        rng = np.random.default_rng(3)
        ends = np.concatenate(([0.0], np.cumsum(50 * np.exp(jitter * rng.standard_normal(80)))))
        pv = SHAPES["square"](np.interp(np.arange(2000), ends, np.arange(81)) % 1.0)
        found = find_oscillation(loop(pv + 0.1 * rng.standard_normal(2000)))
        assert found.oscillating
        assert found.period == pytest.approx(50.0, rel=0.2)
        regular.append(found.regularity)
    assert regular == sorted(regular, reverse=True)


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9, 0.98, 1.0])
def test_noise_of_any_colour_is_rarely_a_wave(memory):
    """False alarms in 60 records each; binomial(60, 0.05) exceeds 8 with a probability of 0.4 %."""
    rng = np.random.default_rng(round(100 * memory))
    alarms = 0
    for _ in range(60):
        x, drive = np.zeros(700), rng.standard_normal(700)
        for k in range(1, 700):
            x[k] = memory * x[k - 1] + drive[k]
        alarms += find_oscillation(loop(x)).oscillating
    assert alarms <= 8


def test_regularity_of_white_noise_is_below_one_and_of_a_sine_large():
    """Thornhill's rule on the autocorrelation itself, by the plain formula, as an independent twin."""

    def plain(x):
        acf = autocorrelation(x)
        at = np.flatnonzero((acf[1:] > 0) != (acf[:-1] > 0))[:12]
        intervals = np.diff(at)[1:]
        return 2 * intervals.mean() / (3 * max(2 * intervals.std(), 1e-9))

    assert plain(np.random.default_rng(0).standard_normal(2000)) < 1.0
    sine = wave("sine", 2000, 40.0)
    assert plain(sine) > 10.0
    found = find_oscillation(loop(sine))
    assert found.regularity == 10.0  # infinite but for rounding; the most that is reported
    assert "10 or more" in found.reason


def test_autocorrelation_is_the_slow_sum():
    x = np.random.default_rng(1).standard_normal(60)
    x0 = x - x.mean()
    slow = np.array([np.mean(x0[: 60 - lag] * x0[lag:]) for lag in range(45)]) / np.mean(x0 * x0)
    np.testing.assert_allclose(autocorrelation(x), slow, atol=1e-12)


def test_half_sine_has_integrated_absolute_error_two_a_over_omega():
    """The limit of Haegglund's rule: a sine's half periods reach it exactly, at any amplitude and period."""
    for amplitude, period in ((1.0, 100), (7.0, 40)):
        x = amplitude * np.sin(2 * np.pi * (np.arange(10 * period) + 0.5) / period)
        for start, stop in half_cycles(x, float(period)):
            assert np.abs(x[start:stop]).sum() == pytest.approx(2 * amplitude / (2 * np.pi / period), rel=1e-2)
    found = find_oscillation(loop(wave("sine", 2000, 40.0)))
    assert found.load_events == 30  # all of them
    assert found.load_events_needed == 10


def test_moving_average_keeps_straight_lines_and_kills_its_period():
    t = np.arange(500.0)
    np.testing.assert_allclose(smooth(3 * t - 7, 33.4), 3 * t - 7, atol=1e-9)
    sine = np.sin(2 * np.pi * t / 25)
    assert np.abs(smooth(sine, 25.0)[30:-30]).max() < 1e-12
    np.testing.assert_allclose(about_drift(sine + 0.01 * t, 25.0)[30:-30], sine[30:-30], atol=1e-9)
    x = np.random.default_rng(0).standard_normal(50)
    np.testing.assert_allclose(smooth(x, 5.0)[2:-2], np.convolve(x, np.full(5, 0.2), "valid"), atol=1e-12)
    np.testing.assert_allclose(smooth(x, 4.0)[2:-2], np.convolve(x, [0.125, 0.25, 0.25, 0.25, 0.125], "valid"))


def test_half_cycles_shrug_off_noise_about_zero():
    rng = np.random.default_rng(5)
    x = wave("sine", 2000, 100.0) + 0.3 * rng.standard_normal(2000)
    segments = half_cycles(x, 100.0)
    assert 37 <= len(segments) <= 40
    assert np.median(np.diff(segments)) == pytest.approx(50, abs=2)


def test_amplitudes_are_half_peak_to_peak():
    t = np.arange(2000)
    pv, op = 3 * wave("triangle", 2000, 100.0) + 0.01 * t, 50 + 2 * wave("sine", 2000, 100.0)
    found = find_oscillation(loop(pv, op))
    assert found.amplitude_pv == pytest.approx(3.0, rel=0.05)
    assert found.amplitude_op == pytest.approx(2.0, rel=0.02)


def test_set_point_is_taken_off():
    sp = np.repeat(np.random.default_rng(0).standard_normal(40) * 5, 50)
    pv = sp + wave("sine", 2000, 40.0)
    record = LoopRecord("L", 1.0, op=50 + wave("sine", 2000, 40.0), pv=pv, sp=sp)
    np.testing.assert_allclose(control_error(record), sp - pv)
    assert find_oscillation(record).period == pytest.approx(40.0, rel=0.01)


def test_without_a_set_point_no_error_is_spoken_of():
    pv = wave("saw", 800, 40.0)
    known, unknown = loop(pv, sp=np.full(800, 1.0)), loop(pv)
    late = replace(known, sp=np.where(np.arange(800) < 500, np.nan, 1.0))
    for record, named in (
        (known, "The control error"),
        (unknown, "The PV about its drift"),
        (late, "The PV about its"),
    ):
        found = find_oscillation(record)
        told = [found.reason, *(row.why for row in detect_all(record, found))]
        assert found.reason.startswith(named)
        assert sum("control error" in text for text in told) == (5 if record is known else 0)
        assert sum(text.startswith(named) for text in told) == 5


def test_op_speaks_when_the_error_is_lost_in_noise():
    rng = np.random.default_rng(0)
    found = find_oscillation(loop(rng.standard_normal(2000), op=50 + wave("triangle", 2000, 80.0)))
    assert found.oscillating
    assert found.period == pytest.approx(80.0, rel=0.02)
    assert "OP" in found.reason


@pytest.mark.parametrize(
    "pv",
    [None, np.full(500, 3.0), np.full(500, np.nan), np.arange(500.0), np.zeros(0), np.ones(1), np.arange(9.0)],
    ids=["none", "flat", "missing", "ramp", "empty", "one", "nine"],
)
def test_nothing_to_see_is_said(pv):
    n = 500 if pv is None else len(pv)
    found = find_oscillation(LoopRecord("L", 1.0, op=np.full(n, 50.0), pv=pv))
    assert not found.oscillating
    assert found.reason
    assert ("PV is missing" in found.reason) == (pv is None or (n > 0 and bool(np.isnan(pv).all())))


def test_what_an_oscillation_lacks_is_said():
    """By the two conditions themselves: one pace, and a wave that comes back more than noise does."""
    seen = set()
    for seed in range(60):
        noise = np.random.default_rng(seed).standard_normal(700)
        x = lfilter([1.0], [1.0, -1.6, 0.8], noise) if seed % 2 else noise
        found = find_oscillation(loop(x, op=np.full(700, 50.0)))
        if found.oscillating or not found.reason.startswith("No regular oscillation"):
            continue
        paced = found.regularity > 1.0
        assert (
            f"is regular ({found.regularity:.2f}, above 1) but is not larger than noise would be" in found.reason
        ) == paced
        seen.add(paced)
    assert seen == {True, False}


@given(
    shift=st.floats(-100, 100),
    scale=st.floats(0.01, 100) | st.floats(-100, -0.01),
    dt=st.sampled_from([0.1, 1.0, 60.0]),
    shape=st.sampled_from(sorted(SHAPES)),
)
def test_units_do_not_matter(shift, scale, dt, shape):
    pv = wave(shape, 600, 37.0) + 0.1 * np.random.default_rng(2).standard_normal(600)
    one, other = find_oscillation(loop(pv)), find_oscillation(loop(shift + scale * pv, op=50 - pv, dt=dt))
    assert other.period == pytest.approx(dt * one.period, rel=1e-6)
    assert other.regularity == pytest.approx(one.regularity, rel=1e-4)
    assert other.amplitude_pv == pytest.approx(abs(scale) * one.amplitude_pv, rel=1e-6)
    assert (other.oscillating, other.load_events) == (one.oscillating, one.load_events)


@given(st.lists(st.floats(-1e6, 1e6) | st.just(float("nan")), max_size=80))
def test_any_signal_gives_an_answer(values):
    found = find_oscillation(loop(np.array(values), op=np.zeros(len(values))))
    assert isinstance(found.oscillating, bool)
    assert found.reason


def test_filled_bridges_and_refuses():
    np.testing.assert_allclose(filled(np.array([0, 1, np.nan, 3, 4, 5, 6, 7, 8, 9.0])), np.arange(10.0))
    assert filled(np.full(20, 1.0)) is None
    assert filled(np.where(np.arange(40) % 3 == 0, np.arange(40.0), np.nan)) is None
    ramp = np.arange(21.0)
    assert filled(np.where(ramp < 10, ramp, np.nan)) is None
    assert filled(np.where(ramp < 11, ramp, np.nan)) is not None


def test_two_thousand_samples_take_milliseconds():
    record = loop(wave("triangle", 2000, 80.0))
    find_oscillation(record)
    best = min(_timed(record) for _ in range(10))
    assert best < 0.012  # measured 0.002; four times the 0.003 asked for, lest a busy machine fails the test


def _timed(record):
    start = time.perf_counter()
    find_oscillation(record)
    return time.perf_counter() - start


@pytest.mark.parametrize(("period", "cycles"), [(60.0, True), (75.0, False)])
def test_a_set_point_with_the_same_cycle_is_seen(period, cycles):
    k, rng = np.arange(1800.0), np.random.default_rng(0)
    pv = 3.0 * np.sin(2.0 * np.pi * k / 60.0) + 0.1 * rng.normal(size=k.size)
    sp = 0.5 * np.sin(2.0 * np.pi * k / period)
    record = LoopRecord("FIC-1", 1.0, op=50.0 - pv, pv=pv, sp=sp)
    found = find_oscillation(record)
    assert found.oscillating
    assert (found.sp_cycles, "SP has the same period" in found.reason) == (cycles, cycles)
    assert not find_oscillation(replace(record, sp=np.zeros(k.size))).sp_cycles
    assert not find_oscillation(replace(record, sp=None)).sp_cycles


@pytest.mark.parametrize(("n", "lags"), [(300, 40), (5000, 70), (5000, 3000)])
def test_the_autocorrelation_is_the_sum_of_all_pairs(n, lags):
    x = np.cumsum(np.random.default_rng(n).normal(size=n))
    about = x - x.mean()
    sums = np.array([about[: n - lag] @ about[lag:] / (n - lag) for lag in range(lags)])
    np.testing.assert_allclose(autocorrelation(x, lags), sums / sums[0], atol=1e-10)


@pytest.mark.parametrize("period", [9.0, 70.0, 1300.0])
def test_the_period_of_a_long_record_is_as_exact_as_that_of_a_short_one(period):
    t = np.arange(40_000)
    x = np.sin(2.0 * np.pi * t / period) + 0.3 * np.random.default_rng(1).normal(size=t.size)
    found = find_oscillation(LoopRecord("FIC-101", 1.0, op=x, pv=x))
    assert found.oscillating
    assert found.period == pytest.approx(period, rel=2e-3)
