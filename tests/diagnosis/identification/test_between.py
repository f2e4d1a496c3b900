"""The sample between two samples, rebuilt of simulated loops of which it is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import stiction as st
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


def off(one, other):
    return float(np.sqrt(np.nanmean((one - other) ** 2)))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("noise", [0.02, 0.2])
def test_a_controller_that_runs_twice_a_sample_is_rebuilt_noise_and_all(form, noise):
    full = run(FORMS[form], noise)
    rebuilt = with_samples_between(sampled(full, 2.0))
    n = len(rebuilt)
    assert rebuilt.dt == full.dt
    assert rebuilt.sp is None
    np.testing.assert_array_equal(rebuilt.pv[::2], full.pv[:n:2])
    np.testing.assert_array_equal(rebuilt.op[::2], full.op[:n:2])
    # Of the noise of which nothing was recorded a tenth is left, and of OP's the same.
    assert off(rebuilt.pv, full.pv[:n]) < 0.1 * noise
    assert off(rebuilt.op, full.op[:n]) < 0.1 * noise * (FORMS[form].Kc + FORMS[form].Kc / FORMS[form].Ti)


@pytest.mark.parametrize("m", [3, 5, 8])
def test_of_several_samples_between_it_tells_where_they_were(m):
    # Nearer to their mean than a cubic through the recorded samples, which knows nothing of them.
    full = run(FORMS["PI"], noise=0.05, samples=3200, every=1600)
    slower = sampled(full, float(m))
    rebuilt = with_samples_between(slower)
    pv = slower.pv
    between = np.stack([full.pv[j : j + m * (pv.size - 1) : m] for j in range(1, m)]).mean(axis=0)
    cubic = (9.0 * (pv[1:-2] + pv[2:-1]) - pv[:-3] - pv[3:]) / 16.0
    told, drawn = rebuilt.pv[3:-3:2] - between[1:-1], cubic - between[1:-1]
    assert np.corrcoef(between[1:-1] - cubic, rebuilt.pv[3:-3:2] - cubic)[0, 1] > 0.5
    assert np.isfinite(told).all()
    assert abs(told.mean()) < 0.1 * drawn.std()


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


@pytest.mark.parametrize("name", sorted(KNOWN))
def test_a_valve_is_found_as_if_all_had_been_recorded(name):
    known = KNOWN[name]
    full = replace(run_of(known, 0.02, samples=2000), mv=None)
    slower = sampled(full, 2.0 * full.dt)
    found, whole = (st.identify(one, period=known.period) for one in (slower, full))
    assert found.rebuilt
    assert not found.own_samples
    assert found.to_dict()["rebuilt"]
    assert not whole.rebuilt
    assert found.S == pytest.approx(known.S, rel=0.05)
    assert found.S_low <= known.S <= found.S_high
    assert found.beats_good > 0.5 * whole.beats_good > 2.0
    assert found.mv.size == found.pv.size == len(slower)
    assert found.stretches[-1].last <= len(slower)
    assert "rebuilt by the controller's integral" in found.reason
