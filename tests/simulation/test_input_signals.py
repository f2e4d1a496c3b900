"""Test signals: levels, lengths and rates as asked."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as hs

import stiction as st
from stiction.simulation import binary_sequence, ramp, random_walk, sine, staircase, triangle

pytestmark = pytest.mark.quick

LEVELS = hs.floats(-100.0, 100.0)


@given(start=LEVELS, stop=LEVELS, rate=hs.floats(0.01, 10.0), dt=hs.floats(0.1, 10.0))
def test_ramp_has_its_ends_and_never_exceeds_its_rate(start, stop, rate, dt):
    levels = ramp(start, stop, rate, dt)
    moves = np.diff(levels) * np.sign(stop - start)
    assert levels[-1] == stop
    assert np.all(moves >= 0.0)
    assert np.all(moves <= rate * dt * (1.0 + 1e-9))
    if levels.size > 1:
        assert levels[0] == start
        assert moves[:-1] == pytest.approx(rate * dt)


def test_triangle_has_one_speed_and_its_peaks():
    wave = triangle(50.0, 4.0, period=16.0, duration=32.0, dt=0.5)
    assert wave.size == 64
    assert (wave.min(), wave.max()) == (46.0, 54.0)
    assert set(np.abs(np.diff(wave)).tolist()) == {0.5}
    assert np.array_equal(triangle(50.0, 4.0, 16.0, 32.0, 0.5, upwards=False), 100.0 - wave)


def test_sine_has_one_line_in_its_spectrum():
    wave = sine(50.0, 4.0, period=16.0, duration=64.0, dt=0.5, phase=0.3)
    lines = np.fft.rfft(wave - 50.0) / wave.size * 2.0
    assert np.abs(lines[4]) == pytest.approx(4.0)
    assert np.angle(lines[4]) == pytest.approx(0.3 - np.pi / 2.0)
    assert np.delete(np.abs(lines), 4).max() < 1e-12


@given(levels=hs.lists(LEVELS, min_size=1, max_size=8), hold=hs.integers(1, 20))
def test_staircase_holds_each_level(levels, hold):
    assert staircase(levels, hold * 0.5, 0.5).reshape(-1, hold).tolist() == [[x] * hold for x in levels]


def test_random_walk_spreads_alike_at_any_sampling_period():
    for dt in (0.25, 1.0, 4.0):
        ends = [random_walk(50.0, 0.5, 400.0, dt, seed=k)[-1] for k in range(400)]
        assert np.mean(ends) == pytest.approx(50.0, abs=1.5)
        assert np.std(ends) == pytest.approx(0.5 * 20.0, rel=0.12)


def test_binary_sequence_keeps_its_levels_and_its_hold():
    series = binary_sequence(48.0, 52.0, hold=5.0, duration=2001.0, dt=1.0, seed=1)
    assert series.size == 2001
    assert set(series.tolist()) == {48.0, 52.0}
    assert set((np.flatnonzero(np.diff(series)) + 1) % 5) == {0}
    assert 0.4 < np.mean(series == 52.0) < 0.6


@pytest.mark.parametrize("signal", [random_walk, binary_sequence])
def test_a_seed_draws_the_same_again(signal):
    arguments = {"duration": 50.0, "dt": 1.0}
    first = (50.0, 0.3) if signal is random_walk else (48.0, 52.0, 1.0)
    draw = [signal(*first, **arguments, seed=seed) for seed in (1, 1, 2)]
    assert np.array_equal(draw[0], draw[1])
    assert not np.array_equal(draw[0], draw[2])


REFUSED = [
    (ramp, (0.0, 1.0, 0.0, 1.0), "rate = 0 %/s is not positive"),
    (ramp, (0.0, float("nan"), 1.0, 1.0), "stop must be a finite number"),
    (triangle, (0.0, -1.0, 1.0, 1.0, 1.0), "amplitude = -1 % of span is negative"),
    (sine, (0.0, 1.0, -2.0, 1.0, 1.0), "period = -2 s is not positive"),
    (staircase, ([1.0, "x"], 1.0, 1.0), "series of numbers"),
    (staircase, (np.ma.masked_greater([1.0, 99.0], 50.0), 1.0, 1.0), "series of finite numbers"),
    (staircase, ([1.0], 0.2, 1.0), "hold = 0.2 s is shorter than one sample of 1 s"),
    (random_walk, (0.0, -1.0, 1.0, 1.0), "spread = -1 % of span is negative"),
    (binary_sequence, (2.0, 1.0, 1.0, 1.0, 1.0), "low = 2 % is not below high = 1 %"),
    (ramp, (0.0, 100.0, 1e-12, 1.0), r"the ramp = 1e\+14 s is 1e\+14 samples"),
    (ramp, (0.0, 100.0, 1e-300, 1e-300), "the ramp = 1e\\+302 s"),
    (sine, (0.0, 1.0, 1.0, 1e9, 1.0), r"duration = 1e\+09 s is 1e\+09 samples"),
    (triangle, (0.0, 1.0, 1.0, 1e9, 1.0), r"duration = 1e\+09 s"),
    (staircase, ([1.0, 2.0, 1.0], 4e6, 1.0), r"the steps together = 1.2e\+07 s"),
    (random_walk, (0.0, 1.0, 1e9, 1.0), r"duration = 1e\+09 s"),
    (binary_sequence, (0.0, 1.0, 1.0, 1e9, 1.0), r"duration = 1e\+09 s"),
    (binary_sequence, (0.0, 1.0, 1e9, 10.0, 1.0), r"hold = 1e\+09 s"),
]


@pytest.mark.parametrize(("signal", "arguments", "message"), REFUSED)
def test_bad_arguments_get_a_sentence(signal, arguments, message):
    with pytest.raises(st.ParameterError, match=message):
        signal(*arguments)


@pytest.mark.parametrize("seed", [-1, 1.5, float("nan"), "one"])
@pytest.mark.parametrize(
    ("signal", "arguments"), [(random_walk, (1.0, 1.0, 10.0, 1.0)), (binary_sequence, (0, 1, 1, 9, 1))]
)
def test_a_seed_is_a_whole_number_of_0_or_more(signal, arguments, seed):
    with pytest.raises(st.ParameterError, match="seed"):
        signal(*arguments, seed=seed)
