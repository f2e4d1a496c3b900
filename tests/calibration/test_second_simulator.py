"""The second simulator against closed forms of a mass with friction, and its records against the limits it promises."""

from __future__ import annotations

import numpy as np
import pytest

from calibration.second_simulator import CAUSES, sample_loop
from calibration.second_simulator.historian import store_by_exception, store_by_swinging_door, store_slower
from calibration.second_simulator.processes import Process, ultimate_point
from calibration.second_simulator.valve import ValveParameters, measure_ramp_loop


@pytest.mark.parametrize("coulomb", [0.5, 2.0, 6.0])
def test_ramp_loop_of_a_deadband_is_twice_the_friction(coulomb):
    loop = measure_ramp_loop(ValveParameters(coulomb, coulomb, 1.0, 40.0, 1.0, 0.2))
    np.testing.assert_allclose(loop.S, 2.0 * coulomb, rtol=0.02)
    assert loop.J < 0.02 * loop.S


def test_a_damped_slip_ends_where_friction_balances_the_spring():
    # Without overshoot the stem stops at a force of the Coulomb friction: S = fs + fc, J = fs - fc.
    loop = measure_ramp_loop(ValveParameters(3.0, 1.0, 0.05, 40.0, 3.0, 0.2))
    np.testing.assert_allclose(loop, (4.0, 2.0), rtol=0.06)


def test_an_undamped_slip_overshoots_by_the_energy_balance():
    # Without damping the spring's force goes as far below the Coulomb friction as it was above: S = 2 fc.
    loop = measure_ramp_loop(ValveParameters(3.0, 2.0, 0.05, 40.0, 0.01, 0.2))
    np.testing.assert_allclose(loop, (4.0, 2.0), rtol=0.08)


def test_ultimate_point_of_an_integrator_with_dead_time():
    # Gain 1 / s and dead time 1 s without integral action: pi / 2 at a period of 4 s.
    pure = Process("integrating", np.array([[-1e-9]]), np.array([[1.0]]), np.array([[1.0]]), 1.0, 1.0)
    gain, period = ultimate_point(pure, 1e9, 1e-6)
    assert gain == pytest.approx(np.pi / 2.0, rel=0.02)
    assert period == pytest.approx(4.0, rel=0.02)


def test_compression_keeps_within_its_deviation():
    x = np.cumsum(np.random.default_rng(3).normal(size=500))
    assert np.abs(store_by_exception(x, 0.8, 60) - x).max() <= 0.8
    door = store_by_swinging_door(x, 0.8, 60)
    assert (
        np.abs(door - x).max() <= 1.6
    )  # the slopes are within 0.8 of all values, the end point may be another 0.8 off
    assert np.count_nonzero(np.abs(np.diff(door, 2)) > 1e-9) < 250
    assert store_slower(x, 5, average=True) == pytest.approx(x.reshape(-1, 5).mean(axis=1))


def test_loops_are_what_they_promise():
    loops = [sample_loop(seed) for seed in range(40)]
    assert {loop.truth.cause for loop in loops} <= set(CAUSES)
    assert 0.25 <= sum(loop.truth.sticky for loop in loops) / 40 <= 0.6
    for loop in loops:
        record, truth = loop.record, loop.truth
        assert 1000 <= len(record) <= 4000
        assert 1.0 <= record.dt <= 60.0
        assert truth.sticky == truth.cause.startswith("sticky")
        assert (truth.S >= 1.0 and truth.J >= 0.1 * truth.S) or not truth.sticky
        assert np.isfinite(record.op).all()
        assert np.ptp(record.op) > 0.0
    assert loops[7].record == sample_loop(7).record
