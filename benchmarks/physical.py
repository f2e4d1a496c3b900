"""The physical valve beside its C twin, and the paper's ramp beside scipy's stiff solvers.

Run alone (`python benchmarks/physical.py`) or through run.py, which calls `section()`.
"""

from __future__ import annotations

import ctypes
import math
import shutil
import statistics
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import stiction as st
from stiction.models.stem import PhysicalParameters
from stiction.parameter_sets import nominal, table1_reading_a, table1_reading_b

REPEATS = 7
FIELDS = [
    *("h", "keep", "keep_sample", "keep_mean", "mass", "spring_rate", "viscous", "coulomb", "static"),
    *("stribeck_velocity", "tolerance", "scale", "bottom", "top", "rest_force", "area", "pressure", "per_percent"),
    *("low", "high"),
]


class Parameters(ctypes.Structure):
    _fields_ = [*((name, ctypes.c_double) for name in FIELDS), ("n", ctypes.c_long), ("ramped", ctypes.c_long)]


def twin() -> Any | None:
    """The C twin as a function (parameters, op, samples, position, mv), or None without a compiler."""
    compiler = shutil.which("cc")
    if compiler is None:
        return None
    folder = Path(tempfile.mkdtemp(prefix="stiction-twin-"))
    source, library = Path(__file__).with_name("physical_twin.c"), folder / "physical_twin.so"
    command = [compiler, "-O3", "-shared", "-fPIC", "-ffp-contract=off", "-o", library, source, "-lm"]
    subprocess.run([str(part) for part in command], check=True)
    function = ctypes.CDLL(str(library)).stroke
    pointer = ctypes.POINTER(ctypes.c_double)
    function.argtypes = [ctypes.POINTER(Parameters), pointer, ctypes.c_size_t, ctypes.c_double, pointer]
    function.restype = None
    return function


def seconds(work) -> float:
    """Median time of a call that has been made before [s]."""
    work()
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def in_turn(first, second) -> tuple[float, float]:
    """Shortest times of two calls made in turn, so that both see the same moods of the machine [s]."""
    times = []
    for _ in range(4 * REPEATS):
        for work in (first, second):
            start = time.perf_counter()
            work()
            times.append(time.perf_counter() - start)
    return min(times[2::2]), min(times[3::2])


def against_twin(name: str, valve, op, dt: float, stroke_in_c) -> dict[str, Any]:
    """Sub-steps per second of kernel and twin, and how far their positions are apart."""
    from stiction.simulation.drivers import stroke_one

    q = PhysicalParameters(*valve.pack(dt)[2:])
    known = q._asdict() | {"stribeck_velocity": valve.stribeck_velocity}
    given = Parameters(*(known[field] for field in FIELDS), int(q.n), int(q.ramped))
    p, ours, theirs = valve.pack(dt), np.empty(op.size), np.empty(op.size)
    start = float(op[0])

    def run_c() -> None:
        pointer = ctypes.POINTER(ctypes.c_double)
        stroke_in_c(ctypes.byref(given), op.ctypes.data_as(pointer), op.size, start, theirs.ctypes.data_as(pointer))

    kernel, in_c = in_turn(lambda: stroke_one(valve.code, p, op, start, ours), run_c)
    return {
        "case": name,
        "unit": "Mstep/s",
        "ours": op.size * q.n / kernel / 1e6,
        "theirs": op.size * q.n / in_c / 1e6,
        "ratio": in_c / kernel,
        "wanted": 0.8,
        "difference": float(np.abs(ours - theirs).max()),
    }


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


def paper_ramp() -> list[dict[str, Any]]:
    """The 450 s ramp at 4 lbf/s, Table I in reading B, beside solve_ivp."""
    rate, duration, dt = 100.0 / 450.0, 450.0, 0.01
    valve = table1_reading_b(hold="linear")
    op = rate * dt * np.arange(round(duration / dt) + 1)
    ours = seconds(lambda: st.stroke(valve, op, dt))
    last = 0.01 * valve.stroke * float(st.stroke(valve, op, dt).mv[-1])
    slow, truth = events(valve, rate, duration)
    rows = [_ramp_row("events, LSODA", ours, last, slow, truth, truth, None)]
    for method in ("Radau", "BDF"):
        time_, end = smoothed(valve, rate, duration, method, 1e-3 * 0.0254)
        rows.append(
            _ramp_row(f"solve_ivp {method}", ours, last, time_, end, truth, 100.0 if method == "Radau" else None)
        )
    return rows


def _ramp_row(name: str, ours: float, last: float, theirs: float, end: float, truth: float, wanted) -> dict[str, Any]:
    return {
        "case": f"450 s ramp beside {name}",
        "unit": "s",
        "ours": ours,
        "theirs": theirs,
        "ratio": theirs / ours,
        "wanted": wanted,
        "end_error_ours": abs(last - truth) / 0.0254,
        "end_error_theirs": abs(end - truth) / 0.0254,
    }


def section() -> list[dict[str, Any]]:
    """Rows {case, unit, ours, theirs, ratio, wanted, ...}: ratio above 1 means ours is faster; errors in inches."""
    rows = []
    stroke_in_c = twin()
    if stroke_in_c is not None:
        t = np.arange(200_000) * 1e-3
        slow = 50.0 + 40.0 * np.sin(2.0 * np.pi * t / 50.0)
        cases = (
            ("nominal, sine, 1 ms samples of 10 sub-steps", nominal(hold="linear", substep=1e-4), slow, 1e-3),
            ("nominal, sine, 0.1 s samples", nominal(), slow[::100].copy(), 0.1),
            ("Table I (A), sine, 1 ms samples", table1_reading_a(), slow, 1e-3),
            ("Table I (B), held by friction, 1 ms samples", table1_reading_b(), 50.0 + 0.5 * (slow - 50.0), 1e-3),
        )
        rows += [against_twin(name, valve, op, dt, stroke_in_c) for name, valve, op, dt in cases]
    return rows + paper_ramp()


if __name__ == "__main__":
    for row in section():
        print({name: f"{value:.4g}" if isinstance(value, float) else value for name, value in row.items()})
