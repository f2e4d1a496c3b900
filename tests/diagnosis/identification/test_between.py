"""The sample between two samples, rebuilt of simulated loops of which it is known."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import stiction as st
from stiction.diagnosis.identification import closer
from stiction.diagnosis.identification.between import with_samples_between
from stiction.simulation.historian import interpolated, sampled

from .loops import KNOWN, run_of

SLOWER = sampled(run_of(KNOWN["first order"], 0.02, samples=2000), 2.0)
FORMS = {
    "PI": st.PID(0.4, 5.0),
    "I-P": st.PID(0.4, 5.0, b=0.0),
    "integral updated after OP": st.PID(0.4, 5.0, integral="forward"),
    "hardly proportional": st.PID(0.05, 1.0),
}


def run(controller, noise=0.1, samples=1600, every=90):
    """A loop whose SP steps now and then, always where a sample is kept."""
    loop = st.Loop(controller, st.Kano(3.0, 1.0), st.FOPDT(1.2, 8.0, 3.0), dt=1.0, noise=noise)
    sp = 5.0 * (np.arange(samples) // every % 2)
    return replace(st.simulate(loop, sp, float(samples), seed=5), mv=None)


def cubic(x):
    """Halfway between each two samples but the first and the last, from those on either side."""
    return (9.0 * (x[1:-2] + x[2:-1]) - x[:-3] - x[3:]) / 16.0


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("noise", [0.02, 0.2])
def test_a_controller_that_runs_twice_a_sample_is_rebuilt_noise_and_all(form, noise):
    full = run(FORMS[form], noise)
    slower = sampled(full, 2.0)
    rebuilt = with_samples_between(slower)
    n = len(rebuilt)
    assert rebuilt.dt == full.dt
    assert rebuilt.sp is None
    # Of what a cubic through the recorded samples leaves a quarter is left, where the set point does not step between.
    calm = np.convolve(np.diff(slower.sp) != 0.0, np.ones(3), "same")[1:-1] == 0.0
    for name in ("op", "pv"):
        told, true, kept = (getattr(one, name) for one in (rebuilt, full, slower))
        np.testing.assert_array_equal(told[::2], true[:n:2])
        between = true[3 : n - 2 : 2]
        left, drawn = told[3:-2:2] - between, cubic(kept) - between
        assert left[calm].std() < 0.25 * drawn[calm].std()


@pytest.mark.parametrize("m", [3, 5, 8])
def test_of_several_samples_between_it_tells_where_they_were(m):
    # Where their mean lies off the cubic through the recorded samples it lies off it too.
    full = replace(run_of(KNOWN["first order"], 0.02, samples=6000), mv=None)
    slower = sampled(full, float(m))
    rebuilt = with_samples_between(slower)
    pv = slower.pv
    between = np.stack([full.pv[j : j + m * (pv.size - 1) : m] for j in range(1, m)]).mean(axis=0)[1:-1]
    told, drawn = rebuilt.pv[3:-3:2], cubic(pv)
    assert np.corrcoef(between - drawn, told - drawn)[0, 1] > 0.5
    assert abs(told.mean() - between.mean()) < 0.1 * (drawn - between).std()


def test_units_and_offsets_do_not_matter():
    rebuilt = with_samples_between(SLOWER)
    for gain, offset in ((1e6, 3e5), (1e-6, 0.0), (-2.0, 400.0)):
        other = with_samples_between(replace(SLOWER, pv=gain * SLOWER.pv + offset, sp=gain * SLOWER.sp + offset))
        np.testing.assert_allclose((other.pv - offset) / gain, rebuilt.pv, rtol=1e-7)
        np.testing.assert_allclose(other.op, rebuilt.op, rtol=1e-7)
    later = with_samples_between(replace(SLOWER, dt=60.0 * SLOWER.dt))
    assert later.dt == 60.0 * rebuilt.dt
    np.testing.assert_array_equal(later.pv, rebuilt.pv)


def test_without_a_set_point_a_constant_one_is_assumed():
    rebuilt = with_samples_between(replace(SLOWER, sp=None))
    np.testing.assert_allclose(rebuilt.pv, with_samples_between(SLOWER).pv, rtol=1e-9)


@pytest.mark.parametrize(
    "record",
    [
        pytest.param(run(FORMS["PI"]), id="the controller's own samples"),
        pytest.param(sampled(run(st.PID(0.3, 8.0, 1.5, N=4.0)), 2.0), id="a derivative part"),
        pytest.param(sampled(run(st.PID(0.4, np.inf)), 2.0), id="no integral"),
        pytest.param(interpolated(run(FORMS["PI"]), 6.0), id="drawn as lines"),
        pytest.param(replace(SLOWER, op=SLOWER.op.round(1)), id="rounded"),
        pytest.param(SLOWER.window(0, 90), id="too short"),
        pytest.param(replace(SLOWER, op=np.random.default_rng(1).normal(50.0, 1.0, len(SLOWER))), id="another OP"),
        pytest.param(replace(SLOWER, op=np.full(len(SLOWER), 50.0)), id="an OP that rests"),
    ],
)
def test_what_the_law_does_not_tell_is_not_rebuilt(record):
    assert with_samples_between(record) is None


def test_nothing_is_told_beside_what_is_missing_at_a_limit_or_in_manual():
    op, auto = SLOWER.op.copy(), np.ones(len(SLOWER), dtype=bool)
    op[100], auto[300:310] = np.nan, False
    rebuilt = with_samples_between(replace(SLOWER, op=op, auto=auto))
    missing = np.flatnonzero(np.isnan(rebuilt.pv))
    assert missing.tolist() == [199, 201, *range(599, 621, 2)]
    assert np.flatnonzero(np.isnan(rebuilt.op)).tolist() == [199, 200, 201, *range(599, 621, 2)]
    limited = np.clip(SLOWER.op, None, np.quantile(SLOWER.op, 0.9))
    held = np.flatnonzero(limited == limited.max())
    rebuilt = with_samples_between(replace(SLOWER, op=limited))
    assert np.isnan(rebuilt.pv[2 * held[held < len(SLOWER) - 1] + 1]).all()


def test_a_valve_is_found_nearly_as_if_all_had_been_recorded(monkeypatch):
    errors, without = [], []
    for name, seed in product(sorted(KNOWN), range(3)):
        known = KNOWN[name]
        slower = sampled(replace(run_of(known, 0.02, samples=2000, seed=seed), mv=None), 2.0 * known.loop.dt)
        found = st.identify(slower, period=known.period)
        assert found.rebuilt
        assert found.S_low <= known.S <= found.S_high
        errors.append(abs(found.S / known.S - 1.0))
        with monkeypatch.context() as as_recorded:
            as_recorded.setattr(closer, "with_samples_between", lambda _: None)
            without.append(abs(st.identify(slower, period=known.period).S / known.S - 1.0))
    assert np.median(errors) < 0.015
    assert np.median(without) > 0.03


def test_what_is_told_of_the_valve_is_of_the_record():
    known = KNOWN["first order"]
    found = st.identify(replace(SLOWER, mv=None), period=known.period)
    assert found.rebuilt
    assert found.to_dict()["rebuilt"]
    assert not found.own_samples
    assert "rebuilt by the controller's integral" in found.reason
    assert found.mv.size == found.pv.size == len(SLOWER)
    assert [one.last for one in found.stretches][-1] <= len(SLOWER)
    # The stem that is told is half the way of Kano's behind OP at most, sample by sample of the record.
    assert np.abs(found.mv - SLOWER.op).max() <= 0.5 * (found.S + found.J) * 1.05


def test_the_verdict_is_weighed_by_the_recorded_samples(monkeypatch):
    """The search begins with the samples between; what its valve is worth is counted on those recorded."""
    record = replace(SLOWER, mv=None, loop_type="flow")
    found = st.diagnose(record)
    assert found.identification.rebuilt
    monkeypatch.setattr(closer, "with_samples_between", lambda _: None)
    alone = st.diagnose(record)
    assert not alone.identification.rebuilt
    assert found.causes == pytest.approx(alone.causes, abs=0.01)
    valve, recorded = found.identification, alone.identification
    assert valve.likelier_in_part == pytest.approx(recorded.likelier_in_part, rel=0.1)
    for name in ("good", "bent"):
        assert valve.over(name) == pytest.approx(recorded.over(name), rel=0.1)
