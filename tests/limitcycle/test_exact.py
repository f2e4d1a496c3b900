"""Exact cycles: independent numbers, an independent solver, laws that must hold, and the sampled simulation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from tests.limitcycle.twin import period_of_twin
from tests.reference import limitcycle as known

import stiction as st
from stiction.limitcycle import exact_limit_cycles, sampled_limit_cycles
from stiction.limitcycle.exact.packed_loop import pack_loop
from stiction.paper.fig7 import EXAMPLE_LOOP


@pytest.mark.parametrize(("family", "levels", "amplitude", "period", "pv"), known.PAPER_EXACT)
def test_paper_loop(family, levels, amplitude, period, pv):
    (cycle,) = [c for c in exact_limit_cycles(EXAMPLE_LOOP, families=[family]) if len(c.levels) == levels]
    assert cycle.amplitude == pytest.approx(amplitude, abs=1.1e-3)
    assert cycle.period == pytest.approx(period, rel=6e-4)
    assert cycle.stable
    assert max(abs(m) for m in cycle.multipliers) < 0.5
    if pv is not None:
        assert 2.0 * cycle.amplitude_pv == pytest.approx(pv, abs=1e-3)


def test_lattice_offset_makes_a_family():
    """A load of 0.3 on the paper's loop, whose levels stay at multiples of d from 0.25."""
    cycle = exact_limit_cycles(EXAMPLE_LOOP, disturbance=0.3, families=[0.25])[0]
    assert cycle.levels == pytest.approx((-0.75, -0.25, 0.25), abs=1e-9)
    assert cycle.amplitude == pytest.approx(0.774, abs=5e-4)
    assert cycle.period == pytest.approx(17.72, abs=0.01)


@pytest.mark.parametrize(("S", "J", "period", "op", "pv", "mv"), known.KANO_FOPDT)
def test_kano_with_a_lag_and_dead_time(S, J, period, op, pv, mv):
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(S, J), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    (cycle,) = exact_limit_cycles(loop, sp=10.0)
    assert cycle.period == pytest.approx(period, rel=1e-3)
    assert 2.0 * cycle.amplitude == pytest.approx(op, rel=2e-3)
    assert 2.0 * cycle.amplitude_pv == pytest.approx(pv, rel=2e-3)
    assert 2.0 * cycle.amplitude_mv == pytest.approx(mv, rel=2e-3)
    assert np.mean(cycle.levels) == pytest.approx(10.0 / 3.0)


@pytest.mark.parametrize(("S", "J", "period", "op"), known.KANO_INTEGRATING)
def test_kano_with_an_integrator(S, J, period, op):
    loop = st.Loop(st.PID(0.4, 2.0), st.Kano(S, J), st.Integrating(1.0), dt=0.01)
    (cycle,) = exact_limit_cycles(loop)
    assert cycle.period == pytest.approx(period, rel=2e-3)
    assert 2.0 * cycle.amplitude == pytest.approx(op, rel=5e-3)
    assert cycle.stable


@pytest.mark.parametrize(("Kc", "K", "d", "theta"), [(0.5, 1.0, 2.0, 0.5), (0.2, 3.0, 5.0, 0.666)])
def test_fast_process_follows_the_law_of_the_static_loop(Kc, K, d, theta):
    """T = Ti (1 - Kc K) / (Kc K theta (1 - theta)), PV and OP peak to peak K d and d; theta from lower level to SP."""
    loop = st.Loop(st.PID(Kc, 10.0), st.Stenman(d), st.FOPDT(K, 0.005), dt=0.01)
    (cycle,) = exact_limit_cycles(loop, families=[-theta * d])
    assert cycle.period == pytest.approx(10.0 * (1 - Kc * K) / (Kc * K * theta * (1 - theta)), rel=3e-3)
    assert 2.0 * cycle.amplitude_pv == pytest.approx(K * d, rel=3e-3)
    assert 2.0 * cycle.amplitude == pytest.approx(d, rel=3e-3)


@settings(deadline=None, max_examples=12)
@given(some.floats(0.1, 10.0), some.floats(0.05, 1.0), some.sampled_from([0.0, 6.0]))
def test_scale_invariance_and_what_the_stem_does(scale, share, dead_time):
    """(S, J) -> (c S, c J) keeps the period; MV_pp = OP_pp - (S - J) in a symmetric cycle; OP_pp >= S."""
    process = st.FOPDT(2.0, 12.0, dead_time) if dead_time else st.SOPDT(2.0, 12.0, 5.0)
    controller = st.PID(0.3, 8.0)
    one = exact_limit_cycles(st.Loop(controller, st.Kano(1.0, share), process, dt=1.0))
    many = exact_limit_cycles(st.Loop(controller, st.Kano(scale, scale * share), process, dt=1.0))
    assert len(one) == len(many)
    for a, b in zip(one, many, strict=True):
        assert b.period == pytest.approx(a.period, rel=1e-8)
        assert b.amplitude == pytest.approx(scale * a.amplitude, rel=1e-8)
        assert 2.0 * a.amplitude_mv == pytest.approx(2.0 * a.amplitude - (1.0 - share), rel=1e-8)
        assert 2.0 * a.amplitude >= 1.0


TWINS = {
    "Stenman, paper's loop": (EXAMPLE_LOOP, 0.25, 0.3),
    "He, lag": (st.Loop(st.PID(0.8, 8.0), st.He(1.0, 0.4), st.SOPDT(1.0, 8.0, 2.0), dt=0.1), 0.3, 0.5),
    "Kano, two lags": (st.Loop(st.PID(0.8, 8.0), st.Kano(1.0, 0.6), st.SOPDT(1.5, 8.0, 2.0), dt=0.1), 0.4, 0.5),
    "Kano, integrator": (st.Loop(st.PID(0.4, 2.0), st.Kano(3.0, 1.0), st.Integrating(1.0), dt=0.1), 1.0, 1.5),
    "Stenman, dead time": (st.Loop(st.PID(0.3, 8.0), st.Stenman(1.0), st.FOPDT(1.5, 8.0, 3.0), dt=0.1), 0.5, 0.6),
}


@pytest.mark.parametrize("name", TWINS)
def test_period_is_that_of_scipy_s_ode_solver_to_1e_6(name):
    loop, x, lead = TWINS[name]
    m = pack_loop(loop)
    lin, valve = m.linear, m.valve
    swings = period_of_twin(
        lin.A,
        lin.B,
        lin.C,
        lin.dead_time,
        valve.sb,
        valve.lag,
        valve.rate == 0.0,
        x,
        lead,
        turns=50 if "two lags" in name else 14,
    )
    assert np.ptp(swings[-2:]) < 1e-6 * swings[-1]
    families = [x + lin.rest] if valve.staircase else None
    periods = [c.period for c in exact_limit_cycles(loop, families=families)]
    assert min(abs(p / swings[-1] - 1.0) for p in periods) < 1e-6


def test_sampling_tends_to_the_continuous_cycle():
    """First order in dt: halving it halves the distance."""
    exact = 166.0
    off = []
    for dt in (1.0, 0.25):
        loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=dt)
        (cycle,) = sampled_limit_cycles(loop, sp=10.0, mv_start=3.0)
        off.append(exact - cycle.period)
    assert off[0] == pytest.approx(exact - 162.8, abs=0.4)
    assert off[1] == pytest.approx(off[0] / 4.0, rel=0.2)


def test_sampled_cycle_is_that_of_simulate():
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 5.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    cycles = sampled_limit_cycles(loop, sp=10.0, mv_start=3.0)
    record = st.simulate(loop, sp=10.0, duration=20_000.0)
    ups = np.nonzero((record.op[1:] > 10 / 3) & (record.op[:-1] <= 10 / 3))[0][-100:]
    assert min(abs(c.period / np.mean(np.diff(ups)) - 1.0) for c in cycles) < 2e-3
    assert min(abs(c.period - 71.5) for c in cycles) < 0.2


def test_a_rate_that_is_never_reached_is_no_size_of_a_start():
    """r is no band: one of 1000 % of span / s is the same valve as an infinite one, from the same starts."""
    process, controller = st.FOPDT(3.0, 10.0, 10.0), st.PID(0.2, 10.0)
    never, beyond = (
        sampled_limit_cycles(st.Loop(controller, st.Srinivasan(2.0, 1.0, r), process, dt=1.0), sp=10.0, periods=20.0)
        for r in (math.inf, 1000.0)
    )
    assert never == beyond


def test_srinivasan_is_kano_when_fast_and_a_staircase_when_slow():
    process, controller = st.FOPDT(3.0, 10.0, 10.0), st.PID(0.2, 10.0)
    (fast,) = exact_limit_cycles(st.Loop(controller, st.Srinivasan(2.0, 1.0, 1e-4), process, dt=1.0))
    assert fast.period == pytest.approx(166.0, rel=1e-6)
    slow = exact_limit_cycles(st.Loop(controller, st.Srinivasan(2.0, 1.0, 10.0), process, dt=1.0))
    he = exact_limit_cycles(st.Loop(controller, st.He(2.0, 1.0), process, dt=1.0))
    assert [c.period for c in slow] == pytest.approx([c.period for c in he], rel=1e-9)


def test_refusals():
    process = st.FOPDT(3.0, 10.0, 10.0)
    with pytest.raises(st.ParameterError, match="no stiction"):
        exact_limit_cycles(st.Loop(st.PID(0.2, 10.0), st.Stenman(0.0), process, dt=1.0))
    with pytest.raises(st.ParameterError, match="sampled_limit_cycles"):
        exact_limit_cycles(st.Loop(st.PID(0.2, 10.0), st.Choudhury(1.0, 2.0), process, dt=1.0))


@pytest.mark.parametrize("valve", [st.Kano(3.0, 1.0), st.Stenman(1.0), st.Srinivasan(2.0, 1.0, 0.1)])
def test_a_loop_without_gain_has_no_cycle(valve):
    """With Kc = 0 the OP does not answer the stem."""
    loop = st.Loop(st.PID(0.0, 10.0), valve, st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    assert exact_limit_cycles(loop) == ()
    assert st.predict_limit_cycles(loop) == ()


def test_a_valve_without_deadband_but_with_a_jump_cycles_as_it_is_simulated():
    """S = 0: the stem lies J / 2 before the OP on either way. The describing function turns with any amplitude."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(0.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=0.02)
    (cycle,) = exact_limit_cycles(loop)
    pushed = np.where(np.arange(100_000) < 2000, 1.0, 0.0)
    late = st.simulate(loop, 0.0, 2000.0, pushed).op[-50_000:]
    late = late - late.mean()
    ups = np.flatnonzero((late[:-1] < 0.0) & (late[1:] >= 0.0))
    assert cycle.period == pytest.approx(float(np.diff(ups).mean()) * loop.dt, rel=5e-3)
    assert cycle.amplitude == pytest.approx(np.ptp(late) / 2.0, rel=0.01)
    assert cycle in [one.exact or one for one in st.predict_limit_cycles(loop)]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"sp": math.nan}, "sp must be a finite number"),
        ({"sp": math.inf}, "sp must be a finite number"),
        ({"disturbance": math.nan}, "disturbance must be a finite number"),
        ({"mv_start": math.nan}, "mv_start must be a finite number"),
        ({"op_start": [1.0, math.nan]}, "op_start has entries that are not finite"),
        ({"op_start": "high"}, "op_start must be a number or an array"),
        ({"tolerance": math.nan}, "tolerance must be a finite number"),
        ({"periods": 0.0}, "periods = 0 is not positive"),
        ({"longest": math.nan}, "longest must be a finite number"),
        ({"longest": -1.0}, "longest = -1 s is not positive"),
    ],
)
def test_a_sampled_search_that_cannot_be_is_refused(given, message):
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    with pytest.raises(st.ParameterError, match=message):
        sampled_limit_cycles(loop, **given)
