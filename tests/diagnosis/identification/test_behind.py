"""The process behind a known stem against the slow twin of the search, which follows OP with a good valve."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from stiction.diagnosis.identification.behind import best_behind

from .twin import CASES, N, about_local_mean, assert_best, between, candidates, noisy, response, walk


def found(stem, target, half, first, second, delays, begin, sign):
    first, second = np.asarray(first, float), np.asarray(second, float)
    return best_behind(stem, target, half, first, second, np.asarray(delays, np.int64), begin, sign)


@pytest.mark.parametrize("sign", [0.0, 1.0, -1.0])
@pytest.mark.parametrize("case", CASES)
def test_every_whole_dead_time_against_the_twin(case, sign):
    half, first, second, delays = CASES[case]
    for seed in range(4):
        rng, stem = np.random.default_rng(seed), walk(seed)
        true = response(stem, 0.0, 0.0, first[0], second[0], half)
        target = noisy(true, delays[-1] + 1, half, rng, -1.0 if seed % 2 else 1.0)
        begin = half + delays[-1] + 2
        fits = candidates(stem, target, half, 0.0, 0.0, first, second, delays, begin, sign)
        assert_best(*found(stem, target, half, first, second, delays, begin, sign), fits, target[begin : N - half])


@settings(max_examples=30)
@given(
    delay=some.integers(-1, 5),
    part=some.floats(0.05, 0.95),
    gain=some.floats(0.1, 9.0),
    half=some.sampled_from([0, 10, 17]),
    integrates=some.booleans(),
    seed=some.integers(0, 99),
)
def test_a_dead_time_between_samples_is_found_exactly(delay, part, gain, half, integrates, seed):
    stem = walk(seed)
    first, second, delays = [0.6, 1.0 if integrates else 0.85, 0.0], [0.0, 0.4, 0.0], np.arange(-1, 7)
    y = response(stem, 0.0, 0.0, first[1], second[1], half)
    begin, end = half + 8, N - half
    target = between(y, delay, part, gain, begin, end)
    error, k, best = found(stem, target, half, first, second, delays, begin, 1.0)
    assert error < 1e-9 * np.sum(target**2)
    assert best[:2].tolist() == [1.0, delay]
    assert best[2] == pytest.approx(part, abs=1e-4)
    assert k == pytest.approx(gain, rel=1e-5)


@pytest.mark.parametrize("half", [0, 10])
@pytest.mark.parametrize("place", [0.0, 50.0, 1e6 / 3.0])
def test_a_stem_that_never_moves_explains_nothing(half, place):
    target = about_local_mean(np.sin(np.arange(N) / 5.0), half)
    error, gain, best = found(np.full(N, place), target, half, [0.5, 1.0], [0.0, 0.0], [-1, 0, 1], half + 3, 0.0)
    assert error == pytest.approx(np.sum(target[half + 3 : N - half] ** 2))
    assert (gain, best[0]) == (0.0, -1.0)


@pytest.mark.parametrize("half", [0, 10])
def test_a_stem_that_came_to_rest_before_the_window_explains_nothing(half):
    """What its start leaves in a fast lag has faded to rounding, which no gain may blow up."""
    stem = np.where(np.arange(N) < 4, 40.0, 50.0)
    target = about_local_mean(np.sin(np.arange(N) / 5.0), half)
    begin = 4 * N // 5
    error, gain, _ = found(stem, target, half, [0.1], [0.0], [0, 1], begin, 0.0)
    assert error > 0.9 * np.sum(target[begin : N - half] ** 2)
    assert abs(gain) < 1.0
