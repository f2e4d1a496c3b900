"""Intervals, parts of a record and trends against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identification.candidates import Valve
from stiction.diagnosis.identification.intervals import (
    INTERVAL_FEATURES,
    interval_features,
    intervals,
    segment_estimates,
    trend,
)
from stiction.diagnosis.identification.model_fit import independent_share
from stiction.diagnosis.identification.regression import build_regression


def test_features_are_the_numbers_that_their_names_say():
    rng = np.random.default_rng(0)
    op = np.cumsum(np.full(4000, 0.05)) + 0.02 * rng.normal(size=4000)
    values = interval_features(op, Valve(2.0, 0.4, 0.0, 0.0), 60.0, 25, exact=False)
    found = dict(zip(INTERVAL_FEATURES, values, strict=True))
    assert found["op_step_to_S"] == pytest.approx(np.log1p(np.median(np.abs(np.diff(op))) / 2.0))
    assert found["op_noise_to_S"] == pytest.approx(np.log1p(0.02 / 2.0), rel=0.05)
    assert found["weak_evidence"] == pytest.approx(0.25)
    assert found["few_half_cycles"] == pytest.approx(0.2)
    assert (found["not_exact"], found["jump_ratio"]) == (1.0, 0.4)


@pytest.mark.parametrize("S", [0.5, 3.0])
@pytest.mark.parametrize("ratio", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("ratio_of_evidence", [0.0, 20.0, 2000.0])
def test_intervals_hold_their_estimate_and_keep_to_the_swing(S, ratio, ratio_of_evidence):
    valve = Valve(S, ratio, 0.0, 0.0)
    op = 50.0 + np.sin(np.arange(500) / 9.0)
    features = interval_features(op, valve, ratio_of_evidence, 30, exact=True)
    (middle, low, high), (J, J_low, J_high) = intervals(valve, features, 4.0)
    assert 0.0 < low <= middle <= high <= max(4.0, middle)
    assert 0.0 <= J_low <= J <= J_high <= middle
    assert pytest.approx(ratio * middle) == J


def test_intervals_scale_with_the_valve():
    op = 50.0 + np.sin(np.arange(500) / 9.0)
    found = []
    for k in (1.0, 7.0):
        valve = Valve(k * 2.0, 0.5, 0.0, 0.0)
        found.append(intervals(valve, interval_features(k * op, valve, 50.0, 30, exact=True), 9e9))
    one, other = found
    np.testing.assert_allclose(np.array(other), 7.0 * np.array(one), rtol=1e-9)


def parts(first, last):
    """S of eight parts of a record whose valve has one S in its first half and another in its second."""
    rng = np.random.default_rng(2)
    op = 50.0 + 5.0 * np.sin(np.arange(4000) / 7.0) + 0.2 * rng.normal(size=4000)
    stems = [st.stroke(st.Kano(S, 0.5 * S), op, dt=1.0).mv for S in (first, last)]
    stem = np.where(np.arange(4000) < 2000, *stems)
    pv = np.convolve(stem - 50.0, np.exp(-np.arange(40) / 5.0) / 5.0)[:4000] + 0.05 * rng.normal(size=4000)
    regression = build_regression(op, pv, 1, 44.0)
    S, ratio, ends = segment_estimates(regression, Valve(0.5 * (first + last), 0.5, 0.0, 0.0), 8)
    assert (ends[0], ends[-1]) == (regression.first, 4000)
    assert (ratio > 20.0).all()
    return S


def test_each_part_of_a_record_shows_the_valve():
    S = parts(2.5, 2.5)
    assert np.median(S) == pytest.approx(2.5, rel=0.03)
    assert np.ptp(S) < 0.25 * 2.5


def test_a_valve_that_gets_worse_is_visible_in_the_parts():
    S = parts(2.0, 3.0)
    assert S[-3:].min() > 1.3 * S[:3].max()


def test_a_trend_is_that_of_least_squares():
    rng = np.random.default_rng(3)
    hours, S = np.sort(rng.uniform(0.0, 30.0, 9)), rng.normal(3.0, 0.2, 9)
    (slope, _), covariance = np.polyfit(hours, S, 1, cov="unscaled")
    left = S - np.polyval(np.polyfit(hours, S, 1), hours)
    error = np.sqrt(covariance[0, 0] * float(left @ left) / 7.0)
    assert trend(hours, S) == pytest.approx((slope, error))
    assert np.isnan(trend(hours[:3], S[:3])).all()


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.8])
def test_the_independent_share_of_a_first_order_residual_is_its_closed_form(memory):
    rng, x = np.random.default_rng(4), np.zeros(40_000)
    noise = rng.normal(size=x.size)
    for k in range(1, x.size):
        x[k] = memory * x[k - 1] + noise[k]
    assert independent_share(x) == pytest.approx((1.0 - memory) / (1.0 + memory), rel=0.15)
