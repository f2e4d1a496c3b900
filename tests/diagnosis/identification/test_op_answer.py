"""Whether PV answers OP: loops of known gain, and a PV that OP does not move."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from stiction.diagnosis.identification.op_answer import DELAYS, LAGS, answers, find_answer

N, FIRST = 600, 16


def orthonormal(n):
    return np.full((1, n), n**-0.5)


def test_answers_to_a_step_are_those_of_first_order_lags():
    op = np.where(np.arange(N) < 50, 0.0, 3.0)
    found = answers(op, FIRST)
    assert found.shape == (len(LAGS) * len(DELAYS), N - FIRST)
    times = np.arange(FIRST, N) - 49.0
    expected = [
        3.0 * np.where(times > delay, 1.0 - (np.exp(-(times - delay) / lag) if lag else 0.0), 0.0)
        for lag in LAGS
        for delay in DELAYS
    ]
    np.testing.assert_allclose(found, expected, atol=1e-5)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_answer_with_the_sign_of_the_controller_is_found(sign):
    rng = np.random.default_rng(2)
    op = np.cumsum(rng.normal(size=N))
    pv = sign * np.r_[np.zeros(3), op[:-3]] + rng.normal(size=N)
    right, wrong = find_answer(answers(op, FIRST), pv[FIRST:], orthonormal(N - FIRST), sign)
    other_right, other_wrong = find_answer(answers(op, FIRST), pv[FIRST:], orthonormal(N - FIRST), -sign)
    assert right > 1000.0 > wrong
    assert (other_right, other_wrong) == (wrong, right)


def test_evidence_of_chance_is_that_of_one_coefficient():
    """Of a PV that OP does not move, twice the log likelihood ratio of one answer has a chi-square law."""
    rng = np.random.default_rng(4)
    op = rng.normal(size=N)
    one = answers(op, FIRST)[:1]
    drawn = rng.normal(size=(400, N - FIRST))
    found = np.array([sum(find_answer(one, pv, orthonormal(N - FIRST), 1.0)) for pv in drawn])
    np.testing.assert_allclose(np.quantile(found, [0.5, 0.9]), chi2(1).ppf([0.5, 0.9]), rtol=0.25)


def test_what_is_known_beside_it_is_not_counted():
    op = np.random.default_rng(5).normal(size=N)
    tried = answers(op, FIRST)
    known = tried[:1] / np.linalg.norm(tried[:1])
    right, wrong = find_answer(tried[:1], 5.0 * tried[0], known, 1.0)
    assert (right, wrong) == pytest.approx((0.0, 0.0), abs=1e-6)
