"""Kernels compiled before the workers start, and the time that one loop takes on this machine."""

from __future__ import annotations

import time

__all__ = ["warm_kernels"]

MAX_START_S = 10.0
"""Time in which a worker loads compiled kernels, at most [s]."""
MAX_SAMPLES = 3000
"""Samples of the record that is timed: an audit shortens longer ones [-]."""


def warm_kernels(samples: int, dt: float) -> tuple[float, float]:
    """Compile all kernels once, so that the workers find them in the cache on disk, and time one loop.

    `samples`: samples of a loop [-]. `dt`: sampling period [s]. Returns time in which a worker starts, and time of one
    loop without reading it [s].
    """
    from stiction.diagnosis.pipeline import diagnose
    from stiction.fleet.block_means import common_clock, make_block_means
    from stiction.fleet.loop_oscillations import find_loop_oscillations
    from stiction.models import FOPDT, PID, Kano, Loop
    from stiction.simulation import simulate

    def run_loop(length: int) -> float:
        loop = Loop(PID(0.2, 10.0 * dt), Kano(5.0, 2.0), FOPDT(3.0, 10.0 * dt, 10.0 * dt), dt=dt, noise=0.1)
        record = simulate(loop, sp=10.0, duration=length * dt, seed=0, loop_type="flow")
        began = time.monotonic()
        diagnose([record])
        find_loop_oscillations(make_block_means(record, common_clock([record])))
        return time.monotonic() - began

    start_s = min(run_loop(1000), MAX_START_S)
    return start_s, run_loop(min(MAX_SAMPLES, max(100, samples)))
