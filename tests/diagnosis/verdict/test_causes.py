"""What makes a loop oscillate: each cause where it is the truth, and each by itself."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identification.result import ProcessFit
from stiction.diagnosis.verdict.causes import CAUSES, assess_causes, dead_zone_score, tuning_score

from .results import RATIOS, make_controller, make_identification, make_oscillation, make_zone

N, DT = 2500, 1.0
WAVE = 3.0 * np.sin(2.0 * np.pi * np.arange(N) / 47.3)
GOOD = {**dict.fromkeys(RATIOS, 2.0), "periodic_load": 1.0}


def assess(ratios=RATIOS, probability=0.1, *, step=0.01, spikes=0.0, oscillating=True, controller=None, **changes):
    valve = make_identification(likelihood_ratios=ratios, **changes)
    wave = make_oscillation(oscillating=oscillating)
    return assess_causes(
        valve, controller or make_controller(), wave, probability, pv_step_share=step, spike_share=spikes
    )


def main(causes):
    return {name for name in CAUSES if getattr(causes, name) >= 0.5}


def test_a_sticky_valve_drives_the_loop():
    causes = assess(probability=0.97)
    assert (causes.valve, main(causes), causes.main) == (0.97, {"valve"}, "valve")


def test_nothing_drives_a_loop_that_does_not_oscillate():
    causes = assess({**GOOD, "periodic_load": -300.0}, 0.97, oscillating=False)
    assert causes.main == "none"
    assert (causes.valve, causes.tuning, causes.external) == (0.0, 0.0, 0.0)


def test_tuning_at_the_limit_of_stability():
    process = ProcessFit(0.05, 0.0, 15.0, True)
    both = {"process": process, "linear": process}
    limit = make_controller(math.pi / (2.0 * 0.05 * 15.0), math.inf, Ki=0.0, form="P")
    assert main(assess(GOOD, 0.02, controller=limit, **both)) == {"tuning"}
    slow = replace(limit, Kc=0.05 * limit.Kc)
    assert assess(GOOD, 0.02, controller=slow, **both).tuning < 0.15


def test_the_process_behind_the_more_likely_valve_counts():
    """An oscillation of a sticky valve makes the process behind a good valve look unstable."""
    stable, limit = ProcessFit(0.005, 0.0, 15.0, True), make_controller(math.pi / 1.5, math.inf, Ki=0.0, form="P")
    unstable = ProcessFit(0.05, 0.0, 15.0, True)
    assert assess(GOOD, 0.95, controller=limit, process=stable, linear=unstable).tuning < 0.2
    assert assess(GOOD, 0.05, controller=limit, process=stable, linear=unstable).tuning > 0.8


def test_a_small_prior_is_no_evidence_of_tight_tuning_or_of_a_load():
    process, limit = ProcessFit(0.05, 0.0, 15.0, True), make_controller(math.pi / 1.5, math.inf, Ki=0.0, form="P")
    stable, clear = ProcessFit(0.005, 0.0, 15.0, True), {**dict.fromkeys(RATIOS, 700.0), "deadband": 5.0}
    causes = assess(clear, 0.1, controller=limit, process=stable, linear=process)
    assert (main(causes), causes.valve) == (set(), 0.1)
    assert assess(clear, 0.1, controller=limit, process=process, linear=process).main == "tuning"


def test_a_load_makes_the_sensitivity_uncertain():
    process, limit = ProcessFit(0.05, 0.0, 15.0, True), make_controller(math.pi / 1.5, math.inf, Ki=0.0, form="P")
    driven = {**GOOD, "good": 50.0, "periodic_load": -300.0}
    causes = assess(driven, 0.1, controller=limit, process=process, linear=process)
    assert main(causes) == {"external"}


def test_a_load_that_explains_more_than_the_valve():
    assert main(assess({**GOOD, "good": 100.0, "periodic_load": -300.0})) == {"external"}
    assert main(assess({**GOOD, "good": 100.0, "relay_load": -300.0})) == {"external"}


def test_a_sticky_valve_beside_a_load():
    """The load is found by comparing the sticky valve with it and without it: 560 - 120 here."""
    causes = assess({**RATIOS, "good": 900.0, "beside_periodic_load": 560.0}, 0.97)
    assert main(causes) == {"valve", "external"}
    assert main(assess({**RATIOS, "good": 900.0}, 0.97)) == {"valve"}


def test_an_oscillation_without_any_other_cause_comes_from_outside():
    assert main(assess(GOOD, 0.02)) == {"external"}


@pytest.mark.parametrize("sign", [{"step": 0.5}, {"spikes": 0.05}])
def test_the_sensor(sign):
    assert "sensor" in main(assess(GOOD, 0.1, **sign))
    assert assess(GOOD, 0.1).sensor < 0.05


def test_a_coarse_pv_is_not_taken_for_a_dead_zone():
    zone, ratios = make_zone(likelihood_ratio=300.0), {**GOOD, "good": 150.0, "periodic_load": 100.0}
    fine, coarse = (assess(ratios, 0.1, step=step, dead_zone=zone) for step in (0.01, 0.5))
    assert fine.dead_zone > 0.9
    assert coarse.dead_zone < 0.05 < 0.5 < coarse.sensor


@pytest.mark.parametrize(
    ("changes", "good", "load", "expected"),
    [
        ({"likelihood_ratio": 300.0}, 150.0, 100.0, True),  # far better than a good valve and than a sticky one
        ({"likelihood_ratio": 15.0}, 5.0, 10.0, False),  # no more than chance
        ({"likelihood_ratio": 300.0}, 400.0, 380.0, False),  # the band moves with the stem
        ({"likelihood_ratio": 300.0}, 100.0, -400.0, False),  # a load explains more
        ({"likelihood_ratio": 300.0}, 100.0, math.inf, True),
        ({"likelihood_ratio": 9.0, "op_reversals": 1}, 29.0, math.inf, True),  # crossed once: both explanations fit
        ({"likelihood_ratio": 9.0, "op_reversals": 20}, 29.0, math.inf, False),
        ({"likelihood_ratio": 2.0, "op_reversals": 1}, 3.0, 3.0, False),
    ],
)
def test_dead_zone(changes, good, load, expected):
    score = dead_zone_score(make_zone(**changes), good, load)
    assert (score > 0.9) if expected else (score < 0.1)


def test_scores_of_tuning_rise_with_sensitivity():
    scores = [tuning_score(x) for x in (0.5, 1.0, 2.0, 4.0, 8.0, 100.0)]
    assert (np.diff(scores) > 0.0).all()
    assert tuning_score(math.nan) == tuning_score(0.0) == 0.0


def test_json():
    assert list(assess().to_dict()) == ["valve", "tuning", "external", "sensor", "dead_zone"]


def simulate(valve, *, Kc=0.25, load=None, noise=0.1, random=0.6):
    """A PI loop about a lag of 10 s with a dead time of 5 s and gain 2, moved by a random load and set-point steps."""
    loop = st.Loop(st.PID(Kc, 10.0), valve, st.FOPDT(2.0, 10.0, 5.0), dt=1.0, noise=noise)
    rng = np.random.default_rng(1)
    upsets = np.convolve(rng.normal(0.0, random, N), np.ones(8) / 8.0, mode="same")
    total = upsets if load is None else upsets + load
    start = np.where(np.arange(N) < 40, 4.0, 0.0)  # without it a sticky valve would stay at rest
    run = st.simulate(loop, sp=start, duration=float(N), disturbance=total, seed=1)
    return replace(run, op=run.op + 50.0)


def test_simulated_loop_near_the_limit_of_stability():
    """With the integral time at the lag T = 10 s the limit is Kc = pi T / (2 K L) = pi / 2."""
    causes = st.diagnose(simulate(st.Ideal(), Kc=0.8 * math.pi / 2.0)).oscillation_cause
    assert causes.tuning > 0.5
    assert causes.tuning > causes.external


def test_simulated_load_from_outside():
    causes = st.diagnose(simulate(st.Ideal(), load=3.0 * np.sign(WAVE))).oscillation_cause
    assert causes.external > 0.5
    assert causes.tuning < 0.5


def test_simulated_sticky_valve():
    found = st.diagnose(simulate(st.Kano(5.0, 2.0), random=0.1))
    assert found.oscillation_cause.main == "valve"


def test_simulated_sticky_valve_beside_a_load():
    found = st.diagnose(simulate(st.Kano(5.0, 2.5), load=1.5 * WAVE))
    assert found.verdict == "stiction"
    assert {"valve", "external"} <= main(found.oscillation_cause)
    assert "something else affects the loop too" in found.reason


def test_simulated_coarse_transmitter():
    record = simulate(st.Ideal(), load=0.4 * WAVE)
    assert record.pv is not None
    step = 0.5 * float(np.ptp(record.pv))
    assert st.diagnose(replace(record, pv=np.round(record.pv / step) * step)).oscillation_cause.sensor >= 0.5
