"""A loop in automatic is no valve test: its OP reacts to PV, and what is read from it has no meaning."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.valvetests.feedback_check import FEEDBACK_CORRELATION, noise_correlation
from stiction.valvetests.ramp_verdict import ramp_verdict
from stiction.valvetests.result import Estimate

STICKY, GOOD = st.Kano(S=6.0, J=2.0), st.Kano(S=0.3, J=0.1)


def closed_loop(valve, noise: float, gain: float = 3.0) -> st.LoopRecord:
    """A flow loop in automatic, half an hour long; the stem was not recorded."""
    loop = st.Loop(st.PID(0.2 * math.copysign(1.0, gain), 10.0), valve, st.FOPDT(gain, 10.0, 10.0), 1.0, noise=noise)
    sp = 50.0 * gain
    return replace(st.simulate(loop, sp, 1800.0, seed=3, pv_start=sp - 2.0, op_start=50.0), mv=None)


@pytest.mark.parametrize("gain", [3.0, -3.0])
@pytest.mark.parametrize("noise", [0.05, 1.0])
@pytest.mark.parametrize("valve", [STICKY, GOOD], ids=["sticky", "good"])
def test_a_controller_passes_the_noise_on(valve, noise, gain):
    # The proportional part turns the noise of PV into noise of OP, -Kc times as large: a correlation of -1.
    record = closed_loop(valve, noise, gain)
    assert math.copysign(1.0, gain) * noise_correlation(record) < -0.9
    for analyse, remedy in ((st.analyse_ramp, "plan_ramp_test"), (st.analyse_steps, "plan_step_test")):
        with pytest.raises(st.RecordError, match=rf"reacts to PV .*correlation .*automatic.*{remedy}.*diagnose"):
            analyse(record)


@pytest.mark.parametrize("plan", [st.plan_ramp_test(30.0, 60.0, rates=[0.2, 0.05]), st.plan_step_test(50.0, hold=5.0)])
@pytest.mark.parametrize("digits", [9, 1])
@pytest.mark.parametrize("op_noise", [0.0, 0.05])
def test_a_test_in_manual_does_not_react(plan, digits, op_noise):
    chance = np.random.default_rng(1)
    for valve in (STICKY, GOOD, st.Ideal()):
        record = st.stroke(valve, plan.op, plan.dt)
        op = np.round(plan.op + op_noise * chance.standard_normal(len(record)), digits)
        pv = 50.0 + 2.0 * (record.mv + 0.05 * chance.standard_normal(len(record)))
        found = noise_correlation(replace(record, op=op, pv=pv))
        assert math.isnan(found) or abs(found) < FEEDBACK_CORRELATION


def test_what_cannot_show_a_reaction_shows_none():
    record = closed_loop(STICKY, 0.2)
    assert math.isnan(noise_correlation(replace(record, pv=None, mv=record.op)))
    assert math.isnan(noise_correlation(replace(record, pv=np.full(len(record), 150.0))))
    lost = record.pv.copy()
    lost[::2] = np.nan
    assert math.isnan(noise_correlation(replace(record, pv=lost)))


@pytest.mark.parametrize(("S", "J", "seed"), [(6.0, 2.0, 1), (6.0, 2.0, 2), (1.5, 0.2, 1)])
def test_a_reading_below_zero_is_no_verdict(S, J, seed):
    # An OP rounded to 0.1 % hides the noise of 0.006 %: the loop looks as if it were given ramps.
    loop = st.Loop(st.PID(0.3, 5.0), st.Kano(S, J), st.FOPDT(1.0, 3.0, 1.0), 1.0, noise=0.02)
    record = st.simulate(loop, 50.0, 1800.0, seed=seed, pv_start=49.0, op_start=50.0)
    test = st.analyse_ramp(replace(record, mv=None, op=np.round(record.op, 1)))
    assert test.S.value < 0.0
    assert test.verdict == "undecided"
    assert "below 0" in test.reason
    assert "in manual" in test.reason


@pytest.mark.parametrize(
    ("sb", "sj", "S", "named"),
    [
        ((-1.52, -2.34, -0.54), (0.18, -0.16, 0.53), (-3.23, -5.07, -1.39), "S, deadband plus stickband, is -3.23 %"),
        ((-0.82, -1.1, -0.5), (0.1, 0.0, 0.2), (0.3, 0.1, 0.5), "sb is -0.82 %"),
        ((0.5, 0.4, 0.6), (-0.6, math.nan, math.nan), (0.4, 0.2, 0.6), "sj is -0.6 %"),
        ((math.nan,) * 3, (1.51, -7.4, 12.9), (math.nan,) * 3, "sj is 1.51 % (-7.4 to 12.9)"),
        ((0.3, -1.0, 1.6), (0.3, 0.2, 0.4), (0.3, -0.6, 0.9), "S, deadband plus stickband, is 0.3 % (-0.6 to 0.9)"),
    ],
)
def test_no_valve_has_a_band_below_zero(sb, sj, S, named):
    verdict, reason = ramp_verdict(Estimate(*sb), Estimate(*sj), Estimate(*S), 0.0, 1.0, "pv")
    assert verdict == "undecided"
    assert reason.startswith(named)


def test_noise_may_take_a_small_band_just_below_zero():
    jump = Estimate(-0.03, -0.13, 0.15)
    assert ramp_verdict(Estimate(0.15), jump, Estimate(0.33, 0.19, 0.48), 0.0, 1.0, "mv")[0] == "within limit"
    # A valve with play alone has a jump of 0, known the worse the larger its band is.
    jump = Estimate(0.3, -0.6, 0.75)
    assert ramp_verdict(Estimate(3.25, 3.05, 3.55), jump, Estimate(6.2, 5.3, 7.0), 0.0, 1.0, "mv")[0] == "beyond limit"


def test_a_flow_that_goes_against_the_steps_is_no_verdict():
    plan = st.plan_step_test(50.0)
    record = st.stroke(st.Ideal(), plan.op, plan.dt)
    elsewhere = 60.0 + np.cumsum(np.random.default_rng(2).standard_normal(len(record)))
    test = st.analyse_steps(replace(record, mv=None, pv=elsewhere))
    assert test.verdict == "undecided"
    assert "against the OP" in test.reason
