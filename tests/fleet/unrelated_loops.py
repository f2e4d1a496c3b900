"""Loops that share nothing but similar periods: sticky valves, loads of one period, loads that switch."""

from __future__ import annotations

import numpy as np

import stiction as st

KINDS = ("sticky", "sticky", "wave", "switch")


def draw_unrelated_loops(
    seed: int, count: int, low: float, high: float, *, samples: int = 4320, dt: float = 5.0
) -> list[st.LoopRecord]:
    """Simulate loops that oscillate with periods from `low` to `high` [s], each with its own noise and load."""
    rng = np.random.default_rng([59, seed])
    records: list[st.LoopRecord] = []
    while len(records) < count:
        period = float(np.exp(rng.uniform(np.log(low), np.log(high))))
        record = _draw_loop(rng, period, f"FIC-{len(records):02d}", samples, dt)
        records += [] if record is None else [record]
    return records


def _draw_loop(rng: np.random.Generator, period: float, tag: str, n: int, dt: float) -> st.LoopRecord | None:
    kind, S = rng.choice(KINDS), float(rng.uniform(2.0, 6.0))
    valve = st.Kano(S, S * float(rng.uniform(0.2, 0.7))) if kind == "sticky" else st.Ideal()
    dead, gain, ratio, share = (
        float(rng.uniform(*ends)) for ends in ((0.3, 1.0), (0.7, 2.0), (0.8, 1.5), (0.15, 0.24))
    )
    Kc = share * (2.0 + dead) / (gain * 2.0 * dead)
    wave = 2.0 * np.pi * np.arange(n) * dt / period + float(rng.uniform(0.0, 6.0))
    step = rng.normal(0.0, 0.02, n)
    load = np.cumsum(step - step.mean())
    if kind == "wave":
        load += 4.0 * np.sin(wave)
    if kind == "switch":
        load += 3.0 * np.sign(np.sin(np.cumsum(2.0 * np.pi * dt / period * (1.0 + 0.3 * rng.standard_normal(n)))))
    noise, seed = float(rng.uniform(0.05, 0.3)), int(rng.integers(1 << 30))

    def run(tau: float, noise: float, dt: float, load: np.ndarray) -> st.LoopRecord:
        loop = st.Loop(st.PID(Kc, ratio * tau), valve, st.FOPDT(gain, tau, dead * tau), dt=dt, noise=noise)
        return st.simulate(loop, 50.0, load.size * dt, load, seed, pv_start=50.0, op_start=50.0, tag=tag)

    tau = period / 8.0
    if kind == "sticky":  # the period is proportional to the times of the loop
        quiet = run(tau, 0.0, period / 60.0, np.zeros(3000)).op[1000:]
        up = np.flatnonzero((quiet[1:] > quiet.mean()) & (quiet[:-1] <= quiet.mean()))
        if up.size < 4:
            return None
        tau *= 60.0 / float(np.diff(up).mean())
    return run(tau, noise, dt, load)
