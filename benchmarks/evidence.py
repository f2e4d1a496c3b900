"""Oscillation and all evidence of a loop: milliseconds, beside a plain reading of the same rules."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from bench import Row, Section, median_time

import stiction as st
from stiction.diagnosis.detection import FACTS, detect_all
from stiction.diagnosis.detection.he_curve_fit import stiction_indices
from stiction.diagnosis.detection.nonlinearity import NEIGHBOURS
from stiction.diagnosis.detection.surrogate_data import prediction_error
from stiction.diagnosis.oscillation import find_oscillation, half_cycles
from stiction.records.record import LoopRecord


def evidence() -> Section:
    """A sticky loop, a sine in noise and noise that drifts, of 2 000 and of 30 000 samples."""
    rows = []
    for n in (2_000, 30_000):
        for name, record in _loops(n).items():
            found = find_oscillation(record)
            seen = median_time(lambda record=record: find_oscillation(record))
            all_ten = median_time(lambda record=record, found=found: detect_all(record, found))
            rows.append(Row(f"{n:,} samples, {name}: oscillation", seen * 1e3, "ms"))
            rows.append(Row(f"{n:,} samples, {name}: all {len(FACTS)} methods", all_ten * 1e3, "ms"))
    x = np.sin(np.arange(320) / 1.6) + 0.1 * np.random.default_rng(0).standard_normal(320)
    room, limit = np.empty((2, x.size, NEIGHBOURS)), np.empty(x.size)
    ours = median_time(lambda: prediction_error(x, 10, 5, limit, room[0], room[1]))
    plain = median_time(lambda: plain_prediction(x, 10, 5), repeats=3)
    rows.append(Row("prediction error of 320 samples", ours * 1e3, "ms", "numpy", plain * 1e3, plain / ours))
    y = np.sin(np.arange(2_000) / 10.0)
    cuts = half_cycles(y, 20.0 * np.pi)
    ours = median_time(lambda: stiction_indices(y, cuts))
    plain = median_time(lambda: plain_indices(y, cuts), repeats=3)
    rows.append(Row("He's index of 63 half periods", ours * 1e3, "ms", "numpy", plain * 1e3, plain / ours))
    apart = abs(prediction_error(x, 10, 5, limit, room[0], room[1]) - plain_prediction(x, 10, 5))
    worst = np.abs(stiction_indices(y, cuts) - plain_indices(y, cuts)).max()
    return Section("Evidence", rows, (f"the plain readings give the same: {apart:.0e} and {worst:.0e} apart",))


def _loops(n: int) -> dict[str, LoopRecord]:
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    sticky = replace(st.simulate(loop, 10.0, float(n), seed=1), mv=None, loop_type="flow")
    rng = np.random.default_rng(0)
    sine = np.sin(np.arange(n) / 10.0)
    op, pv = 50.0 - sine + 0.1 * rng.standard_normal(n), sine + 0.1 * rng.standard_normal(n)
    drift = np.cumsum(rng.standard_normal((2, n)), axis=1)
    return {
        "sticky": sticky,
        "sine in noise": LoopRecord("sine", 1.0, op=op, pv=pv, loop_type="flow"),
        "drift": LoopRecord("drift", 1.0, op=drift[0], pv=drift[1], loop_type="flow"),
    }


def plain_prediction(x, size: int, ahead: int) -> float:
    """All distances at once, then the nearest."""
    n = x.size - size - ahead + 1
    stretches = np.lib.stride_tricks.sliding_window_view(x, size)[:n]
    far = ((stretches[:, None, :] - stretches[None, :, :]) ** 2).sum(axis=2)
    starts = np.arange(n)
    far[np.abs(starts[:, None] - starts[None, :]) < size] = np.inf
    nearest = np.argpartition(far, NEIGHBOURS, axis=1)[:, :NEIGHBOURS]
    follows = x[size - 1 + ahead :]
    return float(np.mean((follows - follows[nearest].mean(axis=1)) ** 2))


def plain_indices(y, cuts):
    """He's rule as it is printed: every apex tried, each line by least squares."""
    values = []
    for start, stop in cuts:
        half, m = y[start:stop], stop - start
        t = np.arange(m) + 0.5
        sine = np.sin(np.pi * t / m)
        by_sine = _left(half, sine) / (m - 1)
        by_triangle = np.inf
        for k in range(m - 1):
            rise, fall = np.where(t <= k + 0.5, t, 0.0), np.where(t > k + 0.5, m - t, 0.0)
            low, high = t[k] / (m - t[k]), t[k + 1] / (m - t[k + 1])
            with np.errstate(divide="ignore", invalid="ignore"):
                q = (half @ fall) * (rise @ rise) / ((fall @ fall) * (half @ rise))
            by_triangle = min(by_triangle, _left(half, rise + np.clip(q, low, high) * fall))
        by_triangle /= m - 2
        values.append(by_sine / (by_sine + by_triangle))
    return np.array(values)


def _left(y, shape) -> float:
    return float(((y - (shape @ y) / (shape @ shape) * shape) ** 2).sum())
