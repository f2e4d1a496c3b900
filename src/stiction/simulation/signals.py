"""Test signals for valves and loops, each a series of one value per sample.

All signals take the sampling period `dt` [s] last but for the seed, levels are in % of span (or in the units of
whatever they are added to), and lengths are rounded to whole samples; no more than `errors.MAX_SAMPLES` are made.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import (
    ParameterError,
    as_floats,
    require_finite,
    require_not_negative,
    require_positive,
    require_samples,
    require_seed,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["binary_sequence", "ramp", "random_walk", "sine", "staircase", "triangle"]


def ramp(start: float, stop: float, rate: float, dt: float) -> NDArray[np.float64]:
    """Ramp from one level to another.

    Parameters
    ----------
    start, stop : float
        First and last level [% of span].
    rate : float
        Speed [% of span / s], more than 0 in either direction.
    dt : float
        Sampling period [s].

    Returns
    -------
    ndarray, shape (n_samples,)
        The levels; the last sample is `stop` even where the rate does not meet it.

    Raises
    ------
    ParameterError
        When `rate` or `dt` is not positive.

    Examples
    --------
    >>> from stiction.simulation.signals import ramp
    >>> ramp(50.0, 52.0, rate=0.5, dt=1.0).tolist()
    [50.0, 50.5, 51.0, 51.5, 52.0]
    """
    start, stop = require_finite("start", start, "% of span"), require_finite("stop", stop, "% of span")
    rate, dt = require_positive("rate", rate, "%/s"), require_positive("dt", dt, "s")
    require_samples("the ramp", abs(stop - start) / rate, dt)
    step = rate * dt
    n = int(np.ceil(abs(stop - start) / step * (1.0 - 1e-12)))
    levels = start + (step if stop > start else -step) * np.arange(n + 1, dtype=np.float64)
    levels[-1] = stop
    return levels


def triangle(
    mean: float, amplitude: float, period: float, duration: float, dt: float, *, upwards: bool = True
) -> NDArray[np.float64]:
    """Triangular wave, the signal of a valve test by ramps.

    Parameters
    ----------
    mean : float
        Level it starts from and swings about [% of span].
    amplitude : float
        Half of its peak to peak [% of span].
    period, duration : float
        Period and length [s].
    dt : float
        Sampling period [s].
    upwards : bool
        Whether it rises first.

    Returns
    -------
    ndarray, shape (n_samples,)
        The levels.

    Raises
    ------
    ParameterError
        When a time is not positive or `amplitude` is negative.

    Examples
    --------
    >>> from stiction.simulation.signals import triangle
    >>> triangle(50.0, 2.0, period=8.0, duration=9.0, dt=1.0).tolist()
    [50.0, 51.0, 52.0, 51.0, 50.0, 49.0, 48.0, 49.0, 50.0]
    """
    mean, amplitude = require_finite("mean", mean), require_not_negative("amplitude", amplitude, "% of span")
    turns = _time(duration, dt) / require_positive("period", period, "s")
    wave = 1.0 - 4.0 * np.abs((turns + 0.25) % 1.0 - 0.5)
    return mean + (amplitude if upwards else -amplitude) * wave


def sine(
    mean: float, amplitude: float, period: float, duration: float, dt: float, *, phase: float = 0.0
) -> NDArray[np.float64]:
    """Sine wave.

    Parameters
    ----------
    mean : float
        Level it swings about [% of span].
    amplitude : float
        Half of its peak to peak [% of span].
    period, duration : float
        Period and length [s].
    dt : float
        Sampling period [s].
    phase : float
        Phase at the first sample [rad].

    Returns
    -------
    ndarray, shape (n_samples,)
        The levels.

    Raises
    ------
    ParameterError
        When a time is not positive or `amplitude` is negative.

    Examples
    --------
    >>> from stiction.simulation.signals import sine
    >>> sine(50.0, 2.0, period=4.0, duration=4.0, dt=1.0).round(9).tolist()
    [50.0, 52.0, 50.0, 48.0]
    """
    mean, amplitude = require_finite("mean", mean), require_not_negative("amplitude", amplitude, "% of span")
    turns = _time(duration, dt) / require_positive("period", period, "s")
    return mean + amplitude * np.sin(2.0 * np.pi * turns + require_finite("phase", phase, "rad"))


def staircase(levels: Sequence[float] | NDArray[np.float64], hold: float, dt: float) -> NDArray[np.float64]:
    """Staircase, each level held: the signal of a valve test by steps.

    Parameters
    ----------
    levels : sequence of float
        Levels in their order [% of span].
    hold : float
        How long each is held [s], at least one sample.
    dt : float
        Sampling period [s].

    Returns
    -------
    ndarray, shape (n_samples,)
        The levels.

    Raises
    ------
    ParameterError
        When a level is not a finite number, or `hold` is shorter than one sample.

    Examples
    --------
    >>> from stiction.simulation.signals import staircase
    >>> staircase([50.0, 50.5, 50.0], hold=2.0, dt=1.0).tolist()
    [50.0, 50.0, 50.5, 50.5, 50.0, 50.0]
    """
    try:
        series = np.atleast_1d(as_floats(levels))
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"levels must be a series of numbers, got {levels!r}.") from None
    if series.ndim != 1 or not np.all(np.isfinite(series)):
        raise ParameterError("levels must be a series of finite numbers in % of span.")
    n = _samples("hold", hold, dt)
    require_samples("the steps together", series.size * hold, dt)
    return np.repeat(series, n)


def random_walk(
    start: float, spread: float, duration: float, dt: float, *, seed: int | None = None
) -> NDArray[np.float64]:
    """Random walk: steps from a normal distribution, added up.

    Parameters
    ----------
    start : float
        First level [% of span].
    spread : float
        Standard deviation of the change over one second [% of span]; over t seconds it grows by the root of t,
        whatever the sampling period.
    duration : float
        Length [s].
    dt : float
        Sampling period [s].
    seed : int, optional
        Seed; without one each call draws its own walk.

    Returns
    -------
    ndarray, shape (n_samples,)
        The levels.

    Raises
    ------
    ParameterError
        When a time is not positive or `spread` is negative.

    Examples
    --------
    >>> from stiction.simulation.signals import random_walk
    >>> walk = random_walk(50.0, 0.3, duration=100.0, dt=1.0, seed=1)
    >>> walk.shape, float(walk[0])
    ((100,), 50.0)
    """
    start = require_finite("start", start, "% of span")
    spread = require_not_negative("spread", spread, "% of span")
    n = _samples("duration", duration, dt)
    steps = np.random.default_rng(require_seed(seed)).normal(0.0, spread * dt**0.5, n)
    steps[0] = start
    return np.cumsum(steps)


def binary_sequence(
    low: float, high: float, hold: float, duration: float, dt: float, *, seed: int | None = None
) -> NDArray[np.float64]:
    """Pseudo-random binary sequence: one of two levels, drawn anew after each hold.

    Parameters
    ----------
    low, high : float
        The two levels [% of span].
    hold : float
        Shortest time at a level [s], at least one sample.
    duration : float
        Length [s].
    dt : float
        Sampling period [s].
    seed : int, optional
        Seed; without one each call draws its own sequence.

    Returns
    -------
    ndarray, shape (n_samples,)
        The levels.

    Raises
    ------
    ParameterError
        When `low` is not below `high`, or a time is shorter than one sample.

    Examples
    --------
    >>> from stiction.simulation.signals import binary_sequence
    >>> binary_sequence(48.0, 52.0, hold=2.0, duration=6.0, dt=1.0, seed=3).tolist()
    [52.0, 52.0, 48.0, 48.0, 48.0, 48.0]
    """
    low, high = require_finite("low", low, "% of span"), require_finite("high", high, "% of span")
    if not low < high:
        raise ParameterError(f"low = {low:g} % is not below high = {high:g} %; give two levels in this order.")
    n, per_level = _samples("duration", duration, dt), _samples("hold", hold, dt)
    drawn = np.random.default_rng(require_seed(seed)).integers(0, 2, -(-n // per_level))
    return np.repeat(np.array([low, high])[drawn], per_level)[:n]


def _samples(name: str, length: float, dt: float) -> int:
    """Whole samples of a length of time."""
    length, dt = require_positive(name, length, "s"), require_positive("dt", dt, "s")
    require_samples(name, length, dt)
    n = round(length / dt)
    if n < 1:
        raise ParameterError(f"{name} = {length:g} s is shorter than one sample of {dt:g} s; make it longer.")
    return n


def _time(duration: float, dt: float) -> NDArray[np.float64]:
    """Time of each sample [s], shape (n_samples,)."""
    return np.arange(_samples("duration", duration, dt), dtype=np.float64) * dt
