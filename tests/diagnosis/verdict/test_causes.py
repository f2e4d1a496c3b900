"""What makes a loop oscillate: each cause where it is the truth, and each by itself."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identification.loop_response import S_GRID, LoopResponse
from stiction.diagnosis.verdict import causes
from stiction.diagnosis.verdict.cause_features import CAUSE_FEATURES
from stiction.diagnosis.verdict.causes import (
    CAUSES,
    OscillationCause,
    assess_causes,
    cause_models,
    find_detectable_S,
    smallest_shown,
)

N, DT = 2500, 1.0
WAVE = 3.0 * np.sin(2.0 * np.pi * np.arange(N) / 47.3)
UNKNOWN = {feature.name: math.nan for feature in CAUSE_FEATURES}


def main(causes):
    return set(causes.named)


def test_probable_causes_are_named_a_load_from_outside_last():
    causes = OscillationCause(valve=0.9, tuning=cause_models().named - 0.01, external=0.95, sensor=0.92)
    assert (causes.named, causes.main) == (("sensor", "valve", "external"), "sensor")
    assert OscillationCause(external=0.95, seen=0.5).named == ()
    assert (OscillationCause().named, OscillationCause().main) == ((), "none")


def test_probability_of_any_cause():
    assert OscillationCause(valve=0.5, tuning=0.2, external=0.1).any == pytest.approx(1.0 - 0.5 * 0.8 * 0.9)
    assert OscillationCause().any == 0.0


def test_json():
    assert list(OscillationCause().to_dict()) == list(CAUSES)


def test_each_cause_has_a_model_of_its_own_features():
    models = cause_models()
    assert set(models.causes) == set(CAUSES)
    others = {name: getattr(models, name) for name in ("unseen", "stuck", "position")}
    for cause, model in (models.causes | others).items():
        assert model.features == tuple(one.name for one in CAUSE_FEATURES if cause in one.signs)


@pytest.mark.parametrize(
    ("cause", "feature"),
    [(cause, one) for one in CAUSE_FEATURES for cause in one.signs if one.signs[cause]],
    ids=lambda x: getattr(x, "name", x),
)
def test_a_feature_acts_in_the_direction_of_its_sign(cause, feature):
    models = cause_models()
    model = models.causes[cause] if cause in CAUSES else getattr(models, cause)
    rng = np.random.default_rng(3)
    for _ in range(8):
        other = {name: float(rng.normal(0.0, 2.0)) for name in UNKNOWN}
        found = [model.probability(other | {feature.name: x}) for x in np.linspace(-5.0, 5.0, 21)]
        assert (feature.signs[cause] * np.diff(found) >= -1e-12).all()


def test_prior_changes_the_valve_alone():
    low, high = (assess_causes(UNKNOWN, prior) for prior in (0.05, 0.5))
    assert low.valve < high.valve
    assert replace(low, valve=0.0) == replace(high, valve=0.0)


def test_no_stiction_is_excluded_without_evidence_predicted():
    assert find_detectable_S(UNKNOWN, LoopResponse()) is None
    assert find_detectable_S(UNKNOWN, LoopResponse(evidence=np.zeros(S_GRID.size))) is None


def test_the_smallest_stiction_shown_lies_where_the_evidence_is_enough():
    """Evidence of 10 a step of the grid: 20 stands at its third S, 25 halfway in ln(S) to the fourth."""
    evidence = np.linspace(0.0, 90.0, 10)
    assert smallest_shown(evidence, 20.0) == pytest.approx(S_GRID[2], abs=1e-3)
    assert smallest_shown(evidence, 25.0) == pytest.approx(math.sqrt(S_GRID[2] * S_GRID[3]), abs=1e-3)
    assert smallest_shown(np.zeros(10), 20.0) is None


def test_detectable_stiction_grows_with_the_noise():
    """Noise of the transmitter hides small stiction."""
    quiet, noisy = (st.diagnose(simulate(st.Ideal(), noise=noise)).response for noise in (0.02, 0.5))
    assert (quiet.evidence[:3] > noisy.evidence[:3]).all()


def test_detectable_stiction_needs_a_stem_that_moves():
    """A valve whose OP moves less than its band leaves the noise of PV alone: no S is excluded."""
    rng = np.random.default_rng(5)
    loop = st.Loop(st.PID(0.25, 10.0), st.Kano(9.0, 4.0), st.FOPDT(2.0, 10.0, 5.0), dt=1.0, noise=0.3)
    rest = st.simulate(loop, sp=0.0, duration=float(N), seed=2)
    assert np.ptp(rest.mv) == 0.0
    found = st.diagnose(replace(rest, op=rest.op + 50.0 + 0.001 * rng.normal(size=N)))
    assert (found.S_detectable, found.verdict) == (None, "undecided")
    assert "OP moved" in found.next_step


def test_no_stiction_is_excluded_where_op_is_the_position_of_a_sticky_valve():
    run = simulate(st.Kano(6.0, 2.0), load=6.0 * WAVE)
    found = st.diagnose(replace(run, op=run.mv + 50.0, mv=None))
    assert (found.S_detectable, found.verdict, found.finding) == (None, "undecided", "not_in_command")


def simulate(valve, *, Kc=0.25, load=None, noise=0.1, random=0.6):
    """A PI loop about a lag of 10 s with a dead time of 5 s and gain 2, moved by a random load and set-point steps."""
    loop = st.Loop(st.PID(Kc, 10.0), valve, st.FOPDT(2.0, 10.0, 5.0), dt=1.0, noise=noise)
    rng = np.random.default_rng(1)
    upsets = np.convolve(rng.normal(0.0, random, N), np.ones(8) / 8.0, mode="same")
    total = upsets if load is None else upsets + load
    start = np.where(np.arange(N) < 40, 4.0, 0.0)  # without it a sticky valve would stay at rest
    run = st.simulate(loop, sp=start, duration=float(N), disturbance=total, seed=1)
    return replace(run, op=run.op + 50.0)


def test_simulated_loop_that_is_unstable_between_its_limits():
    """With the integral time at the lag T = 10 s the limit is Kc = pi T / (2 K L) = pi / 2."""
    controller = st.PID(1.8 * math.pi / 2.0, 10.0, op_limits=(0.0, 100.0))
    loop = st.Loop(controller, st.Ideal(), st.FOPDT(2.0, 10.0, 5.0), dt=1.0, noise=0.1)
    kick = np.where(np.arange(N) < 40, 4.0, 0.0)
    run = st.simulate(loop, sp=100.0, duration=float(N), disturbance=kick, seed=1, pv_start=100.0, op_start=50.0)
    found = st.diagnose(run)
    assert found.oscillation_cause.main == "tuning"
    assert found.finding == "tuning"


def test_simulated_loop_near_the_limit_of_stability():
    causes = st.diagnose(simulate(st.Ideal(), Kc=0.8 * math.pi / 2.0)).oscillation_cause
    assert causes.tuning > 0.5
    assert causes.tuning > causes.external


def test_a_load_that_switches_is_not_tuning():
    causes = st.diagnose(simulate(st.Ideal(), load=3.0 * np.sign(WAVE))).oscillation_cause
    assert causes.external > causes.tuning
    assert causes.tuning < 0.1


def test_simulated_load_from_outside():
    causes = st.diagnose(simulate(st.Ideal(), load=3.0 * WAVE, random=0.0)).oscillation_cause
    assert main(causes) == {"external"}


def test_simulated_set_point_that_moves():
    loop = st.Loop(st.PID(0.25, 10.0), st.Ideal(), st.FOPDT(2.0, 10.0, 5.0), dt=1.0, noise=0.1)
    run = st.simulate(loop, sp=4.0 * np.sin(np.arange(N) / 30.0), duration=float(N), seed=1)
    found = st.diagnose(replace(run, op=run.op + 50.0))
    assert (found.oscillation_cause.main, found.finding) == ("set_point", "follows")
    assert "upstream" not in found.action


def test_simulated_sticky_valve():
    found = st.diagnose(simulate(st.Kano(5.0, 2.0), random=0.1))
    assert found.oscillation_cause.main == "valve"


def test_simulated_sticky_valve_beside_a_load():
    found = st.diagnose(simulate(st.Kano(5.0, 2.5), load=1.5 * WAVE))
    assert found.verdict == "stiction"
    assert main(found.oscillation_cause) >= {"valve"}
    assert found.oscillation_cause.external > 0.3


def test_simulated_coarse_transmitter():
    record = simulate(st.Ideal(), load=0.4 * WAVE)
    assert record.pv is not None
    step = 0.5 * float(np.ptp(record.pv))
    assert st.diagnose(replace(record, pv=np.round(record.pv / step) * step)).oscillation_cause.sensor >= 0.5


def test_a_stem_is_not_stuck_where_the_valve_more_probably_makes_the_loop_oscillate(monkeypatch):
    stuck = SimpleNamespace(probability=lambda *_: 0.7, training_prior=0.1)
    monkeypatch.setattr(causes, "cause_models", lambda: SimpleNamespace(stuck=stuck, named=0.6))
    assert causes.is_stuck({}, causes.OscillationCause(valve=0.65))
    assert not causes.is_stuck({}, causes.OscillationCause(valve=0.75))
