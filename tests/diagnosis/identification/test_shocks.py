"""Samples that no valve predicts: what is left out, what is not, and what that does to S and to the likelihood."""

import math

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identification.likelihood import Trial, prediction_of, trials_of, valves
from stiction.diagnosis.identification.parts import part_of
from stiction.diagnosis.identification.shocks import ABOUT, MOST, shocks_of
from stiction.diagnosis.identification.signals import prepare

S, J, N, AT = 4.5, 2.0, 3000, 1700


def loop(step=0.0, spikes=(), *, sticky=True, noise=0.1, seed=3):
    """A loop by the balance of forces: a load that wanders keeps it moving, and steps once, or spikes hit its PV."""
    rng = np.random.default_rng(seed)
    K, T, Kc, Ti = 1.5, 12.0, 0.6, 12.0
    x = stem = total = load = 0.0
    op, pv = np.empty((2, N))
    hit = np.zeros(N)
    hit[list(spikes)] = 40.0 * noise
    for k in range(N):
        load += 0.05 * rng.normal() - 0.002 * load
        pv[k] = x + noise * rng.normal() + hit[k]
        total -= Kc * pv[k] / Ti
        op[k] = total - Kc * pv[k]
        if not sticky:
            stem = op[k]
        elif abs(op[k] - stem) > 0.5 * (S + J):
            stem = op[k] - math.copysign(0.5 * (S - J), op[k] - stem)
        x += (K * (stem + load + step * (k >= AT)) - x) / T
    return st.LoopRecord("FIC-101", 1.0, op=op + 50.0, pv=pv + 100.0, sp=np.full(N, 100.0))


def predicted(record):
    return prediction_of(prepare(record, None, fine=True), fine=True)


def true_valve(prediction):
    """The valve of the loop, its stem where it most likely began."""
    swing = float(np.ptp(prediction.op))
    return trials_of(prediction, valves(S, J / S, 1.0, np.linspace(-1.0, 1.0, 41), swing)).best


def test_a_step_of_the_load_is_left_out_and_slips_are_not():
    prediction = predicted(loop(step=2.0 * S))
    rows = shocks_of(prediction, true_valve(prediction))
    at = AT / prediction.width
    assert 2 * ABOUT < rows.size < 40
    assert np.all(np.abs(rows - at) < 25)
    plain = predicted(loop())
    assert not np.any(shocks_of(plain, true_valve(plain)) > 300)  # before, where the stem began is not forgotten


def test_what_leaves_no_more_than_slips_do_by_a_good_valve_is_none():
    prediction = predicted(loop(step=0.3 * S, noise=0.05))
    assert not np.any(shocks_of(prediction, true_valve(prediction)) > 300)


def test_a_valve_that_does_not_predict_its_slips_keeps_nothing_out():
    """By a wrong valve a record without noise is full of shocks: then none is one."""
    prediction = predicted(loop(noise=0.003))
    wrong = Trial(0.6 * S, 0.2, 1.0, 0.0, 0.0)
    assert shocks_of(prediction, wrong).size == 0


@pytest.mark.parametrize("seed", range(6))
def test_noise_is_no_shock(seed):
    prediction = predicted(loop(sticky=False, seed=seed))
    assert shocks_of(prediction, Trial(0.5, 0.5, 1.0, 0.0, 0.0)).size == 0


def test_no_more_than_a_share_of_the_record_is_left_out():
    few, many = (predicted(loop(spikes=range(100, N - 100, every))) for every in (1500, 40))
    assert 0 < shocks_of(few, true_valve(few)).size <= MOST * few.pv.size
    assert shocks_of(many, true_valve(many)).size == 0


def test_a_sticky_valve_beats_a_good_one_as_if_the_load_had_not_stepped():
    """Left in, the step's few samples swell the variance, and one half cycle outweighs all the others."""
    plain, stepped = (st.identify(loop(step)) for step in (0.0, 2.0 * S))
    assert stepped.over("good").likelier > 0.6 * plain.over("good").likelier > 60.0
    assert stepped.beats_any > 0.6 * plain.beats_any > 2.0
    assert pytest.approx(S, rel=0.05) == stepped.S
    assert plain.left_out == 0
    assert 2 * ABOUT < stepped.left_out == stepped.to_dict()["left_out"] < 120


def test_a_step_makes_no_good_valve_stick():
    found = st.diagnose(loop(step=2.0 * S, sticky=False))
    assert found.verdict == "no_stiction"


def test_samples_left_out_follow_the_part():
    left = predicted(loop())
    left = left._replace(shocks=np.array([500, 501, 502, 900]))
    assert left.samples == predicted(loop()).samples - 4
    assert part_of(left, 490, 300).shocks.tolist() == []  # none that the lags leave to be predicted
    assert part_of(left, 300, 400).shocks.tolist() == [200, 201, 202]
