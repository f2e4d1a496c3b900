"""The physical valve against the paper's figures, public code, an event-driven twin and energy."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from tests.models import event_driven
from tests.reference import physical as reference

import stiction as st
from stiction.models.parameter_sets import PUBLISHED_VALVES, published_valve, table1_reading_a, table1_reading_b
from stiction.models.physical_stem import PhysicalParameters, physical_at_rest, physical_step
from stiction.models.positioner import Positioner

INCH = 0.0254


def paper_ramp(valve, slope, dt=1e-4):
    """Pressure [psi] and stem position [in] of a ramp to 18 psi at `slope` [psi/s]."""
    pressure = slope * dt * np.arange(round(18.0 / slope / dt) + 1)
    return pressure, st.stroke(valve, pressure / 0.18, dt).mv * 0.06


def starts_and_slips(x):
    moving = np.diff(x) != 0.0
    edge = np.diff(moving.astype(int), prepend=0)
    starts, rests = np.flatnonzero(edge > 0), np.flatnonzero(edge < 0)
    return starts, x[rests] - x[starts[: rests.size]]


@pytest.mark.parametrize("hold", ["zero", "linear"])
@pytest.mark.parametrize("row", reference.STAIRS, ids=lambda row: row.given["set"])
def test_staircase_of_the_paper(row, hold):
    """Fig. 2b in both readings; at 0.1 ms sampling a held and a straight input agree."""
    pressure, x = paper_ramp(published_valve(row.given["set"], hold=hold), row.given["slope"])
    starts, slips = starts_and_slips(x)
    assert pressure[starts[0]] == pytest.approx(row.expected["first"], rel=row.tolerance)
    assert starts.size == row.expected["slips"]
    assert slips[:-1] == pytest.approx(row.expected["slip"], rel=row.tolerance)


@pytest.mark.parametrize("row", reference.FOLLOW, ids=lambda row: row.given["set"])
def test_stick_jump_follow_of_the_paper(row):
    """Fig. 2c in both readings: one start, no rest."""
    _, x = paper_ramp(published_valve(row.given["set"], hold="linear"), row.given["slope"])
    starts, slips = starts_and_slips(x)
    assert (starts.size, slips.size) == (1, 0)
    speed = np.diff(x)[starts[0] :] / 1e-4
    assert speed[speed.argmax() :].min() == pytest.approx(row.expected["slowest"], rel=row.tolerance)


def test_slip_grows_with_the_rate():
    row = reference.SLIP_OVER_RATE
    slips = [starts_and_slips(paper_ramp(table1_reading_a(), slope)[1])[1][0] for slope in row.given["slope"]]
    assert slips == pytest.approx(row.expected, rel=row.tolerance)


@pytest.mark.parametrize("row", reference.POSITIONS, ids=lambda row: row.case)
def test_positions_of_public_code(row):
    t = np.arange(100001) * 1e-3
    valve = published_valve(row.given["set"], lag=0.0, hold="linear", substep=5e-6)
    mv = st.stroke(valve, np.where(t <= 50.0, 2.0 * t, 200.0 - 2.0 * t), 1e-3).mv
    assert 0.01 * valve.stroke * mv[[25000, 50000, 60000, 99900]] == pytest.approx(row.expected, abs=1e-7)


@pytest.mark.parametrize(("make", "rate"), [(table1_reading_a, 4.0 / 0.18), (table1_reading_b, 0.0667 / 0.18)])
def test_kernel_against_events(make, rate):
    """The fixed sub-step stops where an adaptive solver with events stops, to a thousandth of a slip."""
    valve = make(hold="linear")
    duration = 90.0 / rate
    stops, last = event_driven.ramp(valve, rate, duration)
    dt = 1e-3
    op = rate * dt * np.arange(round(duration / dt) + 1)
    x = 0.01 * valve.stroke * st.stroke(valve, op, dt).mv
    assert len(stops) >= 3
    slip = stops[0][1]
    for time, position in stops[:-1]:
        assert x[math.ceil(time / dt) + 2] == pytest.approx(position, abs=3e-3 * slip)
    assert x[-1] == pytest.approx(last, abs=0.03 * slip)


@pytest.mark.parametrize("name", PUBLISHED_VALVES)
def test_default_substep_is_fine_enough(name):
    """A tenth of the default sub-step moves no position by more than 0.1 % of travel."""
    valve = published_valve(name, hold="linear")
    t = np.arange(0.0, 30.0, 0.01)
    op = 50.0 + 40.0 * np.sin(0.3 * t)
    fine = replace(valve, substep=0.1 * valve.pack(100.0)[5])
    assert st.stroke(valve, op, 0.01).mv == pytest.approx(st.stroke(fine, op, 0.01).mv, abs=0.1)


@given(
    fs=some.floats(0.1, 30.0),
    share=some.floats(-0.999, 0.999),
    zeta=some.floats(0.0, 5.0),
    lag=some.sampled_from([0.0, 0.3]),
    seed=some.integers(0, 2**16),
)
@settings(max_examples=40)
def test_no_creep_when_stuck(fs, share, zeta, lag, seed):
    """Under any input within static friction a Karnopp stem does not move by one bit."""
    static = 0.01 * fs * 1e4
    valve = st.PhysicalValve(2.0, 1e5, zeta * 2e3, 0.5 * static, static, 1e-3, 0.1, 0.1, lag=lag)
    op = 50.0 + fs * share * np.random.default_rng(seed).uniform(-1.0, 1.0, 200)
    assert np.unique(st.stroke(valve, op, 0.1, mv_start=50.0).mv).tolist() == [50.0]


def test_lugre_holds_within_its_bristles():
    valve = published_valve("graphite_lugre", lag=0.0)
    op = np.r_[50.0, np.full(2000, 55.0)]
    mv = st.stroke(valve, op, 0.01).mv
    bend = 100.0 * valve.static / (valve.bristle_stiffness * valve.stroke)
    assert abs(mv[-1] - mv[0]) < 2.0 * bend
    assert mv[-1] == pytest.approx(mv[1000], abs=1e-3 * bend)


@given(
    law=some.sampled_from(["karnopp", "lugre"]),
    zeta=some.floats(0.0, 3.0),
    coulomb=some.floats(1.0, 300.0),
    excess=some.floats(0.0, 200.0),
    away=some.floats(1.0, 40.0),
)
@settings(max_examples=40)
def test_energy_is_never_created(law, zeta, coulomb, excess, away):
    """A free stem that starts away from its balance only loses energy, up to the method's ripple.

    LuGre's law itself is dissipative for any parameters only without bristle damping (sigma_1 with Fs > Fc may feed
    energy), so the bristles get next to none.
    """
    free = {"travel": (-math.inf, math.inf), "bristle_damping": 1e-6}
    valve = st.PhysicalValve(2.0, 1e5, zeta * 894.0, coulomb, coulomb + excess, 1e-3, 0.1, 0.1, law, **free)
    dt = valve.time_constant / 500.0
    p = valve.pack(dt)
    q = PhysicalParameters(*p[2:])
    s = physical_at_rest(0.0, away, p)
    held = []
    for _ in range(4000):
        s = physical_step(0.0, s, q)
        bristles = 0.5 * q.stiffness * s.force**2 if law == "lugre" else 0.0
        held.append(event_driven.energy(valve, q.scale * s.position, s.velocity) + bristles)
    start = 0.5 * valve.spring_rate * (q.scale * away) ** 2
    if law == "lugre":
        start += 0.5 * q.stiffness * physical_at_rest(0.0, away, p).force ** 2
    ripple = 0.005 * start
    assert max(held) <= start + ripple
    assert np.all(np.array(held) <= np.minimum.accumulate(held) + ripple)


def test_energy_lost_is_friction_and_damping_work():
    """Balance over one slip: what spring and air gave went into Coulomb, Stribeck and viscous friction."""
    valve = replace(table1_reading_a(), travel=(-math.inf, math.inf))
    dt = 2e-5
    p = valve.pack(dt)
    q = PhysicalParameters(*p[2:])
    s = physical_at_rest(0.0, 40.0, p)
    lost, start = 0.0, event_driven.energy(valve, q.scale * s.position, 0.0)
    for _ in range(100000):
        before = s
        s = physical_step(0.0, s, q)
        v = s.velocity
        friction = valve.coulomb + (valve.static - valve.coulomb) * math.exp(-((v / valve.stribeck_velocity) ** 2))
        lost += abs(q.scale * (s.position - before.position)) * (friction + valve.viscous * abs(v))
    assert s.velocity == 0.0
    assert start - event_driven.energy(valve, q.scale * s.position, 0.0) == pytest.approx(lost, rel=1e-3)


def test_undamped_frictionless_period():
    """Mass and spring alone swing with sqrt(K / m), and neither gain nor lose."""
    valve = st.PhysicalValve(4.0, 400.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, travel=(-math.inf, math.inf), hold="linear")
    dt = 0.01
    t = dt * np.arange(10001)
    mv = st.stroke(valve, np.zeros(t.size), dt, mv_start=10.0).mv
    assert mv[5000:].max() == pytest.approx(10.0, rel=1e-2)
    upward = np.flatnonzero((mv[1:] > 0.0) & (mv[:-1] <= 0.0))
    period = dt * (upward[-1] - upward[0]) / (upward.size - 1)
    assert period == pytest.approx(2.0 * math.pi / 10.0, rel=1e-3)


def test_paper_table_gives_its_first_break_by_hand():
    """F_s / A = 384 lbf / 100 in2 = 3.84 psi = 21.33 % of 18 psi."""
    op = np.array([0.0, 21.3, 21.3, 21.34])
    assert (st.stroke(table1_reading_b(), op, 1.0).mv > 0.0).tolist() == [False, False, False, True]


def test_air_to_close_mirrors_air_to_open():
    """The OP is the opening asked for, whichever way the air works."""
    op = 50.0 + 30.0 * np.sin(np.arange(300) / 20.0)
    to_open, to_close = (table1_reading_b(air_to_open=way, fluid_force="40 lbf") for way in (True, False))
    assert st.stroke(to_open, op, 0.05).mv == pytest.approx(st.stroke(to_close, op, 0.05).mv, abs=1e-6)


def test_fluid_force_shifts_by_its_share():
    """With a given preload a fluid force of A dP / 10 asks for 10 % more air."""
    plain = table1_reading_b(preload=0.0)
    loaded = replace(plain, fluid_force=0.1 * plain.force_span)
    assert loaded.offset - plain.offset == pytest.approx(10.0)
    ramp = np.arange(0.0, 90.0, 0.01)
    first = [np.flatnonzero(st.stroke(v, ramp, 0.01).mv)[0] for v in (plain, loaded)]
    assert ramp[first[1]] - ramp[first[0]] == pytest.approx(10.0, abs=0.011)


def test_end_stops_hold_the_stem_and_let_it_go():
    valve = table1_reading_a(travel=(30.0, 60.0), hold="linear")
    op = np.r_[np.linspace(45.0, 100.0, 2000), np.linspace(100.0, 0.0, 2000)]
    mv = st.stroke(valve, op, 0.01).mv
    assert (mv.max(), mv.min()) == pytest.approx((60.0, 30.0), abs=1e-9)
    # The spring must win back fs on its way off the upper stop: 60 - 21.33 %.
    leaves = op[np.flatnonzero((mv[:-1] > 60.0 - 1e-9) & (mv[1:] < 60.0 - 1e-9))[-1]]
    assert leaves == pytest.approx(60.0 - 100.0 * 384.0 / 1800.0, abs=0.1)


def test_lag_is_first_order_whether_held_or_not():
    """While the stem rests the pressure moves in closed form; a break through the lag comes at tau ln(.)."""
    valve = table1_reading_b(lag=2.0)
    op = np.r_[0.0, np.full(400, 40.0)]
    mv = st.stroke(valve, op, 0.05).mv
    fs = 100.0 * 384.0 / 1800.0
    breaks = 2.0 * math.log(40.0 / (40.0 - fs))
    first = np.flatnonzero(mv)[0]
    assert first * 0.05 == pytest.approx(breaks, abs=0.051)


@pytest.mark.parametrize("dt", [0.5, 0.05])
@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_held_sample_agrees_with_substeps(dt, hold):
    """The O(1) sample at rest and the sub-steps meet: sampling changes when a stem is looked at, not what it does."""
    op = np.repeat([50.0, 60.0, 75.0, 75.0], round(2.0 / dt))
    coarse = st.stroke(published_valve("nominal", hold="zero"), op, dt).mv[round(2.0 / dt) - 1 :: round(2.0 / dt)]
    fine = st.stroke(published_valve("nominal", hold="zero"), np.repeat([50.0, 60.0, 75.0, 75.0], 2000), 1e-3).mv
    assert coarse == pytest.approx(fine[1999::2000], abs=0.02)


def test_positioner_takes_the_offset_away():
    """Proportional: what friction and preload ask for, over the gain, is left. PI: the deadband is."""
    op = np.r_[np.full(50, 40.0), np.full(3000, 60.0)]
    errors = {}
    for name, positioner in (
        ("none", None),
        ("P", Positioner(9.0)),
        ("PI", Positioner(9.0, integral_time=2.0, deadband=0.5)),
    ):
        mv = st.stroke(published_valve("nominal", positioner=positioner, lag=0.05), op, 0.02, mv_start=40.0).mv
        errors[name] = abs(mv[-1] - 60.0)
    valve = published_valve("nominal")
    asked = 60.0 / valve.gain + valve.offset + 100.0 * valve.static / valve.force_span - 60.0
    assert errors["none"] > 5.0
    assert errors["P"] < asked / 9.0
    assert errors["PI"] <= 0.5 + 1e-6


def test_closed_loop_with_a_physical_valve_oscillates():
    """Stiction makes the loop cycle; the same valve without static friction or Coulomb friction does not."""
    process = st.FOPDT(3.0, 10.0, 10.0)
    sticky = table1_reading_b(lag=0.2)
    free = replace(sticky, coulomb=0.0, static=0.0)
    swing = {}
    for name, valve in (("sticky", sticky), ("free", free)):
        loop = st.Loop(st.PID(0.2, 10.0), valve, process, dt=1.0)
        op = st.simulate(loop, sp=10.0, duration=6000.0, op_start=50.0).op[-3000:]
        swing[name] = np.ptp(op)
    assert swing["sticky"] > 30.0
    assert swing["free"] < 0.1


def test_he_wang_overshoot_factor_is_that_of_the_stem():
    """N19: a quasi-static slip of the stem goes K times the way to the balance of forces."""
    row = reference.OVERSHOOT
    from stiction.models.valves.he_wang import overshoot_factor

    for zeta, expected in zip(row.given["damping_ratio"], row.expected, strict=True):
        assert overshoot_factor(zeta) == pytest.approx(expected, rel=row.tolerance)
        valve = table1_reading_a(stribeck_velocity=1e-6, hold="linear", travel=(-math.inf, math.inf))
        valve = replace(valve, viscous=2.0 * zeta * math.sqrt(valve.spring_rate * valve.mass), substep=1e-5)
        dt, rate = 0.005, 0.001
        op = 100.0 * valve.static / valve.force_span - 5e-6 + rate * dt * np.arange(400)
        mv = st.stroke(valve, op, dt, mv_start=0.0).mv
        jump = 100.0 * (valve.static - valve.coulomb) / valve.force_span
        assert mv.max() / jump == pytest.approx(expected, rel=3e-3)


def test_he_wang_with_one_is_he():
    op = np.cumsum(np.random.default_rng(3).normal(0.0, 1.0, 2000))
    assert st.stroke(st.HeWang(2.0, 0.5), op, 1.0).mv == pytest.approx(st.stroke(st.He(2.0, 0.5), op, 1.0).mv, abs=1e-9)
