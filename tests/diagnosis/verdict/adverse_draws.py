"""What the kinds of adverse loops are drawn from: waves, plants, tunings, frictions; and what is kept of a loop.

The order of the draws is part of every kind: another one gives other loops, and counts made before no longer compare.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from adverse_plant import Controller, Process, Signals, Valve
from scipy.signal import lfilter

import stiction as st

WAVES = {
    "sine": lambda turn: np.sin(2.0 * np.pi * turn),
    "tri": lambda turn: 1.0 - 4.0 * np.abs(turn - 0.5),
    "square": lambda turn: np.where(turn < 0.5, 1.0, -1.0),
    "saw": lambda turn: 2.0 * turn - 1.0,
    "onoff": lambda turn: np.where(turn < 0.3, 1.0, -0.43),
}
"""Waves over the share of a period that has passed."""


class Adverse(NamedTuple):
    """One loop: its record, and what is true of it."""

    record: st.LoopRecord
    mv: np.ndarray
    """Where the stem was [% of span]; the record does not show it."""
    S: float
    J: float

    @property
    def sticky(self) -> bool:
        """Whether the valve sticks: one that only plays does not."""
        return self.J > 0.0


Draw = Callable[[np.random.Generator], Adverse]


class Kinds(dict[str, Draw]):
    """Kinds of loops by name."""

    def add(self, draw: Draw) -> Draw:
        """Decorator that keeps a function under its own name."""
        self[draw.__name__] = draw
        return draw


def recorded(
    signals: Signals,
    valve: Valve | None = None,
    *,
    dt: float = 1.0,
    scale: float = 1.0,
    offset: float = 0.0,
    loop_type: str = "flow",
) -> Adverse:
    """The record of what a loop with this valve did, a good one by default, its PV in units of `scale`."""
    op, pv, sp, mv = signals
    record = st.LoopRecord("X", dt, op=op, pv=offset + scale * pv, sp=offset + scale * sp, loop_type=loop_type)
    valve = valve or Valve()
    return Adverse(record, mv, valve.S, valve.J)


def by_historian(rng, signals: Signals, every: int) -> Signals:
    """Means over `every` samples, or one sample of them."""
    rows, mean = signals.op.size // every, rng.random() < 0.5
    blocks = (x[: rows * every].reshape(rows, every) for x in signals)
    return Signals(*(x.mean(axis=1) if mean else x[:, 0].copy() for x in blocks))


def log_uniform(rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def length(rng, shortest: float = 600.0, longest: float = 3000.0) -> int:
    """Samples of a record."""
    return int(log_uniform(rng, shortest, longest))


def lagged_process(rng) -> Process:
    """A process with self-regulation, dead time and a second lag."""
    tau = log_uniform(rng, 3.0, 40.0)
    dead_time = tau * rng.uniform(0.1, 1.0)
    return Process(tau, dead_time, tau * rng.uniform(0.0, 0.4))


def fast_process(rng) -> Process:
    """The process of a slave loop."""
    tau = rng.uniform(1.0, 5.0)
    return Process(tau, rng.uniform(0.5, 2.0))


def level(tau: float, dead_time: float, K: float = 0.02) -> Process:
    """A process that integrates."""
    return Process(tau, dead_time, K=K, integrating=True)


def tuned(rng, process: Process, slowest: float = 3.0, fastest: float = 1.0) -> Controller:
    """Lambda tuning to a closed loop so many times as slow as the dead time, the second lag left out of account."""
    closed = rng.uniform(fastest, slowest) * max(process.dead_time, 0.2 * process.tau)
    return Controller(process.tau / (closed + process.dead_time), process.tau)


def plain(rng, shortest: float = 600.0, longest: float = 3000.0) -> tuple[int, Controller, Process]:
    """Samples, controller and process of a loop with nothing odd about it."""
    n, process = length(rng, shortest, longest), lagged_process(rng)
    return n, tuned(rng, process), process


def tightened(controller: Controller, times: float) -> Controller:
    return replace(controller, Kc=controller.Kc * times)


def sticking(rng, smallest=1.0, largest=6.0, least_jump=0.5, most_jump=1.0) -> Valve:
    """A valve that sticks, S between two sizes [% of span] and J between two shares of it."""
    S = rng.uniform(smallest, largest)
    return Valve(S, S * rng.uniform(least_jump, most_jump))


def white(rng, n: int, size: float) -> np.ndarray:
    """White noise of so large a standard deviation."""
    return size * rng.normal(size=n)


def noise(rng, n: int, least: float, most: float, of: float = 1.0) -> np.ndarray:
    """White noise whose standard deviation is between two shares of a size."""
    return white(rng, n, of * rng.uniform(least, most))


def lagged(rng, n: int, lag: float) -> np.ndarray:
    """White noise through a first-order lag [samples], of variance 1 in the long run."""
    keep = np.exp(-1.0 / lag)
    return lfilter([np.sqrt(1.0 - keep * keep)], [1.0, -keep], rng.normal(size=n))


def wave(shape: str, n: int, period: float) -> np.ndarray:
    """A wave between about -1 and 1."""
    return WAVES[shape](np.arange(n) / period % 1.0)


def driven(
    rng, n: int, size: tuple[float, float], shapes: list[str], period: tuple[float, float], of: float = 1.0
) -> np.ndarray:
    """A wave of one of the shapes, its period between two bounds and its size between two shares of another."""
    drawn = of * rng.uniform(*size)
    return drawn * wave(rng.choice(shapes), n, rng.uniform(*period))


def pump(rng, n: int, period: float) -> np.ndarray:
    """1 and -1 in turn, each for about half a period."""
    out, k, now = np.zeros(n), 0, 1.0
    while k < n:
        end = k + max(int(period / 2.0 * rng.uniform(0.7, 1.3)), 2)
        out[k:end] = now
        k, now = end, -now
    return out


def hunting(rng, n: int, period: float, size: float) -> np.ndarray:
    """The wave of a positioner that hunts: mostly a triangle whose period wanders."""
    phase = np.arange(n) / period + np.cumsum(rng.normal(0.0, 0.02 / np.sqrt(period), n))
    if rng.random() < 0.3:
        return size * wave(rng.choice(["tri", "sine"]), n, period)
    return size * np.interp(phase % 1.0, [0.0, 0.25, 0.75, 1.0], [0.0, 1.0, -1.0, 0.0])


def kick(n: int, samples: int, size: float) -> np.ndarray:
    """A load at the beginning of the record, so that the loop has something to settle from."""
    return np.where(np.arange(n) < samples, size, 0.0)


def kicked(rng, n: int, S: float) -> np.ndarray:
    """A kick that makes a sticky valve slip, and a small load that wanders."""
    wander = rng.uniform(0.0, 0.3) * S
    return kick(n, 30, S) + wander * lagged(rng, n, rng.uniform(20.0, 80.0))


def steps(rng, n: int, size: float, hold: int) -> np.ndarray:
    """Set points held for so many samples each, evenly spread over -size to size."""
    return np.repeat(rng.uniform(-size, size, n // hold + 1), hold)[:n]
