"""The physical valve beside its C twin, and the paper's ramp beside scipy's stiff solvers."""

from __future__ import annotations

import ctypes
import math
import time
from typing import Any

import numpy as np
from bench import Row, Section, in_turn, median_time
from twin import build

import stiction as st
from stiction.models.parameter_sets import nominal, table1_reading_a, table1_reading_b
from stiction.models.physical_stem import PhysicalParameters
from stiction.simulation.drivers import stroke_one

INCH = 0.0254
FIELDS = [
    *("h", "keep", "keep_sample", "keep_mean", "mass", "spring_rate", "viscous", "coulomb", "static"),
    *("stribeck_velocity", "tolerance", "scale", "bottom", "top", "rest_force", "area", "pressure", "per_percent"),
    *("low", "high"),
]


class Parameters(ctypes.Structure):
    _fields_ = [*((name, ctypes.c_double) for name in FIELDS), ("n", ctypes.c_long), ("ramped", ctypes.c_long)]


def physical() -> Section:
    """Four signals beside the twin, then the 450 s ramp of the paper beside three ways of scipy."""
    t = np.arange(200_000) * 1e-3
    slow = 50.0 + 40.0 * np.sin(2.0 * np.pi * t / 50.0)
    rows = [
        against_twin("sine, 10 sub-steps of 0.1 ms", nominal(hold="linear", substep=1e-4), slow, 1e-3),
        against_twin("sine, samples of 0.1 s", nominal(), slow[::100].copy(), 0.1),
        against_twin("Table I (A), sine, samples of 1 ms", table1_reading_a(), slow, 1e-3),
        against_twin("Table I (B), held by friction", table1_reading_b(), 50.0 + 0.5 * (slow - 50.0), 1e-3),
    ]
    ramp, notes = paper_ramp()
    return Section("Physical valve", rows + ramp, ("kernel and C twin give the same bits", *notes))


def stroke_in_c() -> Any:
    """The C twin as a function (parameters, op, samples, position, mv)."""
    function = build("physical_twin.c").stroke
    pointer = ctypes.POINTER(ctypes.c_double)
    function.argtypes = [ctypes.POINTER(Parameters), pointer, ctypes.c_size_t, ctypes.c_double, pointer]
    function.restype = None
    return function


def against_twin(name: str, valve, op, dt: float) -> Row:
    """Sub-steps per second of kernel and twin."""
    q = PhysicalParameters(*valve.pack(dt)[2:])
    known = q._asdict() | {"stribeck_velocity": valve.stribeck_velocity}
    given = Parameters(*(known[field] for field in FIELDS), int(q.n), int(q.ramped))
    p, ours, theirs, in_c = valve.pack(dt), np.empty(op.size), np.empty(op.size), stroke_in_c()
    start, pointer = float(op[0]), ctypes.POINTER(ctypes.c_double)

    def c_twin() -> None:
        in_c(ctypes.byref(given), op.ctypes.data_as(pointer), op.size, start, theirs.ctypes.data_as(pointer))

    kernel_time, c_time = in_turn(lambda: stroke_one(valve.code, p, op, start, ours), c_twin)
    assert np.array_equal(ours, theirs), f"{name}: kernel and C twin differ"
    substeps = op.size * q.n
    return Row(name, substeps / kernel_time, "steps/s", "C twin", substeps / c_time, c_time / kernel_time, 0.8)


def smoothed(valve, rate: float, duration: float, method: str, width: float) -> tuple[float, float]:
    """Time [s] and last position [m] of solve_ivp on the friction that tanh(v / width) makes smooth."""
    from scipy.integrate import solve_ivp

    per_second = 0.01 * valve.force_span * rate
    excess = valve.static - valve.coulomb

    def slide(t, state):
        x, v = state
        friction = (valve.coulomb + excess * math.exp(-((v / valve.stribeck_velocity) ** 2))) * math.tanh(v / width)
        return [v, (per_second * t - valve.spring_rate * x - valve.viscous * v - friction) / valve.mass]

    start = time.perf_counter()
    found = solve_ivp(slide, (0.0, duration), [0.0, 0.0], method, rtol=1e-6, atol=1e-9)
    return time.perf_counter() - start, float(found.y[0, -1])


def events(valve, rate: float, duration: float) -> tuple[float, float]:
    """Time [s] and last position [m] by events: rest in closed form, slips by LSODA. The truth to compare with."""
    from scipy.integrate import solve_ivp

    per_second, excess = 0.01 * valve.force_span * rate, valve.static - valve.coulomb
    t, x = 0.0, 0.0

    def slide(time_, state):
        friction = valve.coulomb + excess * math.exp(-((state[1] / valve.stribeck_velocity) ** 2))
        force = per_second * time_ - valve.spring_rate * state[0] - valve.viscous * state[1] - friction
        return [state[1], force / valve.mass]

    def stop(_, state):
        return state[1]

    stop.terminal, stop.direction = True, -1  # type: ignore[attr-defined]
    start = time.perf_counter()
    while True:
        t = max(t, (valve.static + valve.spring_rate * x) / per_second)
        if t >= duration:
            break
        found = solve_ivp(slide, (t, duration), [x, 1e-9], "LSODA", events=stop, rtol=1e-9, atol=1e-12)
        t, x = float(found.t[-1]), float(found.y[0, -1])
    return time.perf_counter() - start, x


def paper_ramp() -> tuple[list[Row], list[str]]:
    """The 450 s ramp at 4 lbf/s, Table I in reading B, beside solve_ivp; a note each on where the stem ends."""
    rate, duration, dt = 100.0 / 450.0, 450.0, 0.01
    valve = table1_reading_b(hold="linear")
    op = rate * dt * np.arange(round(duration / dt) + 1)
    ours = median_time(lambda: st.stroke(valve, op, dt))
    last = 0.01 * valve.stroke * float(st.stroke(valve, op, dt).mv[-1])
    slow, truth = events(valve, rate, duration)
    rows, ends = [_ramp_row("events, LSODA", ours, slow, None)], []
    for method, target in (("Radau", 100.0), ("BDF", None)):
        slow, end = smoothed(valve, rate, duration, method, 1e-3 * INCH)
        rows.append(_ramp_row(f"solve_ivp {method}", ours, slow, target))
        ends.append(f"{method} {abs(end - truth) / INCH:.2g} in")
        assert abs(last - truth) <= abs(end - truth), f"{method} ends nearer to the truth"
    return rows, [
        f"end of the ramp off the one by events: stiction {abs(last - truth) / INCH:.2g} in, {', '.join(ends)}"
    ]


def _ramp_row(name: str, ours: float, theirs: float, target: float | None) -> Row:
    return Row("450 s ramp, samples of 10 ms", 1e3 * ours, "ms", name, 1e3 * theirs, theirs / ours, target)
