"""What moves a loop from outside: random loads, steps and ramps, waves of other loops, set points that move."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.models import FOPDT, PID, Kano, Loop
from stiction.simulation.closed_loop import simulate

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["SHAPES", "drifting_wave", "lagged_noise", "lagged_steps", "steps", "upstream_cycle", "wave"]

SHAPES = {"sine": 0.35, "triangle": 0.15, "square": 0.1, "sawtooth": 0.15, "upstream": 0.25}
"""Shapes of an external oscillation and how often they come; upstream is the PV of another, sticky loop."""


def lagged_noise(rng: np.random.Generator, n: int, lag: float) -> NDArray[np.float64]:
    """White noise behind a first-order lag of `lag` samples, standard deviation 1, shape (n,)."""
    from scipy.signal import lfilter

    white = rng.normal(0.0, 1.0, n)
    if lag <= 0.0:
        return white
    keep = float(np.exp(-1.0 / lag))
    out = lfilter([(1.0 - keep**2) ** 0.5], [1.0, -keep], white, zi=[keep * float(rng.normal())])[0]
    return np.asarray(out, dtype=np.float64)


def steps(rng: np.random.Generator, n: int, hold: float) -> NDArray[np.float64]:
    """Levels between -1 and 1, each held for `hold` samples on average, shape (n,)."""
    changes = np.cumsum(rng.random(n) < 1.0 / hold)
    return rng.uniform(-1.0, 1.0, int(changes[-1]) + 1)[changes]


def lagged_steps(rng: np.random.Generator, n: int, hold: float, lag: float) -> NDArray[np.float64]:
    """Steps of `steps` behind a first-order lag of `lag` samples, shape (n,)."""
    from scipy.signal import lfilter

    keep = float(np.exp(-1.0 / max(lag, 1e-3)))
    levels = steps(rng, n, hold)
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], levels, zi=[keep * levels[0]])[0], dtype=np.float64)


def drifting_wave(rng: np.random.Generator, shape: str, n: int, period: float) -> NDArray[np.float64]:
    """An oscillation as of `wave` whose period is steady, jitters from turn to turn, or drifts slowly, shape (n,)."""
    kind = rng.random()
    if kind < 0.6:
        return wave(rng, shape, n, period, jitter=0.0 if kind < 0.3 else float(rng.uniform(0.0, 0.03)))
    speed = np.exp(float(rng.uniform(0.02, 0.15)) * lagged_noise(rng, n, 5.0 * period))
    at = np.cumsum(speed)
    return np.interp(at, np.arange(int(at[-1]) + 2), wave(rng, shape, int(at[-1]) + 2, period))


def wave(rng: np.random.Generator, shape: str, n: int, period: float, jitter: float = 0.0) -> NDArray[np.float64]:
    """An oscillation of amplitude 1 and `period` samples, its phase wandering by `jitter` periods a period, shape (n,).

    Corners of a square are rounded off by a twelfth of the period, as a process between two loops does.
    """
    wander = np.cumsum(rng.normal(0.0, jitter / period**0.5, n)) if jitter else 0.0
    turns = (np.arange(n) / period + wander + rng.random()) % 1.0
    if shape == "sine":
        return np.sin(2.0 * np.pi * turns)
    if shape == "triangle":
        return 1.0 - 4.0 * np.abs(turns - 0.5)
    if shape == "sawtooth":
        rise = float(rng.uniform(0.75, 0.95))
        return np.interp(turns, [0.0, rise, 1.0], [-1.0, 1.0, -1.0])
    if shape == "square":
        return np.interp(turns, [0.0, 0.08, 0.5, 0.58, 1.0], [-1.0, 1.0, 1.0, -1.0, -1.0])
    cycle = upstream_cycle(rng)
    return np.interp(turns, np.linspace(0.0, 1.0, cycle.size), cycle)


def upstream_cycle(rng: np.random.Generator) -> NDArray[np.float64]:
    """One period of the PV of a sticky loop, from -1 to 1."""
    S = 3.0
    loop = Loop(
        PID(float(rng.uniform(0.2, 0.6)), float(rng.uniform(5.0, 15.0))),
        Kano(S, S * float(rng.uniform(0.3, 1.0))),
        FOPDT(1.0, float(rng.uniform(1.0, 10.0)), 3.0),
        dt=1.0,
    )
    record = simulate(loop, 0.0, 1500.0, S, mv_start=0.3)
    assert record.pv is not None
    pv = record.pv[500:]
    pv = pv - pv.mean()
    rises = np.flatnonzero((pv[:-1] < 0.0) & (pv[1:] >= 0.0))
    if rises.size < 3:
        return np.array([-1.0, 1.0, -1.0])
    cycle = pv[rises[0] : rises[1] + 1]
    return 2.0 * (cycle - cycle.min()) / np.ptp(cycle) - 1.0
