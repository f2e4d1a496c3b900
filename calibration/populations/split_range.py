"""Loops with a split range: two good valves with a gap between them, at fixed values of OP.

A controller that heats above 52 % and cools below 48 % has a range of OP in which nothing flows. OP crosses it as a
load changes sign, once a day or many times an hour. The valves are good; to a search for stiction the gap looks like
one while it is crossed seldom.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from calibration.populations.case import Case
from calibration.populations.processes import log_uniform
from stiction.models import FOPDT, PID, Kano, Loop
from stiction.records.record import LoopRecord

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["draw_split_range", "split_range_population"]

SPLIT_RANGE = 11
"""Follows the seed and number of a loop, so that none is drawn like one of another population."""
GAP, CENTRE = (1.0, 12.0), (35.0, 65.0)
"""Width of the gap and its middle [% of span]."""
CROSSINGS = (1.0, 60.0)
"""Times that the load takes OP across the gap in the record [-]."""
SAMPLES = (500, 3000)
"""Samples in a record [-]."""
DEAD_TIME, TIME_CONSTANT = (2, 15), (8.0, 120.0)
"""Dead time and time constant of the process [samples]."""
NOISE = (0.002, 0.06)
"""Standard deviation of the measurement noise relative to the load's effect on the PV [-]."""


def split_range_population(n: int, seed: int = 0) -> Iterator[Case]:
    """Draw `n` loops with a gap between two good valves.

    Parameters
    ----------
    n : int
        Number of loops.
    seed : int
        Seed of everything that is random; each loop has its own.

    Yields
    ------
    Case
        One loop after the other.

    Examples
    --------
    >>> from calibration.populations import split_range_population
    >>> [(case.cause, case.sticky) for case in split_range_population(2, seed=1)]
    [('dead zone', False), ('dead zone', False)]
    """
    for i in range(n):
        yield draw_split_range(np.random.default_rng([seed, i, SPLIT_RANGE]), f"split-{i:04d}")


def draw_split_range(rng: np.random.Generator, tag: str) -> Case:
    """Draw one loop with a gap between two good valves."""
    n, dt, dead = int(rng.integers(*SAMPLES)), float(rng.choice([1.0, 2.0, 5.0, 10.0])), int(rng.integers(*DEAD_TIME))
    half, centre = 0.5 * log_uniform(rng, *GAP), float(rng.uniform(*CENTRE))
    gain, keep = 10.0 ** float(rng.uniform(-0.5, 0.8)), float(np.exp(-1.0 / log_uniform(rng, *TIME_CONSTANT)))
    time_constant = -1.0 / np.log(keep)
    Kc = float(rng.uniform(0.2, 0.5)) * time_constant / (gain * (dead + 1.0))
    Ti = min(time_constant, 8.0 * dead)
    crossings, shape = log_uniform(rng, *CROSSINGS), float(rng.uniform(1.2, 4.0))
    wave = np.sin(np.pi * crossings * np.arange(n) / n + rng.uniform(0.0, 2.0 * np.pi))
    walk = np.cumsum(rng.normal(0.0, 1.0, n))
    load = half * (shape * wave + float(rng.uniform(0.0, 0.5)) * walk / max(float(np.abs(walk).max()), 1e-9))
    noise = log_uniform(rng, *NOISE) * gain * shape * half * rng.normal(size=n)
    op, pv, flow = np.full(n, centre), np.empty(n), np.zeros(n + dead + 1)
    state, integral = 0.0, centre
    for k in range(n):
        off = op[k - 1] - centre
        flow[k + dead + 1] = np.sign(off) * max(abs(off) - half, 0.0)
        state = keep * state + (1.0 - keep) * gain * (flow[k] - load[k])
        pv[k] = 50.0 + state + noise[k]
        integral = min(max(integral + Kc / Ti * (50.0 - pv[k]), 0.0), 100.0)
        op[k] = min(max(integral + Kc * (50.0 - pv[k]), 0.0), 100.0)
    record = LoopRecord(tag, dt, op=op.round(2), pv=pv, sp=np.full(n, 50.0), loop_type="temperature")
    loop = Loop(PID(Kc, Ti * dt), Kano(0.0, 0.0), FOPDT(gain, time_constant * dt, dead * dt), dt=dt)
    period = 2.0 * n * dt / crossings
    return Case(record, "dead zone", loop, n * dt / period, "split range", period, 0.0, 0.0, 0.0, 0.0, ())
