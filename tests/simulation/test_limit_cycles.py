"""Limit cycles against an independent simulation, and the laws they obey."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from tests import naive
from tests.reference.limit_cycles import CONTINUOUS, INTEGRATING, SAMPLED

import stiction as st


def cycle(record, tail):
    """Mean period [s], and peak to peak of each signal, over the last `tail` seconds."""
    n = round(tail / record.dt)
    op = record.op[-n:] - (record.op[-n:].max() + record.op[-n:].min()) / 2.0
    up = np.flatnonzero((op[:-1] < 0.0) & (op[1:] >= 0.0))
    assert up.size > 5, "no limit cycle"
    crossing = up - op[up] / (op[up + 1] - op[up])
    measured = {"period": float(np.mean(np.diff(crossing)) * record.dt)}
    for name in ("op", "pv", "mv"):
        measured[name] = float(np.ptp(getattr(record, name)[-n:]))
    return measured


def run(row, duration, integral, sp=None):
    g = row.given
    process = st.FOPDT(g["K"], g["tau"], g["dead_time"]) if "tau" in g else st.Integrating(g["K"])
    loop = st.Loop(st.PID(g["Kc"], g["Ti"], integral=integral), st.Kano(g["S"], g["J"]), process, g["dt"])
    return st.simulate(loop, g["sp"] if sp is None else sp, duration)


@pytest.mark.parametrize("row", CONTINUOUS, ids=str)
def test_self_regulating_loop(row):
    measured = cycle(run(row, 5000.0, "forward"), 2000.0)
    for name, value in row.expected.items():
        assert measured[name] == pytest.approx(value, rel=row.tolerance), name


@pytest.mark.parametrize("row", SAMPLED, ids=str)
def test_loop_sampled_once_a_second(row):
    measured = cycle(run(row, 100_000.0, "backward"), 80_000.0)
    for name, value in row.expected.items():
        assert measured[name] == pytest.approx(value, rel=row.tolerance), name


@pytest.mark.parametrize("row", INTEGRATING, ids=str)
def test_integrating_loop(row):
    measured = cycle(run(row, 1000.0, "forward"), 400.0)
    for name, value in row.expected.items():
        assert measured[name] == pytest.approx(value, rel=row.tolerance), name


def test_deadband_alone_comes_to_rest_with_one_integrator():
    """Check N15, S = 5, J = 0: no limit cycle."""
    loop = st.Loop(st.PID(0.2, 10.0, integral="forward"), st.Kano(5.0, 0.0), st.FOPDT(3.0, 10.0, 10.0), dt=0.02)
    record = st.simulate(loop, 10.0, 6000.0)
    assert np.ptp(record.mv[-50_000:]) == 0.0


@pytest.mark.parametrize("row", [*CONTINUOUS, *INTEGRATING[1:]], ids=str)
def test_position_swings_S_less_J_less_than_the_output(row):
    """Check N24: MV_pp = OP_pp - (S - J) and OP_pp >= S in a symmetric cycle."""
    record = run(row, 3000.0 if "tau" in row.given else 600.0, "forward")
    tail = record.op.size // 2
    op, mv = record.op[tail:], record.mv[tail:]
    lag = (row.given["S"] - row.given["J"]) / 2.0
    middle = (op.max() + op.min()) / 2.0
    crossing = np.flatnonzero((op[:-1] < middle) != (op[1:] < middle)) + 1
    assert crossing.size > 6
    assert np.ptp(op) >= row.given["S"]
    for a, b in pairwise(crossing):
        # Half way back from an extreme the stem still rests where that extreme left it.
        if op[a] > middle:
            assert mv[b] == pytest.approx(op[a:b].max() - lag, abs=1e-12)
        else:
            assert mv[b] == pytest.approx(op[a:b].min() + lag, abs=1e-12)


@pytest.mark.parametrize("factor", [2.0, 0.5, 8.0])
def test_scale_changes_amplitudes_and_not_the_period(factor):
    """Check N24, to the last bit: bands, set point and all signals by the same power of two."""

    def simulated(by):
        loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0 * by, 1.0 * by), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
        return st.simulate(loop, 10.0 * by, 3000.0)

    small, large = simulated(1.0), simulated(factor)
    for name in ("op", "pv", "mv"):
        assert np.array_equal(getattr(small, name) * factor, getattr(large, name)), name


@pytest.mark.parametrize("integral", ["backward", "forward"])
def test_loop_is_its_slow_twin(integral):
    """The same first cycles from plain Python lists; rounding differs where the process is written otherwise."""
    loop = st.Loop(st.PID(0.2, 10.0, integral=integral), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    record = st.simulate(loop, 10.0, 400.0)
    twin = naive.first_order_loop(10.0, 400, 0.2, 10.0, 1.0, naive.Kano(3.0, 1.0), 3.0, 10.0, 10, integral)
    for name, series in zip(("pv", "op", "mv"), twin, strict=True):
        np.testing.assert_allclose(getattr(record, name), series, atol=1e-11)


def test_loop_is_its_slow_twin_to_the_last_bit():
    """Where every product is exact (all gains powers of two, an integrator) nothing may differ at all."""
    dt, Kc, Ti, delay = 1.0, 0.25, 8.0, 3
    loop = st.Loop(st.PID(Kc, Ti), st.Kano(3.0, 1.0), st.Integrating(0.125, dead_time=3.0), dt)
    record = st.simulate(loop, 4.0, 40.0)
    bias, y, buffer, valve = 0.0, 0.0, [0.0] * delay, naive.Kano(3.0, 1.0)
    for k in range(40):
        bias += Kc * dt / Ti * (4.0 - y)
        u = Kc * (4.0 - y) + bias
        buffer.append(valve(u))
        assert (record.pv[k], record.op[k], record.mv[k]) == (y, u, buffer[-1]), k
        y += 0.125 * buffer.pop(0)
    assert np.ptp(record.mv) > 0.5
