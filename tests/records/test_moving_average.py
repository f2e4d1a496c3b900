"""Moving averages of OP and PV at the full rate are found by what they take out of the noise; nothing else is."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from stiction.diagnosis.identification import fit_controller
from stiction.diagnosis.segment import judge_segment
from stiction.models import FOPDT, PID, Ideal, Kano, Loop
from stiction.records import LoopRecord, assess_quality
from stiction.records.quality.moving_average import _has_notches, detect_averaging_window
from stiction.simulation import simulate

N = 1500
K = np.arange(N)


def noisy(seed, period=70.3, noise=0.1, n=N):
    return np.sin(2 * np.pi * np.arange(n) / period) + noise * np.random.default_rng(seed).normal(size=n)


def averaged(x, window):
    return np.convolve(x, np.ones(window) / window, "valid")


def smoothed(record, window):
    n = len(record) - window + 1
    return LoopRecord("FC1", record.dt, averaged(record.op, window), averaged(record.pv, window), sp=record.sp[:n])


@pytest.fixture(scope="module")
def loops():
    """A sticky valve and a good one that a wave moves, noise in the PV that the controller sees."""
    wave = 3.0 * np.sin(2 * np.pi * np.arange(2000) / 57.0)
    pid, process = PID(0.2, 10.0), FOPDT(3.0, 10.0, 10.0)
    sticky = simulate(Loop(pid, Kano(3.0, 1.0), process, dt=1.0, noise=0.05), 10.0, 2000.0, seed=1)
    return sticky, simulate(Loop(pid, Ideal(), process, dt=1.0, noise=0.05), 10.0, 2000.0, wave, seed=2)


@pytest.mark.parametrize("window", [2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 15, 20, 40])
def test_a_moving_average_is_found_with_its_window(window):
    assert detect_averaging_window(*(averaged(noisy(seed), window) for seed in (8, 9))) == window


@settings(deadline=None, max_examples=40)
@given(
    window=some.integers(3, 12),
    seed=some.integers(0, 1000),
    period=some.floats(25.0, 200.0),
    noise=some.floats(0.02, 1.0),
    gain=some.floats(1e-3, 1e3),
    zero=some.floats(-100.0, 100.0),
)
def test_a_moving_average_is_found_in_any_unit_and_noise_alone_is_none(window, seed, period, noise, gain, zero):
    op, pv = noisy(seed, period, noise), zero + gain * noisy(seed + 5000, period, noise)
    assert detect_averaging_window(averaged(op, window), averaged(pv, window)) == window
    assert detect_averaging_window(op, pv) == 0


def test_rounded_after_the_average_it_is_found_still():
    op, pv = (np.round(averaged(noisy(seed), 5), 2) for seed in (3, 4))
    assert detect_averaging_window(op, pv) == 5


def test_an_average_of_one_signal_alone_is_a_filter_of_that_signal():
    for window in (3, 5, 12, 40):
        plain, other = noisy(9)[: N - window + 1], averaged(noisy(8), window)
        assert detect_averaging_window(other, plain) == detect_averaging_window(plain, other) == 0


def test_oscillations_filters_and_periodic_kinks_are_no_moving_average():
    lag = 0.3 * 0.7 ** np.arange(30)
    assert detect_averaging_window(*(np.convolve(noisy(seed), lag, "valid") for seed in (1, 2))) == 0
    kinks = np.where(K // 25 % 2, 1.0, -1.0)
    assert detect_averaging_window(np.cumsum(kinks), kinks * (1 - 0.8 ** (K % 25))) == 0
    for period in (4.0, 6.0, 10.0):
        fast = [np.sin(2 * np.pi * K / period) + 0.1 * np.random.default_rng(s).normal(size=N) for s in (1, 2)]
        assert detect_averaging_window(*fast) == 0
    waves = [np.sign(np.sin(2 * np.pi * K / 6.0)) + noisy(s) for s in (1, 2)]  # all its harmonics lie between notches
    assert detect_averaging_window(*waves) == 0


def test_a_transmitter_damped_by_tustins_rule_is_no_mean_of_two():
    # Its zero at half the sampling rate is that of a mean of two; what it is a mean of falls off towards there.
    for tau in (1.0, 3.0, 8.0):
        op, pv = [], []
        for seed in (1, 2):
            x, out = noisy(seed, n=3000), [0.0]
            for new, old in zip(x[1:], x[:-1], strict=True):
                out.append(((2 * tau - 1) * out[-1] + new + old) / (2 * tau + 1))
            op, pv = pv, np.array(out[50:])
        assert detect_averaging_window(op, pv) == 0


@pytest.mark.parametrize("every", [2, 3, 5])
def test_held_or_interpolated_signals_have_a_check_of_their_own(every):
    knots = K[::every]
    held = [noisy(seed)[knots].repeat(every) for seed in (1, 2)]
    drawn = [np.interp(K, knots, noisy(seed)[knots]) for seed in (1, 2)]
    assert detect_averaging_window(*held) == detect_averaging_window(*drawn) == 0


@pytest.mark.parametrize("window", [2, 3, 5, 9])
def test_averaged_loop_is_found_and_keeps_the_controller_equation(window, loops):
    for raw in loops:
        record = smoothed(raw, window)
        assert not next((check for check in assess_quality(raw).checks if check.name == "moving average"), None)
        found = fit_controller(judge_segment(record))
        assert found.unexplained < 1e-6  # the controller's law holds as before
        for period in (None, 60.0, 1000.0):
            check = next(check for check in assess_quality(record, period).checks if check.name == "moving average")
            assert check.severity == "warn"
            assert f"OP and PV are moving averages over {window} s" in check.why


def test_first_order_lag_of_both_signals_is_not_an_average(loops):
    lag = 0.3 * 0.7 ** np.arange(60)
    op, pv = (np.convolve(x, lag, "valid") for x in (loops[0].op, loops[0].pv))
    assert detect_averaging_window(op, pv) == 0


@pytest.mark.parametrize("n", [0, 3, 59, 61, 100, 150])
def test_short_record_has_no_averaging_window(n):
    assert detect_averaging_window(noisy(1, n=n), noisy(2, n=n)) == 0
    assert detect_averaging_window(np.zeros(n), np.zeros(n)) == 0


def test_it_is_fast():
    # The aim is half a millisecond; the limit allows for a busy machine.
    op, pv = noisy(1, n=2000), noisy(2, n=2000)
    taken = []
    for _ in range(5):
        start = time.process_time()
        detect_averaging_window(op, pv)
        taken.append(time.process_time() - start)
    assert min(taken) < 0.005


@pytest.mark.parametrize(("share", "found"), [(0.195, True), (0.205, False)])
def test_a_notch_is_a_fifth_of_what_is_about_it(share, found):
    """The spectrum that a mean of three gives noise, and at the rim of the notch's middle so much more power."""
    away = np.abs(np.arange(301) - 200)  # in 200ths of the distance of two notches
    about, middle, rim = away <= 80, away <= 10, (away >= 8) & (away <= 10)
    power = np.sin(np.pi * away / 200.0) ** 2
    missing = share * power[about].mean() - power[middle].mean()
    power += rim * missing / (rim[middle].mean() - share * rim[about].mean())
    assert power[middle].mean() == pytest.approx(share * power[about].mean())
    assert bool(_has_notches([power, power], 600, 3, 0.2)) is found


def test_few_samples_look_averaged_and_no_more_is_said():
    record = LoopRecord("FC1", 1.0, *(averaged(noisy(seed), 3) for seed in (8, 9)))
    for n, seem in ((120, "look like"), (400, "are")):
        check = next(check for check in assess_quality(record.window(0, n)).checks if check.name == "moving average")
        assert check.why.startswith(f"OP and PV {seem} moving averages over 3 s")
