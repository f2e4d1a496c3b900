"""The process behind a valve against closed forms: steps, ramps and SciPy's filters."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from stiction.diagnosis.identification.process_fit import (
    FittedProcess,
    compared_part,
    fit_process,
    remove_local_mean,
    simulate_process,
)
from stiction.diagnosis.identification.stems import process_products

N = 900


def moves(seed=0, n=N, held=12):
    """A position that steps at random and is held."""
    return np.repeat(np.random.default_rng(seed).normal(size=n // held), held)


def test_a_first_order_process_answers_a_step_as_its_closed_form():
    begin = N // 2
    step = np.where(np.arange(N) >= begin, 1.0, 0.0)
    pv = simulate_process(step, FittedProcess(2.0, 20.0, 0.0, 5.0, 0.0), None)
    k = np.arange(N - begin - 5)
    expected = 2.0 * (1.0 - np.exp(-(k + 1.0) / 20.0))
    np.testing.assert_allclose(pv[begin + 5 :] - pv[begin + 4], expected, atol=1e-8)


def test_an_integrator_answers_a_step_as_a_ramp():
    step = np.where(np.arange(N) >= N // 2, 1.0, -1.0)
    pv = simulate_process(step, FittedProcess(0.1, np.inf, 0.0, 3.0, 0.0), None)
    np.testing.assert_allclose(np.diff(pv)[N // 2 + 3 :], 0.1, atol=1e-9)
    np.testing.assert_allclose(np.diff(pv)[10 : N // 2 + 2], -0.1, atol=1e-9)


@pytest.mark.parametrize(
    ("gain", "slow", "fast", "delay"),
    [(2.0, 8.0, 0.0, 3), (-0.5, 25.0, 0.0, 0), (1.5, 15.0, 6.0, 4), (0.05, np.inf, 0.0, 6), (-0.02, np.inf, 5.0, 2)],
)
def test_a_process_is_found_from_its_answer(gain, slow, fast, delay):
    u = moves(3)
    answer = u
    for lag in (slow, fast):
        if np.isinf(lag):
            answer = np.cumsum(answer - u.mean())
        elif lag > 0.0:
            decay = np.exp(-1.0 / lag)
            answer = lfilter([1.0 - decay], [1.0, -decay], answer)
    y = gain * np.concatenate([np.full(delay, answer[0]), answer[: N - delay]])
    y = y + 0.02 * y.std() * np.random.default_rng(1).normal(size=N)
    found = fit_process(u, y, None, integrating=None if np.isinf(slow) else False)
    assert np.isinf(found.slow) == np.isinf(slow)
    assert found.gain == pytest.approx(gain, rel=0.08)
    assert found.error < 0.02
    if np.isfinite(slow):
        assert found.slow + found.fast + found.dead_time == pytest.approx(slow + fast + delay, abs=1.5)


def test_the_gain_is_that_of_least_squares():
    u = moves(5)
    y = simulate_process(u, FittedProcess(1.0, 10.0, 0.0, 2.0, 0.0), 60.0) + np.random.default_rng(2).normal(size=N)
    found = fit_process(u, y, 60.0)
    answer = simulate_process(u, found._replace(gain=1.0), 60.0)[compared_part(N, 60.0)]
    target = remove_local_mean(y, 60.0)[compared_part(N, 60.0)]
    assert found.gain == pytest.approx(float(np.linalg.lstsq(answer[:, None], target, rcond=None)[0][0]), rel=2e-3)
    left = target - found.gain * answer
    assert found.error == pytest.approx(float(left @ left) / float(target @ target), rel=1e-3)


def test_a_gain_of_the_wrong_sign_is_not_taken():
    u = moves(6)
    y = simulate_process(u, FittedProcess(2.0, 8.0, 0.0, 3.0, 0.0), None)
    assert fit_process(u, y, None, sign=1.0).gain == pytest.approx(2.0, rel=0.05)
    assert fit_process(u, y, None, sign=-1.0).gain <= 0.0


def test_a_slow_load_does_not_change_the_process():
    u = moves(7)
    truth = FittedProcess(2.0, 8.0, 0.0, 3.0, 0.0)
    y = simulate_process(u, truth, None)
    drift = 20.0 * np.linspace(0.0, 1.0, N)
    found = fit_process(u, y + drift, 40.0)
    assert found.gain == pytest.approx(2.0, rel=0.05)
    assert found.slow + found.dead_time == pytest.approx(11.0, abs=1.0)


def test_nothing_is_explained_where_nothing_moves():
    still = np.full(200, 5.0)
    assert fit_process(still, np.random.default_rng(0).normal(size=200), None)[0::4] == (0.0, 1.0)
    assert fit_process(moves(n=204), np.full(204, 3.0), None).gain == 0.0


@pytest.mark.parametrize("slow", [7.0, np.inf])
@pytest.mark.parametrize(("fast", "dead_time"), [(0.0, 0.0), (2.0, 3.0), (1.5, 4.25)])
def test_the_products_of_an_answer_are_those_of_the_simulated_process(slow, fast, dead_time):
    rng = np.random.default_rng(5)
    u, target = rng.normal(size=(2, 400))
    u -= u.mean()
    answer = simulate_process(u, FittedProcess(1.0, slow, fast, dead_time, 0.0), None)
    answer -= answer.mean()
    keep = 1.0 if np.isinf(slow) else np.exp(-1.0 / slow), np.exp(-1.0 / max(fast, 1e-3))
    square, cross = process_products(u, *keep, dead_time, target, 30, 370)
    assert square == pytest.approx(float(answer[30:370] @ answer[30:370]), rel=1e-9)
    assert cross == pytest.approx(float(answer[30:370] @ target[30:370]), rel=1e-9)
