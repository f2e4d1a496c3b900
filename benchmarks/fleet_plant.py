"""Write a plant of many loops as Parquet: `python benchmarks/fleet_plant.py FOLDER --loops 10000`.

A day at 5 s, float32, 100 loops in each file. A third of the loops has periods of 8 to 25 samples; a third of the
valves sticks.
"""

from __future__ import annotations

import argparse
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import polars as pl

import stiction as st

LOOPS_PER_FILE = 100
START = datetime(2026, 3, 2)


def write_plant(folder: Path, loops: int, *, samples: int = 17280, dt: float = 5.0, seed: int = 0) -> None:
    """Write the loops; a file that is there already stays."""
    folder.mkdir(parents=True, exist_ok=True)
    clock = pl.Series("Time", [START + timedelta(seconds=dt * k) for k in range(samples)])
    for first in range(0, loops, LOOPS_PER_FILE):
        path = folder / f"unit-{first // LOOPS_PER_FILE:03d}.parquet"
        if path.exists():
            continue
        columns = [clock]
        for k in range(first, min(loops, first + LOOPS_PER_FILE)):
            record = draw_loop(np.random.default_rng([seed, k]), k, samples, dt)
            for name in ("sp", "pv", "op"):
                signal = np.round(getattr(record, name), 2).astype(np.float32)
                columns.append(pl.Series(f"U{first // LOOPS_PER_FILE:03d}-FIC{k:05d}.{name.upper()}", signal))
        pl.DataFrame(columns).write_parquet(path, compression="zstd", row_group_size=samples)


def draw_loop(rng: np.random.Generator, k: int, samples: int, dt: float) -> st.LoopRecord:
    """Simulate one loop: every third has periods of 8 to 25 samples, and every third valve sticks."""
    fast = k % 3 == 0
    tau = dt * float(rng.uniform(0.6, 2.0) if fast else np.exp(rng.uniform(np.log(4.0), np.log(60.0))))
    dead_time = dt * float(rng.integers(1, 3)) if fast else tau * float(rng.uniform(0.2, 0.8))
    gain = float(rng.uniform(0.6, 2.0))
    controller = st.PID(float(rng.uniform(0.3, 0.6)) * (tau / dead_time) / gain, tau)
    S = float(rng.uniform(2.0, 8.0)) if (k // 3) % 3 == 0 else 0.0
    valve = st.Kano(S, S * float(rng.uniform(0.2, 0.9))) if S else st.Ideal()
    loop = st.Loop(controller, valve, st.FOPDT(gain, tau, dead_time), dt=dt, noise=float(rng.uniform(0.02, 0.3)))
    sp = np.full(samples, 50.0)
    for _ in range(int(rng.integers(0, 4))):
        sp[int(rng.integers(samples)) :] += float(rng.uniform(-3.0, 3.0))
    walk = np.cumsum(rng.normal(0.0, float(rng.uniform(0.005, 0.05)), samples))
    load = walk - np.linspace(0.0, walk[-1], samples)
    return st.simulate(loop, sp, samples * dt, load, k, pv_start=50.0, op_start=50.0, loop_type="flow")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--loops", type=int, default=10000)
    asked = parser.parse_args()
    write_plant(asked.folder, asked.loops)
