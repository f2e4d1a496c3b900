"""The closed loop: steps per second beside the same loop in C and in python-control."""

# ruff: noqa: ARG001, ARG005 (python-control calls every system with t and params)

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import control
import numpy as np
from bench import Row, Section, in_turn, median_time
from twin import twin

import stiction as st
from stiction.simulation.drivers import fast_closed_loop

N, N_SHORT, N_CONTROL, N_COMPARED = 500_000, 10_000, 3_000, 1_000
DT, SP, S, J = 1.0, 10.0, 3.0, 1.0
LOOP = st.Loop(st.PID(0.2, 10.0), st.Kano(S, J), st.FOPDT(3.0, 10.0, 10.0), dt=DT)


def loops() -> Section:
    """PI, Kano's valve and first order plus ten samples of dead time, outputs preallocated on both sides."""
    discrete = LOOP.process.discretise(DT)
    pid, code, p = LOOP.controller.pack(DT), LOOP.valve.code, LOOP.valve.pack(DT)
    sp, nothing, automatic, start = np.array([SP]), np.zeros(1), np.array([np.nan]), np.zeros(3)
    ours, second, theirs = (np.empty((3, N)) for _ in range(3))

    def kernel(out=ours):
        pv, op, mv = out
        fast_closed_loop(pid, code, p, *discrete, sp, nothing, nothing, automatic, start, pv, op, mv)

    def c_twin(out=theirs):
        twin().loop_kano(
            N, 0.2, LOOP.controller.Ki * DT, -np.inf, np.inf, S, J,
            discrete.A[0, 0], discrete.b_new[0], discrete.c[0], discrete.delay, SP, *out,
        )  # fmt: skip

    def two(task, outs):
        for done in [pool.submit(task, out) for out in outs]:
            done.result()

    kernel()
    c_twin()
    assert np.array_equal(ours, theirs), "kernel and C twin differ"
    system = interconnected(discrete)
    time = np.arange(N_CONTROL) * DT
    rest = np.zeros(system.nstates)
    rest[system.find_state("valve_x[2]")], rest[system.find_state("valve_x[3]")] = (S - J) / 2.0, 1.0

    def in_control():
        return control.input_output_response(system, time, np.full(N_CONTROL, SP), rest).outputs

    # Later a slip on the edge of its band may fall a sample earlier by the last bit of another order of sums.
    pv = in_control()[:N_COMPARED]
    assert np.abs(pv - ours[0, :N_COMPARED]).max() < 1e-9, "kernel and python-control differ"
    speed, c_speed = (N / seconds for seconds in in_turn(kernel, c_twin))
    slow = N_CONTROL / median_time(in_control, repeats=5)
    with ThreadPoolExecutor(2) as pool:
        both = 2 * N / median_time(lambda: two(kernel, (ours, second)))
        c_both = 2 * N / median_time(lambda: two(c_twin, (theirs, second)))
    api, short = (n / median_time(lambda n=n: st.simulate(LOOP, SP, n * DT)) for n in (N, N_SHORT))
    rows = [
        Row("one core", speed, "steps/s", "python-control", slow, speed / slow, 10_000.0),
        Row("one core", speed, "steps/s", "C twin", c_speed, speed / c_speed, 0.7),
        Row("two threads", both, "steps/s", "C twin", c_both, both / c_both),
        Row("st.simulate, 500 000 steps and record", api, "steps/s", "python-control", slow, api / slow, 10_000.0),
        Row("st.simulate, 10 000 steps and record", short, "steps/s", "python-control", slow, short / slow, 10_000.0),
    ]
    notes = (
        f"kernel and C twin give the same bits, python-control the same PV to 1e-9 over {N_COMPARED} samples",
        "the twin knows this loop only: no noise, loads, hand, derivative or weights",
    )
    return Section("Closed loop: PI, Kano's valve, FOPDT with ten samples of dead time", rows, notes)


def interconnected(discrete) -> control.InterconnectedSystem:
    """The same loop as a user of python-control would write it."""

    def controller_output(t, x, u, params):
        return x + (0.2 + LOOP.controller.Ki * DT) * u

    def controller_update(t, x, u, params):
        return x + LOOP.controller.Ki * DT * u

    def kano(x, u):
        position, before, rest, direction, moving, trend_before = x
        trend = u - before
        if moving and trend * trend_before <= 0.0:
            rest, moving = before, 0.0
        travelled = direction * (u - rest)
        if not moving:
            if -travelled > S:
                direction, moving = -direction, 1.0
            elif travelled > J:
                moving = 1.0
        if moving:
            position = u - direction * (S - J) / 2.0
        return np.array([position, u, rest, direction, moving, trend])

    dead = discrete.delay
    A = np.zeros((dead + 1, dead + 1))
    A[0, 0], A[0, dead] = discrete.A[0, 0], discrete.b_new[0]
    A[2:, 1:dead] = np.eye(dead - 1)
    B, C = np.zeros((dead + 1, 1)), np.zeros((1, dead + 1))
    B[1, 0], C[0, 0] = 1.0, discrete.c[0]
    parts = [
        control.NonlinearIOSystem(
            controller_update, controller_output, inputs=["e"], outputs=["op"], states=1, dt=DT, name="controller"
        ),
        control.NonlinearIOSystem(
            lambda t, x, u, params: kano(x, u[0]),
            lambda t, x, u, params: kano(x, u[0])[:1],
            inputs=["op"], outputs=["mv"], states=6, dt=DT, name="valve",
        ),
        control.ss(A, B, C, [[0.0]], DT, inputs=["mv"], outputs=["pv"], name="process"),
        control.ss([], [], [], [[1.0, -1.0]], DT, inputs=["sp", "pv"], outputs=["e"], name="error"),
    ]  # fmt: skip
    return control.interconnect(parts, inputs=["sp"], outputs=["pv"])
