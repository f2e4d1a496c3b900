"""A good valve beside a wave from outside: what it leaves is a regression's, and no sticky valve is taken for one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import stiction as st
from stiction.diagnosis.identification.contest import Contest, LookAlike
from stiction.diagnosis.identification.likelihood import prediction_of
from stiction.diagnosis.identification.outside_wave import CHANGE_WORTH, fundamental, outside_wave, repeated
from stiction.diagnosis.identification.signals import prepare


def saw(phase):
    return 2.0 * (phase % 1.0) - 1.0


def square(phase):
    return 1.0 if phase % 1.0 < 0.5 else -1.0


def driven_from_outside(shape, period, n=1500, band=0.0):
    """A valve that rests within a band about OP, a PI controller, a first-order process and a wave at its inlet."""
    rng = np.random.default_rng(5)
    op, pv = np.full(n, 50.0), np.full(n, 50.0)
    state, integral, stem = 0.0, 0.0, 50.0
    for k in range(1, n):
        stem = op[k - 1] if abs(op[k - 1] - stem) > band else stem
        state += (stem - 50.0 + 6.0 * shape(k / period) + 0.1 * rng.normal() - state) / 10.0
        pv[k] = 50.0 + state + 0.02 * rng.normal()
        integral += (50.0 - pv[k]) / 12.0
        op[k] = 50.0 + 0.8 * (50.0 - pv[k] + integral)
    return st.LoopRecord("FC1", 1.0, op=op, pv=pv, sp=np.full(n, 50.0))


def test_what_is_left_is_that_of_a_regression_on_the_harmonics_too():
    record = driven_from_outside(saw, 23.7)
    prediction = prediction_of(prepare(record, 23.7))
    rival = outside_wave(prediction, 23.7, prediction.op).good
    pv, begin, n = prediction.pv, prediction.begin, prediction.pv.size
    op = prediction.op.reshape(n, -1).mean(axis=1)
    columns = [np.ones(n - begin)] + [pv[begin - i : n - i] for i in range(1, prediction.order + 1)]
    for first, last in zip(prediction.edges[:-1], prediction.edges[1:], strict=True):
        columns.append(np.sum([op[begin - lag : n - lag] for lag in range(first, last)], axis=0))
    before = len(columns)
    harmonics = int(rival.weights) // 2
    own = fundamental(pv, 23.7, harmonics)
    for h in range(1, harmonics + 1):
        angle = 2.0 * np.pi * h / own * np.arange(begin, n)
        columns += [np.cos(angle), np.sin(angle)]
    A = np.stack(columns, axis=1)
    left = ((pv[begin:] - A @ np.linalg.lstsq(A, pv[begin:], rcond=None)[0]) ** 2).sum()
    # The harmonics are taken out over the whole record and not over what is predicted of it: all but the same.
    assert rival.error.sum() == pytest.approx(left, rel=0.02)
    assert rival.weights == len(columns) - before
    alone = A[:, :before]
    assert ((pv[begin:] - alone @ np.linalg.lstsq(alone, pv[begin:], rcond=None)[0]) ** 2).sum() > 4.0 * left


@given(period=some.floats(8.0, 90.0), harmonics=some.integers(1, 3), n=some.integers(200, 400))
def test_what_repeats_is_that_of_a_regression_on_sines(period, harmonics, n):
    signals = np.random.default_rng(n).normal(size=(2, n)).cumsum(axis=1)
    angle = 2.0 * np.pi / period * np.outer(np.arange(n), np.arange(1, harmonics + 1))
    A = np.column_stack([np.ones(n), np.cos(angle), np.sin(angle)])
    own = (A @ np.linalg.lstsq(A, signals.T, rcond=None)[0]).T
    assert repeated(signals, period, harmonics) == pytest.approx(own, abs=1e-9 * np.ptp(signals))


@settings(max_examples=30, deadline=None)
@given(period=some.floats(20.0, 80.0), off=some.floats(0.85, 1.15), seed=some.integers(0, 99))
def test_the_period_of_a_saw_is_found(period, off, seed):
    rng = np.random.default_rng(seed)
    pv = saw(np.arange(1600) / period + rng.random()) + 0.3 * rng.normal(size=1600)
    # Cramer and Rao: the first harmonic alone tells a frequency to 6e-6 here; half a step of the search is 4e-6.
    assert 1.0 / fundamental(pv - pv.mean(), off * period, 6) == pytest.approx(1.0 / period, abs=3e-5)


@pytest.mark.parametrize(("samples", "period"), [(400, 90.0), (400, 3.0)])
def test_too_few_periods_or_samples_of_one_tell_no_wave(samples, period):
    record = replace(driven_from_outside(saw, 40.0), integrating=False).window(0, samples)
    prediction = prediction_of(prepare(record, 40.0))
    assert outside_wave(prediction, period, prediction.op) is None


def test_a_wave_from_outside_passes_for_a_band_only_where_it_is_not_looked_for():
    found = st.identify(driven_from_outside(square, 71.3), period=70.0)
    assert found.over("good").likelier > 100.0
    assert found.over("wave").likelier < 0.0
    assert found.to_dict()["rivals"]["wave"]["likelier"] == found.over("wave").likelier
    assert found.to_dict()["rivals"]["wave"]["beats"] == found.over("wave").beats


def test_a_wave_that_begins_or_ends_within_the_record_leaves_no_more(monkeypatch):
    begins = driven_from_outside(lambda phase: saw(phase) * (phase > 21.0), 23.7)
    ends = driven_from_outside(lambda phase: saw(phase) * (phase < 42.0), 23.7)
    for record in (begins, ends):
        prediction = prediction_of(prepare(record, 23.7))
        found = outside_wave(prediction, 23.7, prediction.op).good
        with monkeypatch.context() as patch:
            patch.setattr("stiction.diagnosis.identification.outside_wave.CHANGES", ())
            throughout = outside_wave(prediction, 23.7, prediction.op).good
        assert found.weights == 2.0 * throughout.weights + CHANGE_WORTH
        assert throughout.error.sum() > 1.5 * found.error.sum()


@pytest.mark.parametrize(("band", "least", "most"), [(0.0, -50.0, 50.0), (6.0, 100.0, np.inf)])
def test_a_wave_beside_both_leaves_what_the_stem_alone_explains(band, least, most):
    found = st.identify(driven_from_outside(square, 71.3, band=band), period=70.0)
    assert least < found.over("beside_wave").likelier < most
    assert (found.over("beside_wave").beats > 3.0) == (band > 0.0)
    assert found.to_dict()["rivals"]["beside_wave"]["likelier"] == found.over("beside_wave").likelier
    assert found.to_dict()["rivals"]["beside_wave"]["beats"] == found.over("beside_wave").beats


def test_weights_that_a_rival_has_for_nothing_are_made_good():
    error = np.array([np.full(20, 3.0), np.full(20, 5.0)])
    contest = Contest(np.ones((2, 5)), error, np.zeros(2), (0.0, 0.0), (0.0, 0.0), 0.5, 0.0, 0.0)
    left = 3.0 + np.tile([0.5, 1.5], 10)
    total = 20 * 1.0 / 0.5
    assert contest.over(LookAlike(left, 0.0))[1] == pytest.approx(total)
    statistic, likelier = contest.over(LookAlike(left, 6.0))
    assert likelier == pytest.approx(total + 6.0)
    # Differences of 1 and 3, about 2: a variance of 20 / 19.
    assert statistic == pytest.approx((total + 6.0) / np.sqrt(20 * 20 / 19))
