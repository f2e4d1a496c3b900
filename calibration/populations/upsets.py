"""Loops that rest until something upsets them: loads that step, ramp or come in pulses, and nothing much in between.

`population` moves its loops by loads that wander, or by one event. A loop that is quiet but for a batch that begins
every ten minutes, a pump that is switched or a neighbour's set point has a PV of noise alone most of the time, and
moves of many times that noise now and then. What predicts it best in the quiet does not after an upset, and that may
pass for a sticky valve. All ranges were written down before a loop was counted, and none was changed by the counts.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from calibration.populations.causes import SAMPLES
from calibration.populations.demand import MAX_NOISE_SHARE, STICKY_ONE_IN, sample_loop, scale_demand
from calibration.populations.draw import record_scenario, sample_held_out
from calibration.populations.loads import lagged_noise, steps
from calibration.populations.processes import log_uniform
from calibration.populations.scenario import Scenario

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from calibration.populations.case import Case

__all__ = ["upset_population", "upset_series"]

UPSET = 7
"""What the seed of a loop is followed by, so that none of these loops is drawn like one of `population`."""
APART = (40.0, 600.0)
"""Fewest and most samples of the record from one upset to the next, on average [-]."""
LASTS = (5.0, 100.0)
"""Fewest and most samples that a pulse lasts [-]."""
SIZE = (0.5, 5.0)
"""Smallest and largest upset of a loop with a good valve [% of span]."""
OF_SET_POINT, QUIET = 0.15, 0.5
"""How often the set point is moved and not the load, and how often nothing else moves the loop [-]."""
BETWEEN = (0.01, 0.2)
"""Random load between the upsets, over their size [-]."""


def upset_population(n: int, seed: int = 0) -> Iterator[Case]:
    """Draw `n` loops that loads or set points upset now and then, one in three with a valve that sticks.

    Parameters
    ----------
    n : int
        Number of loops.
    seed : int
        Seed of everything that is random; each loop has its own, so that a longer population begins with a shorter one.

    Yields
    ------
    Case
        One loop after the other; their period is not known. One in three went through a historian, as in `population`.

    Examples
    --------
    >>> from calibration.populations import upset_population
    >>> [case.cause for case in upset_population(3, seed=1)]
    ['stiction', 'none', 'none']
    """

    def draw(rng: np.random.Generator, i: int) -> Case | None:
        cause = "none" if i % STICKY_ONE_IN else "stiction"
        return record_scenario(_plan(rng, sticky=cause == "stiction"), cause, rng, MAX_NOISE_SHARE, f"upset-{i:04d}")

    return sample_held_out(n, seed, UPSET, draw)


def _plan(rng: np.random.Generator, *, sticky: bool) -> Scenario:
    """A loop and what upsets it."""
    drawn = sample_loop(rng, sticky=sticky)
    loop = drawn.loop
    every = int(rng.choice([1, 1, 1, 2, 5]))
    n = every * int(log_uniform(rng, *SAMPLES))
    shape = str(rng.choice(["steps", "pulses", "ramps"]))
    series, still = upset_series(rng, shape, n, every), np.zeros(n)
    between = 0.0 if rng.random() < QUIET else log_uniform(rng, *BETWEEN)
    wander = between * lagged_noise(rng, n, log_uniform(rng, 2.0, 200.0) * every)
    of_set_point = bool(rng.random() < OF_SET_POINT)
    gain = abs(complex(loop.process.at(2j * np.pi / (100.0 * loop.dt))))
    plan = Scenario(
        loop, sp=gain * series if of_set_point else still, load=wander if of_set_point else series + wander,
        pv_load=still, kind=f"{shape} of the {'set point' if of_set_point else 'load'}", every=every,
        random_load=between,
    )  # fmt: skip
    plan, size = scale_demand(rng, plan, drawn, log_uniform(rng, *SIZE))
    return replace(plan, load=size * plan.load, sp=size * plan.sp, random_load=size * between)


def upset_series(rng: np.random.Generator, shape: str, n: int, every: int) -> NDArray[np.float64]:
    """Draw upsets of a size of up to 1.

    Parameters
    ----------
    rng : numpy.random.Generator
        What they are drawn from.
    shape : str
        `steps` between levels that are held, `ramps` from level to level, or `pulses`, with nothing in between.
    n : int
        Samples of the controller [-].
    every : int
        Of these to one of the record [-].

    Returns
    -------
    ndarray, shape (n,)
        The upsets [-].
    """
    apart = every * log_uniform(rng, *APART)
    if shape == "steps":
        return steps(rng, n, apart)
    if shape == "ramps":
        corners = np.concatenate([[0.0], np.cumsum(rng.exponential(apart, int(2.0 * n / apart) + 4))])
        return np.interp(np.arange(n), corners, rng.uniform(-1.0, 1.0, corners.size))
    series = np.zeros(n)
    for first in np.flatnonzero(rng.random(n) < 1.0 / apart):
        series[first : first + int(every * log_uniform(rng, *LASTS))] = rng.uniform(-1.0, 1.0)
    return series
