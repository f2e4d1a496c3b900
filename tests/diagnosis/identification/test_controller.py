"""The controller from OP and error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.strategies import booleans, floats

import stiction as st
from stiction.diagnosis.identification import fit_controller
from stiction.errors import RecordError

from .loops import KNOWN, run_of, whole_segment


def fit_whole(record):
    return fit_controller(whole_segment(record))


@pytest.mark.parametrize("moves", [0.0, 0.3])
@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("name", KNOWN)
def test_a_pi_is_found_exactly(name, noise, moves):
    # The controller acts on the noisy PV, so that noise does not bias the fit.
    known = KNOWN[name]
    found = fit_whole(run_of(known, noise, moves, samples=600))
    assert found.Kc == pytest.approx(known.loop.controller.Kc, rel=1e-6)
    assert found.Ti == pytest.approx(known.loop.controller.Ti, rel=1e-6)
    assert found.explained == pytest.approx(1.0, abs=1e-9)
    assert found.action == np.sign(known.gain)


@pytest.mark.parametrize("name", KNOWN)
def test_without_a_set_point_a_constant_one_is_found_too(name):
    known = KNOWN[name]
    found = fit_whole(replace(run_of(known, 0.02), sp=None))
    assert found.Kc == pytest.approx(known.loop.controller.Kc, rel=1e-6)
    assert found.Ti == pytest.approx(known.loop.controller.Ti, rel=1e-6)


def test_gaps_hardly_matter():
    run = run_of(KNOWN["first order"], 0.02)
    pv, op = run.pv.copy(), run.op.copy()
    pv[200:203], op[500:502] = np.nan, np.nan
    found = fit_whole(replace(run, pv=pv, op=op))
    assert found.Kc == pytest.approx(0.4, rel=0.1)
    assert found.Ti == pytest.approx(5.0, rel=0.1)
    assert found.action == 1.0


def test_an_op_that_nobody_controls_tells_no_action():
    rng = np.random.default_rng(5)
    record = st.LoopRecord("FC1", 1.0, op=50.0 + rng.normal(size=500), pv=rng.normal(size=500))
    found = fit_whole(record)
    assert found.explained < 0.1
    assert found.action == 0.0


FORMS = {
    "PI": st.PID(0.5, 15.0),
    "P": st.PID(2.0, np.inf),
    "PID": st.PID(0.5, 15.0, 3.0),
    "I-P": st.PID(0.5, 15.0, b=0.0),
    "PI-D": st.PID(0.5, 15.0, 3.0, c=0.0),
    "I-PD": st.PID(0.5, 15.0, 3.0, b=0.0, c=0.0),
}


def swinging(controller, n=3000, moves=2.0, noise=0.3, seed=1):
    """A sticky loop under a wandering load and a moving set point."""
    loop = st.Loop(controller, st.Kano(3.0, 1.0), st.FOPDT(1.2, 20.0, 4.0), dt=1.0, noise=noise)
    rng = np.random.default_rng(seed)
    sp = 100.0 + moves * np.repeat(rng.uniform(-1.0, 1.0, n // 50 + 1), 50)[:n]
    load = np.cumsum(rng.normal(0.0, 0.3, n))
    load -= np.linspace(0.0, load[-1], n)
    return st.simulate(loop, sp, float(n), load, seed, pv_start=100.0, op_start=50.0)


def every(record, m):
    """What a historian keeps that samples m times slower."""
    return replace(record, dt=m * record.dt, op=record.op[::m], pv=record.pv[::m], sp=record.sp[::m], mv=None)


def holds(found, controller, gain, time):
    assert found.Kc == pytest.approx(controller.Kc, rel=gain)
    assert found.Ti == pytest.approx(controller.Ti, rel=time)
    assert found.action == 1.0


@pytest.mark.parametrize("name", FORMS)
def test_the_form_is_found_at_the_controllers_rate(name):
    found = fit_whole(swinging(FORMS[name]))
    holds(found, FORMS[name], 1e-6, 1e-6)
    assert found.form == name
    assert found.Td == pytest.approx(FORMS[name].Td, rel=1e-6)


@pytest.mark.parametrize("step", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("name", FORMS)
def test_a_rounded_op_is_compared_itself(name, step):
    run = swinging(FORMS[name])
    found = fit_whole(replace(run, op=np.round(run.op / step) * step))
    holds(found, FORMS[name], 0.02, 0.05)
    assert found.form == name
    assert "OP itself" in found.why


@pytest.mark.parametrize("m", [2, 3])
@pytest.mark.parametrize("noise", [0.02, 0.3])
@pytest.mark.parametrize("name", FORMS)
def test_slower_sampling_costs_some_accuracy(name, noise, m):
    found = fit_whole(every(swinging(FORMS[name], noise=noise), m))
    holds(found, FORMS[name], 0.15, 0.15)
    assert found.form == name


def test_an_integral_controller_has_no_gain():
    found = fit_whole(swinging(st.PID(1e-9, 4e-8)))
    assert found.form == "I"
    assert found.Ki == pytest.approx(0.025, rel=1e-6)
    assert (found.Kc, found.Ti, found.action) == (0.0, 0.0, 1.0)


def test_samples_at_a_limit_are_left_out():
    controller = st.PID(0.5, 15.0, op_limits=(46.0, 54.0))
    run = swinging(controller, moves=4.0)
    at_limit = (run.op >= 54.0) | (run.op <= 46.0)
    assert 0.2 < at_limit.mean() < 0.8
    found = fit_whole(run)
    holds(found, controller, 1e-6, 1e-6)
    assert f"{at_limit.sum()} samples at a limit" in found.why


def test_gaps_are_not_bridged_and_bumps_not_explained():
    run = swinging(FORMS["PI"])
    op, pv = run.op.copy(), run.pv.copy()
    op[1500:] += 7.0
    op[2200:] -= 3.0
    op[300:340], pv[900:1100] = np.nan, np.nan
    found = fit_whole(replace(run, op=op, pv=pv))
    holds(found, FORMS["PI"], 1e-6, 1e-6)
    assert "2 bumps" in found.why


def test_manual_is_left_out():
    run = swinging(FORMS["PI"])
    op, auto = run.op.copy(), np.ones(len(run), dtype=bool)
    op[1000:1800], auto[1000:1800] = np.random.default_rng(0).normal(50.0, 5.0, 800), False
    holds(fit_whole(replace(run, op=op, auto=auto)), FORMS["PI"], 1e-6, 1e-6)
    assert fit_whole(replace(run, auto=np.zeros(len(run), dtype=bool))).form == "unknown"


def test_errors_cover_the_truth_of_a_rounded_op():
    # Independent roundings: in about 95 of 100 the truth lies within two standard errors.
    far = []
    for seed in range(40):
        run = swinging(FORMS["PI"], n=1000, seed=seed)
        found = fit_whole(replace(run, op=np.round(run.op, 0)))
        far.append((abs(found.Kc - 0.5) / found.Kc_error, abs(found.Ti - 15.0) / found.Ti_error))
    within = np.mean(np.array(far) < 2.0, axis=0)
    assert np.all(within >= 0.8)
    assert np.median(far) > 0.2


def test_an_unexplained_op_names_no_form():
    rng = np.random.default_rng(5)
    found = fit_whole(st.LoopRecord("FC1", 1.0, op=50.0 + rng.normal(size=500), pv=rng.normal(size=500)))
    assert found.form == "unknown"
    assert "needed" in found.why
    still = fit_whole(st.LoopRecord("FC1", 1.0, op=np.full(500, 50.0), pv=rng.normal(size=500)))
    assert (still.form, still.action) == ("unknown", 0.0)


def test_a_record_without_pv_is_refused():
    with pytest.raises(RecordError, match="no PV"):
        fit_whole(st.LoopRecord("FC1", 1.0, op=np.arange(100.0)))


RUN = swinging(FORMS["I-P"], n=800)


@settings(deadline=None, max_examples=30)
@given(
    scale=floats(0.01, 100.0),
    shift=floats(-1000.0, 1000.0),
    op_scale=floats(0.01, 10.0),
    clock=floats(0.001, 60.0),
    flip=booleans(),
)
def test_units_only_rescale_the_answer(scale, shift, op_scale, clock, flip):
    scale = -scale if flip else scale
    found = fit_whole(
        replace(RUN, dt=RUN.dt * clock, op=op_scale * RUN.op, pv=scale * RUN.pv + shift, sp=scale * RUN.sp + shift)
    )
    assert found.form == "I-P"
    assert found.Kc == pytest.approx(0.5 * op_scale / scale, rel=1e-4)
    assert found.Ti == pytest.approx(15.0 * clock, rel=1e-4)
    assert found.action == np.sign(scale)


def test_a_set_point_that_was_not_recorded_turns_no_sign():
    """OP and PV that follow it together look like a P controller of the wrong sign."""
    sp = 50.0 + np.repeat(np.random.default_rng(0).uniform(-10.0, 10.0, 40), 50)
    loop = st.Loop(st.PID(0.3, 4.0), st.Kano(2.0, 1.0), st.FOPDT(1.0, 3.0, 0.0), dt=1.0, noise=0.1)
    run = st.simulate(loop, sp, 2000.0, seed=1)
    assert fit_whole(run).action == 1.0
    unseen = fit_whole(replace(run, sp=None))
    assert (unseen.form, unseen.action) == ("unknown", 0.0)
    assert "was not recorded" in unseen.why
    still = st.simulate(replace(loop, controller=st.PID(0.3, np.inf)), 50.0, 2000.0, 6.0 * (sp > 50.0), seed=1)
    assert fit_whole(replace(still, sp=None)).form == "P"
