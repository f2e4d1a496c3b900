"""The search kernel against a slow twin that shares no line with it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as some

import naive
from stiction.diagnosis.identification import search as page
from stiction.diagnosis.identification.lanes import follow_lanes

from .twin import (
    CASES,
    N,
    about_local_mean,
    assert_best,
    between,
    candidates,
    lag,
    least_squares,
    noisy,
    response,
    shifted,
    walk,
)


def run(op, target, half, S, J, first, second, delays, begin, sign):
    """The kernel with its work space: error, gain, best, by_delay."""
    n, m = op.size, len(S)
    error, gain, best = np.empty(m), np.empty(m), np.empty((m, 3))
    delays = np.asarray(delays, np.int64)
    by_delay = np.empty((m, delays.size))
    page.search(
        op, 1, target, half, np.asarray(S, float), np.asarray(J, float), np.asarray(first, float),
        np.asarray(second, float), delays, begin, float(sign), error, gain, best, by_delay,
        page.work_space(n, half, len(first), delays, begin, m),
    )  # fmt: skip
    return error, gain, best, by_delay


@settings(max_examples=40)
@given(n=some.integers(1, 40), half=some.integers(0, 25), seed=some.integers(0, 99))
@example(n=7, half=3, seed=0)
@example(n=6, half=3, seed=0)
def test_local_mean_is_a_convolution(n, half, seed):
    x = np.random.default_rng(seed).normal(5.0, 3.0, n)
    out = np.full(n, np.nan)
    page.remove_local_mean(x, half, out)
    np.testing.assert_allclose(out, about_local_mean(x, half), atol=1e-11)


def test_a_ramp_vanishes_and_a_wave_of_one_period_stays():
    t = np.arange(400.0)
    wave = np.sin(2.0 * np.pi * t / 41.0)
    out = np.empty(400)
    page.remove_local_mean(wave + 3.0 + 0.25 * t, 20, out)
    np.testing.assert_allclose(out[20:-20], wave[20:-20], atol=1e-10)
    assert not out[:20].any()
    assert not out[-20:].any()


@settings(max_examples=25)
@given(S=some.floats(0.0, 8.0), ratio=some.floats(0.0, 1.0), seed=some.integers(0, 99))
def test_the_stem_is_kanos(S, ratio, seed):
    op = walk(seed)
    mv = np.empty(N)
    page.follow(op, S, ratio * S, mv)
    np.testing.assert_allclose(mv, naive.kano(op.tolist(), S, ratio * S), atol=1e-12)


@pytest.mark.parametrize(("first", "second"), [(0.9, 0.0), (1.0, 0.6), (0.0, 0.3), (0.7, 0.7)])
def test_two_lags_are_the_recursion(first, second):
    mv, y = np.random.default_rng(3).normal(size=60), np.empty(60)
    page.lag_pair(mv, 0.3, first, second, y)
    np.testing.assert_allclose(y, lag(lag(mv - 0.3, first), second), atol=1e-12)


@pytest.mark.parametrize("width", [1, 3])
def test_a_stem_in_lanes_is_the_one_followed_alone(width):
    op, S = walk(7, 3 * N), np.linspace(0.0, 9.0, 16)
    for ratio in (0.0, 0.4, 1.0):
        mv, one = np.empty((op.size // width, S.size)), np.empty(op.size)
        follow_lanes(op, S.copy(), ratio * S, width, np.empty(S.size), np.empty(S.size), mv)
        for lane in range(S.size):
            page.follow(op, S[lane], ratio * S[lane], one)
            np.testing.assert_allclose(mv[:, lane], one.reshape(-1, width).mean(axis=1), atol=1e-12)


@pytest.mark.parametrize("sign", [0.0, 1.0, -1.0])
@pytest.mark.parametrize("case", CASES)
def test_every_whole_dead_time_against_the_twin(case, sign):
    half, first, second, delays = CASES[case]
    for seed in range(4):
        rng = np.random.default_rng(seed)
        op = walk(seed)
        S = rng.uniform(0.2, 5.0, 3)
        J = S * rng.uniform(0.0, 1.0, 3)
        true = response(op, S[0], J[0], first[0], second[0], half)
        target = noisy(true, delays[-1] + 1, half, rng, -1.0 if seed % 2 else 1.0)
        begin = half + delays[-1] + 2
        error, gain, best, by_delay = run(op, target, half, S, J, first, second, delays, begin, sign)
        energy = float(np.sum(target[begin : N - half] ** 2))
        for i in range(3):
            fits = list(candidates(op, target, half, S[i], J[i], first, second, delays, begin, sign))
            assert_best(error[i], gain[i], best[i], fits, target[begin : N - half])
            whole = [fit for fit in fits if len(fit.weights) == 1]
            left = [min((fit.left for fit in whole if fit.delay == d), default=energy) for d in delays]
            np.testing.assert_allclose(by_delay[i], left, rtol=1e-9)


@settings(max_examples=30)
@given(
    S=some.floats(0.5, 4.0),
    ratio=some.floats(0.0, 1.0),
    delay=some.integers(-1, 5),
    part=some.floats(0.05, 0.95),
    gain=some.floats(0.1, 9.0),
    half=some.sampled_from([0, 10, 17]),
    integrates=some.booleans(),
    seed=some.integers(0, 99),
)
def test_a_dead_time_between_samples_is_found_exactly(S, ratio, delay, part, gain, half, integrates, seed):
    op = walk(seed)
    first, second, delays = [0.6, 1.0 if integrates else 0.85, 0.0], [0.0, 0.4, 0.0], np.arange(-1, 7)
    y = response(op, S, ratio * S, first[1], second[1], half)
    begin, end = half + 8, N - half
    target = between(y, delay, part, gain, begin, end)
    error, found, best, _ = run(op, target, half, [S], [ratio * S], first, second, delays, begin, 1.0)
    power = float(np.sum(target**2))
    if power < 1e-3 * gain**2 * S**2:
        return  # the stem hardly moved
    assert error[0] < 1e-9 * power
    assert best[0, 0] == 1.0
    assert best[0, 1] == delay
    assert best[0, 2] == pytest.approx(part, abs=1e-4)
    assert found[0] == pytest.approx(gain, rel=1e-5)


@pytest.mark.parametrize("sign", [0.0, 1.0])
@pytest.mark.parametrize("seed", range(6))
def test_what_is_reported_is_what_a_least_squares_fit_of_it_leaves(seed, sign):
    # Fractions are tried only near a good whole dead time, so the kernel may miss a better pair of bad ones:
    # it must do at least as well as whole dead times, never better than all pairs, and tell the truth about its best.
    rng = np.random.default_rng(100 + seed)
    half, first, second, delays = 11, [0.3, 0.8, 0.95], [0.0, 0.5, 0.0], np.arange(-1, 6)
    op = walk(seed)
    target = about_local_mean(2.0 * response(op, 2.0, 1.0, 0.8, 0.5, half) + rng.normal(0.0, 0.5, N), half)
    begin, end = half + 7, N - half
    S, J = [1.0, 2.0, 3.0], [0.5, 1.0, 0.0]
    error, gain, best, _ = run(op, target, half, S, J, first, second, delays, begin, sign)
    for i in range(3):
        fits = list(candidates(op, target, half, S[i], J[i], first, second, delays, begin, sign))
        whole = min(fit.left for fit in fits if len(fit.weights) == 1)
        assert error[i] <= whole * (1.0 + 1e-9)
        assert error[i] >= min(fit.left for fit in fits) * (1.0 - 1e-9)
        pair, delay = int(best[i, 0]), int(best[i, 1])
        y = response(op, S[i], J[i], first[pair], second[pair], half)
        columns = [shifted(y, delay + late, begin, end) for late in ((0, 1) if best[i, 2] else (0,))]
        weights, left = least_squares(columns, target[begin:end])
        assert error[i] == pytest.approx(left, rel=1e-8)
        assert gain[i] == pytest.approx(weights.sum(), rel=1e-6)
        assert best[i, 2] == pytest.approx(weights[1] / weights.sum() if len(weights) == 2 else 0.0, abs=1e-6)


def test_a_stem_that_never_moves_explains_nothing():
    op = 50.0 + np.sin(np.arange(N) / 5.0)
    target = about_local_mean(np.sin(np.arange(N) / 5.0), 10)
    error, gain, best, _ = run(op, target, 10, [30.0], [3.0], [0.5, 1.0], [0.0, 0.0], [-1, 0, 1], 13, 0.0)
    assert error[0] == pytest.approx(np.sum(target[13 : N - 10] ** 2))
    assert gain[0] == 0.0
    assert best[0, 0] == -1.0


@given(seed=some.integers(0, 999), sign=some.sampled_from([-1.0, 0.0, 1.0]), late=some.floats(-0.5, 1.5))
def test_the_shares_of_an_answer_and_its_next_sample_are_a_least_squares_fit(seed, sign, late):
    rng = np.random.default_rng(seed)
    one, other = rng.normal(size=(2, 40)).cumsum(axis=1)
    target = (1.0 - late) * one + late * other + 0.1 * rng.normal(size=40)
    products = (one @ target, other @ target, one @ one, other @ other, one @ other)
    best = np.linalg.lstsq(np.stack([one, other], axis=1), target, rcond=None)[0]
    between_them = best.prod() > 0.0 and best[0] * sign >= 0.0
    assert page.shares(*products, sign) == pytest.approx(tuple(best) if between_them else (0.0, 0.0), rel=1e-6)
    assert page.shares(1.0, 1.0, 2.0, 2.0, 2.0, sign) == (0.0, 0.0), "the same answer twice"
