"""With an ideal valve the loop is linear: the same sampled loop built by python-control must give the same signals."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
import scipy.signal

import stiction as st
from stiction.models import StateSpace
from stiction.models.processes import as_process

DT = 0.5
N = 240
SP = np.where(np.arange(N) < 120, 1.0, -0.5)
LOAD = np.where(np.arange(N) < 60, 0.0, 0.8)


def sampled_controller(c, dt):
    """[OP] of (sp, pv): proportional, integral and filtered derivative, each as a transfer function in z."""
    shift = control.tf([1.0, 0.0] if c.integral == "backward" else [1.0], [1.0, -1.0], dt)
    integral = control.tf([c.Ki * dt], [1.0], dt) * shift
    derivative = control.tf([c.Kd, -c.Kd], [c.Tf + dt, -c.Tf], dt)
    of_sp = control.ss(c.Kc * c.b + integral + c.c * derivative)
    of_pv = control.ss(c.Kc + integral + derivative)
    return of_sp, of_pv


def delay(n, dt):
    """A shift register of `n` samples."""
    if n == 0:
        return control.ss([], [], [], [[1.0]], dt)
    first = np.zeros((n, 1))
    first[0, 0] = 1.0
    return control.ss(np.eye(n, k=-1), first, np.eye(1, n, n - 1), [[0.0]], dt)


def closed_by_control(controller, plant, dead_samples, sp, load, dt):
    """PV and OP of the sampled loop: u = R r - C y, y = P z^-n (u + load)."""
    of_sp, of_pv = sampled_controller(controller, dt)
    process = control.ss(control.sample_system(plant, dt, method="zoh")) * delay(dead_samples, dt)
    loop = control.feedback(process, of_pv)
    t = np.arange(sp.size) * dt
    _, prefiltered = control.forced_response(of_sp, t, sp)
    _, pv = control.forced_response(loop, t, prefiltered + load)
    _, back = control.forced_response(of_pv, t, pv)
    return pv, prefiltered - back


PROCESSES = [
    ("first order", st.FOPDT(2.0, 8.0, 3.0), control.tf([2.0], [8.0, 1.0]), 6),
    ("no dead time", st.FOPDT(2.0, 8.0), control.tf([2.0], [8.0, 1.0]), 0),
    ("second order", st.SOPDT(2.0, 8.0, 3.0, 1.0), control.tf([2.0], [24.0, 11.0, 1.0]), 2),
    ("third order", st.TransferFunction([1.0, 2.0], [10.0, 17.0, 8.0, 1.0], 2.0), None, 4),
    ("under-damped", st.TransferFunction([1.0], [4.0, 0.8, 1.0], 0.5), None, 1),
    ("integrating", st.Integrating(0.05, dead_time=1.0), control.tf([0.05], [1.0, 0.0]), 2),
    ("integrating with lag", st.Integrating(0.05, 1.0, tau=2.0), control.tf([0.05], [2.0, 1.0, 0.0]), 2),
    ("biproper", st.TransferFunction([3.0, 1.0], [8.0, 1.0], 1.5), control.tf([3.0, 1.0], [8.0, 1.0]), 3),
    (
        "state space",
        StateSpace([[-0.2, 0.1], [0.0, -0.5]], [0.0, 1.0], [1.0, 0.2], dead_time=1.0),
        control.ss([[-0.2, 0.1], [0.0, -0.5]], [[0.0], [1.0]], [[1.0, 0.2]], [[0.0]]),
        2,
    ),
]
CONTROLLERS = [
    st.PID(0.4, 10.0),
    st.PID(0.4, 10.0, integral="forward"),
    st.PID(0.4, 10.0, 1.5, N=5.0),
    st.PID(0.3, 12.0, 1.0, N=8.0, b=0.6, c=0.0),
]


@pytest.mark.parametrize("controller", CONTROLLERS, ids=["PI", "PI forward", "PID", "PID weighted"])
@pytest.mark.parametrize(("process", "plant", "n"), [p[1:] for p in PROCESSES], ids=[p[0] for p in PROCESSES])
def test_loop_is_that_of_python_control(controller, process, plant, n):
    plant = control.tf(process.num, process.den) if plant is None else plant
    record = st.simulate(st.Loop(controller, st.Ideal(), process, DT), SP, N * DT, disturbance=LOAD)
    pv, op = closed_by_control(controller, plant, n, SP, LOAD, DT)
    assert np.ptp(pv) > 0.5
    np.testing.assert_allclose(record.pv, pv, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(record.op, op, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("dead_time", [0.1, 0.2, 0.75, 3.3, 7.45])
@pytest.mark.parametrize(
    "process",
    [
        st.FOPDT(2.0, 8.0),
        st.SOPDT(1.0, 5.0, 1.0),
        st.Integrating(0.05),
        st.TransferFunction([2.0, 1.0], [6.0, 5.0, 1.0]),
    ],
    ids=["first order", "second order", "integrating", "with a zero"],
)
def test_dead_time_of_a_fraction_of_a_sample(process, dead_time):
    """Ten finer samples to one, the dead time whole in them and the input held: no approximation on either side."""
    parts = 10
    fine = control.ss(control.sample_system(control.tf(process.num, process.den), DT / parts, method="zoh"))
    late = round(dead_time / (DT / parts))
    controller = st.PID(0.3, 12.0)
    loop = st.Loop(controller, st.Ideal(), st.TransferFunction(process.num, process.den, dead_time), DT)
    record = st.simulate(loop, SP, N * DT, disturbance=LOAD)
    held = np.concatenate([np.zeros(late), np.repeat(record.mv + LOAD, parts)])[: N * parts]
    _, pv = control.forced_response(fine, np.arange(N * parts) * (DT / parts), held)
    np.testing.assert_allclose(record.pv, pv[::parts], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(record.op, np.cumsum(0.3 * DT / 12.0 * (SP - record.pv)) + 0.3 * (SP - record.pv))


def test_biproper_process_with_a_fraction_of_dead_time():
    """The direct path sees the input at the first sample after the dead time."""
    process, parts, dead_time = st.TransferFunction([3.0, 1.0], [8.0, 1.0], 1.3), 5, 1.3
    record = st.simulate(st.Loop(st.PID(0.2, 12.0), st.Ideal(), process, DT), SP, N * DT)
    fine = control.ss(control.sample_system(control.tf([3.0, 1.0], [8.0, 1.0]), DT / parts, method="zoh"))
    late = round(dead_time / (DT / parts))
    held = np.concatenate([np.zeros(late), np.repeat(record.mv, parts)])[: N * parts]
    _, pv = control.forced_response(fine, np.arange(N * parts) * (DT / parts), held)
    np.testing.assert_allclose(record.pv, pv[::parts], rtol=0.0, atol=1e-9)


def test_pure_dead_time():
    loop = st.Loop(st.PID(0.2, 5.0), st.Ideal(), st.FOPDT(2.0, 0.0, 1.5), DT)
    record = st.simulate(loop, SP, N * DT)
    np.testing.assert_allclose(record.pv[3:], 2.0 * record.mv[:-3], atol=1e-12)
    assert set(record.pv[:3].tolist()) == {0.0}


def test_systems_of_other_packages_are_taken():
    own = st.Loop(st.PID(0.4, 10.0), st.Ideal(), st.SOPDT(2.0, 8.0, 3.0), DT)
    expected = st.simulate(own, SP, N * DT).pv
    plants = [
        control.tf([2.0], [24.0, 11.0, 1.0]),
        control.ss(control.tf([2.0], [24.0, 11.0, 1.0])),
        scipy.signal.lti([2.0], [24.0, 11.0, 1.0]),
        ([2.0], [24.0, 11.0, 1.0]),
    ]
    for plant in plants:
        pv = st.simulate(st.Loop(st.PID(0.4, 10.0), st.Ideal(), plant, DT), SP, N * DT).pv
        np.testing.assert_allclose(pv, expected, atol=1e-10)


@pytest.mark.parametrize("omega", [0.01, 0.3, 2.0])
def test_frequency_response_is_that_of_python_control(omega):
    process = st.TransferFunction([1.0, 2.0], [10.0, 17.0, 8.0, 1.0], 2.0)
    expected = control.tf(process.num, process.den)(1j * omega) * np.exp(-2j * omega)
    assert complex(process.at(1j * omega)) == pytest.approx(complex(expected), rel=1e-12)
    assert complex(process.state_space().at(1j * omega)) == pytest.approx(complex(expected), rel=1e-9)


def test_step_response_meets_the_closed_form():
    """FOPDT between any two samples: y = K (1 - exp(-(t - dead_time) / tau))."""
    loop = st.Loop(st.PID(1.0, math.inf), st.Ideal(), st.FOPDT(3.0, 10.0, 2.37), dt=1.0)
    record = st.simulate(loop, 0.0, 60.0, manual=np.full(60, 2.0))
    t = np.maximum(record.time - 2.37, 0.0)
    np.testing.assert_allclose(record.pv, 6.0 * (1.0 - np.exp(-t / 10.0)), atol=1e-12)


def test_dead_times_of_process_and_loop_add_up():
    one = as_process(st.FOPDT(3.0, 10.0, 5.0), dead_time=2.5)
    assert one.dead_time == as_process(([3.0], [10.0, 1.0], 5.0), dead_time=2.5).dead_time == 7.5


@pytest.mark.parametrize(
    ("process", "dead_time"),
    [(st.FOPDT(3.0, 10.0, 10.0), -5.0), (st.FOPDT(3.0, 10.0, 10.0), np.nan), (([1.0], [1.0, 1.0], -1.0), 0.0)],
)
def test_no_process_answers_before_it_is_moved(process, dead_time):
    with pytest.raises(st.ParameterError, match="dead_time"):
        as_process(process, dead_time=dead_time)
