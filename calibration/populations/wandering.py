"""Loops that an oscillation from outside moves whose period wanders.

A level that is pumped out, surge or a neighbour's sticky valve makes such a one. The waves of `population` keep their
rhythm to a few per cent. What fills until it tips, or waits until a valve lets go, has a limit and no clock: every
period is of another length, while the way from one end to the other stays the same. Such a wave is nowhere repeated in
time, turns where the PV comes to a level, and may pass for slips of a valve. All ranges were written down before a loop
was counted, and none was changed by the counts.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from calibration.populations.causes import SAMPLES, add_background, sample_recording
from calibration.populations.demand import MAX_NOISE_SHARE, STICKY_ONE_IN, sample_loop, scale_demand
from calibration.populations.draw import record_scenario, sample_held_out
from calibration.populations.loads import upstream_cycle
from calibration.populations.processes import log_uniform
from calibration.populations.scenario import Scenario

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from calibration.populations.case import Case

__all__ = ["SHAPES", "wandering_population", "wandering_wave"]

WANDERS = 8
"""What the seed of a loop is followed by, so that none of these loops is drawn like one of `population`."""
PERIOD = (10.0, 150.0)
"""Shortest and longest mean period [samples of the controller]."""
SPREAD = (0.03, 0.3)
"""Least and largest standard deviation of the logarithm of a period [-]."""
SIZE = (1.0, 5.0)
"""Smallest and largest amplitude of the wave in a loop with a good valve [% of span]."""
OF_PV = 0.4
"""How often the wave is a disturbance of the PV and not of the load [-]."""
SHAPES = ("triangle", "sawtooth", "square", "charge", "upstream")
"""Shapes of the wave, all as often; a charge goes to a limit as a first order does, upstream is a sticky loop's PV."""
RISE, BEND = (0.6, 0.95), (1.0, 3.0)
"""Share of the period in which a sawtooth rises, and time constants in which a charge goes from end to end [-]."""


def wandering_population(n: int, seed: int = 0) -> Iterator[Case]:
    """Draw `n` loops that a wave of a wandering period moves, one in three with a valve that sticks.

    Parameters
    ----------
    n : int
        Number of loops.
    seed : int
        Seed of everything that is random; each loop has its own, so that a longer population begins with a shorter one.

    Yields
    ------
    Case
        One loop after the other. One in three went through a historian, as in `population`.

    Examples
    --------
    >>> from calibration.populations import wandering_population
    >>> [case.cause for case in wandering_population(3, seed=1)]
    ['stiction', 'external disturbance', 'external disturbance']
    """

    def draw(rng: np.random.Generator, i: int) -> Case | None:
        cause = "external disturbance" if i % STICKY_ONE_IN else "stiction"
        return record_scenario(_plan(rng, sticky=cause == "stiction"), cause, rng, MAX_NOISE_SHARE, f"wander-{i:04d}")

    return sample_held_out(n, seed, WANDERS, draw)


def _plan(rng: np.random.Generator, *, sticky: bool) -> Scenario:
    """A loop and the wave that moves it."""
    drawn = sample_loop(rng, sticky=sticky)
    loop = drawn.loop
    period = log_uniform(rng, *PERIOD)
    every, n = sample_recording(rng, period) or (1, SAMPLES[0])
    shape, still = str(rng.choice(SHAPES)), np.zeros(n)
    series = wandering_wave(rng, shape, n, period, float(rng.uniform(*SPREAD)))
    of_pv = bool(rng.random() < OF_PV)
    gain = abs(complex(loop.process.at(2j * np.pi / (period * loop.dt))))
    plan = Scenario(
        loop, sp=still, load=still if of_pv else series, pv_load=gain * series if of_pv else still,
        kind=f"{shape} of the {'PV' if of_pv else 'load'}", every=every, period=period,
    )  # fmt: skip
    plan, size = scale_demand(rng, plan, drawn, float(rng.uniform(*SIZE)))
    return add_background(rng, replace(plan, load=size * plan.load, pv_load=size * plan.pv_load))


def wandering_wave(rng: np.random.Generator, shape: str, n: int, period: float, spread: float) -> NDArray[np.float64]:
    """Draw a wave of amplitude 1 each period of which has another length.

    Parameters
    ----------
    rng : numpy.random.Generator
        What it is drawn from.
    shape : str
        One of `SHAPES`.
    n : int
        Samples of the controller [-].
    period : float
        Median period [samples of the controller].
    spread : float
        Standard deviation of the logarithm of a period [-].

    Returns
    -------
    ndarray, shape (n,)
        The wave [-].
    """
    lengths = period * np.exp(rng.normal(0.0, spread, int(4.0 * n / period) + 8))
    ends = np.concatenate([[0.0], lengths.cumsum()]) - float(rng.random()) * lengths[0]
    turns = np.interp(np.arange(n), ends, np.arange(ends.size)) % 1.0
    if shape == "triangle":
        return 1.0 - 4.0 * np.abs(turns - 0.5)
    if shape == "sawtooth":
        return np.interp(turns, [0.0, float(rng.uniform(*RISE)), 1.0], [-1.0, 1.0, -1.0])
    if shape == "square":
        return np.interp(turns, [0.0, 0.08, 0.5, 0.58, 1.0], [-1.0, 1.0, 1.0, -1.0, -1.0])
    if shape == "charge":
        bend, half = float(rng.uniform(*BEND)), 2.0 * turns % 1.0
        way = 2.0 * np.expm1(-bend * half) / np.expm1(-bend) - 1.0
        return np.where(turns < 0.5, way, -way)
    cycle = upstream_cycle(rng)
    return np.interp(turns, np.linspace(0.0, 1.0, cycle.size), cycle)
