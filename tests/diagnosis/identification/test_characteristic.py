"""A good valve with a bent characteristic: the bend is found and passes for no band, and a band passes for no bend."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

import stiction as st
from stiction.diagnosis.identification.characteristic import bent_valve, characteristics
from stiction.diagnosis.identification.likelihood import Trial, by_cycle, errors_of, good_valve, prediction_of
from stiction.diagnosis.identification.signals import prepare

from .loops import KNOWN, run_of

NOISE = 0.02
GOOD = good_valve(Trial(1.0, 0.0, 0.0, 0.0, 0.0))


def seat(place):
    return np.maximum(place, 0.35)


def tangent(place):
    """A curve that is not among those tried, bent as an equal percentage trim is."""
    return np.tan(1.25 * np.clip(place, -0.2, 1.1))


def behind(flow, n=3000, lag=12.0):
    """OP wanders and swings in open loop; a first-order process with noise answers to what `flow` makes of it."""
    rng = np.random.default_rng(3)
    wander = np.cumsum(rng.normal(size=n))
    op = 50.0 + 10.0 * np.sin(2.0 * np.pi * np.arange(n) / 60.0) + wander - np.linspace(wander[0], wander[-1], n)
    low, high = np.quantile(op, (0.02, 0.98))
    driven, pv = flow((op - low) / (high - low)), np.zeros(n)
    for k in range(1, n):
        pv[k] = pv[k - 1] + (driven[k - 1] - pv[k - 1]) / lag + NOISE * rng.normal()
    return st.LoopRecord("FC1", 1.0, op=op, pv=pv)


@pytest.mark.parametrize(
    ("flow", "name"),
    [
        (seat, "a seat at 35 %"),
        (lambda z: np.minimum(z, 0.65), "wide open from 65 %"),
        (lambda z: np.where(z < 0.5, z, 0.5 + 3.0 * (z - 0.5)), "a slope 3 times as steep from 50 %"),
        (lambda z: np.exp(3.0 * np.clip(z, -0.3, 1.3)), "equal percentage"),
        (lambda z: -np.exp(-3.0 * np.clip(z, -0.3, 1.3)), "quick opening"),
        (lambda z: np.sign(z - 0.5) * np.maximum(abs(z - 0.5) - 0.2, 0.0), "a gap of 40 % about 50 %"),
    ],
)
def test_the_bend_that_made_the_record_is_found(flow, name):
    record = behind(flow)
    prediction = prediction_of(prepare(record, 60.0))
    found, bent = bent_valve(prediction)
    assert found.startswith(name)
    # Nothing is left but the noise that was put in; the regression's three dozen weights take a hundredth of it.
    left = bent.error.sum() / prediction.samples * np.var(record.pv)
    assert left == pytest.approx(NOISE**2, rel=0.05)
    assert prediction.samples * np.log(by_cycle(prediction, GOOD).sum() / bent.error.sum()) > 50.0


def test_a_bend_that_is_not_among_those_tried_is_near_one():
    prediction = prediction_of(prepare(behind(tangent), 60.0))
    found, bent = bent_valve(prediction)
    assert found.startswith("equal percentage")
    assert prediction.samples * np.log(by_cycle(prediction, GOOD).sum() / bent.error.sum()) > 500.0


@pytest.mark.parametrize("size", [0.0, 20.0])
def test_an_op_that_all_but_rests_is_bent_without_harm(size):
    record = behind(lambda place: place)
    op = np.full(record.op.size, 50.0)
    op[1500:1510] += size
    _, bent = bent_valve(prediction_of(prepare(record, 60.0))._replace(op=op))
    assert np.all(np.isfinite(bent.error))
    assert np.all(bent.error >= 0.0)


def test_a_known_stem_leaves_what_a_valve_leaves_that_makes_it():
    record = run_of(KNOWN["first order"], 0.05)
    prediction = prediction_of(prepare(replace(record, mv=None), 105.0))
    stem = prediction.op.reshape(1, -1, prediction.width).mean(axis=2)
    left, halves = errors_of(prediction, stem)
    assert halves == pytest.approx(by_cycle(prediction, GOOD), rel=1e-4)
    assert left == pytest.approx(halves.sum(axis=1), rel=1e-5)


@given(some.lists(some.floats(-0.5, 1.5), min_size=2, max_size=40).map(sorted))
def test_a_characteristic_never_goes_back_and_has_no_memory(places):
    up = dict(characteristics(np.array(places)))
    down = dict(characteristics(np.array(places[::-1])))
    assert len(up) == 24
    for name, flow in up.items():
        assert np.all(np.diff(flow) >= 0.0), name
        assert np.array_equal(flow, down[name][::-1])


def driven_from_outside(curve, n=1500):
    """A good valve with a curve, a PI controller, a first-order process and a wave at its inlet."""
    rng = np.random.default_rng(5)
    op, pv = np.full(n, 50.0), np.full(n, 50.0)
    state, integral = 0.0, 0.0
    for k in range(1, n):
        wave = 6.0 * np.sin(2.0 * np.pi * k / 70.0) + 0.3 * rng.normal()
        state += (curve(op[k - 1]) - curve(50.0) + wave - state) / 10.0
        pv[k] = 50.0 + state + 0.02 * rng.normal()
        integral += (50.0 - pv[k]) / 12.0
        op[k] = 50.0 + 0.8 * (50.0 - pv[k] + integral)
    return st.LoopRecord("FC1", 1.0, op=op, pv=pv, sp=np.full(n, 50.0))


def test_a_valve_on_its_seat_passes_for_a_band_only_beside_a_straight_one():
    found = st.identify(driven_from_outside(lambda u: max(u, 49.0)), period=70.0)
    assert found.over("good").likelier > 100.0
    assert found.over("bent").likelier < 0.0
    assert found.over("bent").beats < 0.0
    assert found.to_dict()["bent"] == found.bent
    assert found.to_dict()["rivals"]["bent"]["likelier"] == found.over("bent").likelier
