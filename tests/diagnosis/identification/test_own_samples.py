"""A record shows the controller's own samples, or OP moved between them: known of simulated loops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identification.controller import _between, fit_controller
from stiction.diagnosis.identification.controller_forms import best_form, moves
from stiction.diagnosis.identification.own_samples import are_own_samples, shows_own_samples
from stiction.simulation.historian import averaged, interpolated, sampled

from .loops import KNOWN, run_of

CONTROLLERS = {
    "P": st.PID(0.4, np.inf),
    "PI": st.PID(0.4, 5.0),
    "PID": st.PID(0.3, 8.0, 1.5, N=4.0),
    "PI-D": st.PID(0.3, 8.0, 1.5, N=4.0, c=0.0),
}


def run(controller, noise=0.1, samples=900):
    """A loop whose SP steps, so that OP moves under each form."""
    loop = st.Loop(controller, st.Kano(3.0, 1.0), st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=noise)
    sp = 5.0 * (np.arange(samples) // 90 % 2)
    return replace(st.simulate(loop, sp, float(samples), seed=5), mv=None)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_linear_controller_is_seen_at_its_own_rate(name):
    assert shows_own_samples(run(CONTROLLERS[name]))


@pytest.mark.parametrize("name", [name for name in CONTROLLERS if name != "P"])
def test_what_a_slower_historian_gives_back_is_not_the_controllers_own(name):
    # A controller without a memory obeys its equation at every rate.
    record = run(CONTROLLERS[name])
    for slower in (sampled(record, 2.0), sampled(record, 5.0), averaged(record, 2.0), interpolated(record, 2.0)):
        assert not shows_own_samples(slower)


@pytest.mark.parametrize(("gain", "offset"), [(1e6, 3e5), (1e-6, 0.0), (-2.0, 400.0)])
def test_the_unit_of_the_pv_does_not_matter(gain, offset):
    record = run(CONTROLLERS["PID"])
    for one, own in ((record, True), (sampled(record, 2.0), False)):
        assert shows_own_samples(replace(one, pv=gain * one.pv + offset, sp=gain * one.sp + offset)) is own


def test_bumps_and_missing_samples_do_not_hide_it_but_many_do():
    record = run(CONTROLLERS["PID"])
    rng = np.random.default_rng(2)
    op = record.op.copy()
    op[rng.choice(op.size, 8, replace=False)] = np.nan
    op[400:] += 2.0
    assert shows_own_samples(replace(record, op=op))
    often = record.op + 0.5 * (rng.random(op.size) < 0.3)
    assert not shows_own_samples(replace(record, op=often))


def test_a_short_record_says_nothing():
    assert not shows_own_samples(run(CONTROLLERS["PI"]).window(0, 20))


def rounded(record, digits):
    """A record as a historian exports it, to so many decimals."""
    return replace(record, op=record.op.round(digits), pv=record.pv.round(digits), sp=record.sp.round(digits))


def slow_integral(samples=2400):
    """A loop whose controller hardly integrates: a historian's means of it obey nearly the same equation."""
    known = KNOWN["reverse gain, every 5 s"]
    loop = replace(known.loop, controller=replace(known.loop.controller, Ti=5e3))
    record = replace(run_of(replace(known, loop=loop), 0.02, 0.5, samples=samples), mv=None)
    return known, record


def test_means_of_a_controller_that_hardly_integrates_are_not_taken_for_its_own_samples():
    known, record = slow_integral()
    means = averaged(record, 2.0 * record.dt)
    assert fit_controller(means).exact
    assert not st.identify(means, period=known.period).own_samples
    assert st.identify(record, period=known.period).own_samples


def test_an_OP_often_at_its_limit_shows_the_controllers_own_samples_by_the_moves_between():
    record = run(replace(CONTROLLERS["PI"], op_limits=(0.0, 5.0)), noise=0.2)
    assert not shows_own_samples(record)
    assert are_own_samples(record, fit_controller(record))


@pytest.mark.parametrize("digits", [2, 3, 4])
def test_rounded_samples_are_still_the_controllers_own(digits):
    record = rounded(run(CONTROLLERS["PI"], noise=0.5), digits)
    assert not shows_own_samples(record)
    assert are_own_samples(record, fit_controller(record))


@pytest.mark.parametrize("digits", [1, 2, 3, 4])
@pytest.mark.parametrize("noise", [0.002, 0.02, 0.5])
@pytest.mark.parametrize("m", [2, 3])
def test_a_slower_record_is_not_the_controllers_own_however_it_is_rounded(m, noise, digits):
    record = rounded(sampled(run(CONTROLLERS["PI"], noise=noise, samples=1800), float(m)), digits)
    assert not are_own_samples(record, fit_controller(record))


@pytest.mark.parametrize("digits", [1, 2])
def test_rounding_that_would_hide_the_samples_between_leaves_it_open(digits):
    known, record = slow_integral()
    blunt = rounded(record, digits)
    found = fit_controller(blunt)
    assert found.exact
    assert not are_own_samples(blunt, found)
    assert "Whether OP moves between the samples cannot be told" in st.identify(blunt, period=known.period).reason
    slower = sampled(run(CONTROLLERS["PID"]), 3.0)
    assert "OP between the samples is not recorded" in st.identify(slower, period=40.0).reason


@pytest.mark.parametrize(("sums", "low", "high"), [(0, 0.24, 0.26), (1, 1.25, 1.4), (2, 1.0, 4.0)])
def test_what_the_samples_between_leave_is_what_a_slower_record_leaves(sums, low, high):
    # The derivation in docs/controller.md, on errors that are not of any loop: noise, a walk and the integral of one.
    # Of noise a quarter, since the fit sees half of Ki: every second error.
    rng, controller = np.random.default_rng(3), st.PID(0.4, 5.0)
    pv = rng.normal(size=40_000)
    for _ in range(sums):
        pv = np.cumsum(pv - pv.mean())
    op = 50.0 - controller.Kc * pv - controller.Kc / controller.Ti * np.cumsum(pv)
    slower = st.LoopRecord("FC1", 2.0, op=op[::2], pv=pv[::2])
    error = pv.mean() - slower.pv
    data = moves(slower.op, error, slower.pv, np.ones(error.size, dtype=bool), slower.dt, 0.0)
    left = data.unexplained(False)
    law = best_form(data, False, 0.0, slower.dt, exact=True).weights
    assert low < _between(law, slower.dt, slower.pv, 0.0) / np.mean(left**2) < high


@pytest.mark.parametrize("digits", [2, 3])
def test_samples_between_that_their_neighbours_tell_leave_it_open(digits):
    # A PI law with other weights explains a sine at every rate, to the rounding.
    t = np.arange(3000.0)
    pv = np.sin(0.5 * t)
    op = 50.0 - 0.4 * pv - 0.08 * np.cumsum(pv)
    found = fit_controller(st.LoopRecord("FC1", 2.0, op=op[::2].round(digits), pv=pv[::2].round(digits)))
    assert found.exact
    assert not found.own_samples


def test_a_filtered_derivative_leaves_the_interval_narrow():
    # The fit of the controller knows no filter, and takes the record for a slower one: S could then be a ninth. Down to
    # 0.85 of it a lag of the actuator explains the record as well.
    known = KNOWN["first order"]
    loop = replace(known.loop, controller=replace(known.loop.controller, Td=1.0, N=5.0))
    record = replace(run_of(replace(known, loop=loop), 0.1, samples=1800), mv=None)
    assert not fit_controller(record).exact
    found = st.identify(record, period=known.period)
    assert 0.8 * known.S < found.S_low <= known.S <= found.S_high < 1.1 * known.S


def test_a_set_point_that_was_not_recorded_leaves_it_open_and_S_as_it_is():
    loop = st.Loop(st.PID(2.0, 20.0), st.Kano(4.0, 2.0), st.FOPDT(1.2, 12.0, 4.0), dt=1.0, noise=0.25)
    sp = 50.0 + np.convolve(np.random.default_rng(1).normal(size=2000), np.ones(60) / 8.0, "same")[:1800]
    record = replace(st.simulate(loop, sp, 1800.0, seed=1, pv_start=50.0, op_start=50.0), mv=None)
    known, unknown = st.identify(record), st.identify(replace(record, sp=None))
    assert known.own_samples
    assert not unknown.own_samples
    assert "Whether OP moves between the samples cannot be told" in unknown.reason
    # OP's noise, 0.5 % of span, would make S of a record known to be slower larger by a tenth.
    assert pytest.approx(4.0, rel=0.03) == known.S
    assert pytest.approx(4.0, rel=0.03) == unknown.S
    assert unknown.S_low < 3.2 < 5.0 < unknown.S_high
