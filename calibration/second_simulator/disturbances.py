"""Loads that act at the process input, one value per execution of the controller [% of span]."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["BACKGROUNDS", "WAVES", "background_load", "wave_load"]

BACKGROUNDS = ("random_walk", "arma", "filtered_steps")
WAVES = ("sine", "square", "neighbour")


def background_load(rng: np.random.Generator, n: int, time_scale: float) -> NDArray[np.float64]:
    """A load without a period, of standard deviation 1.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of chance.
    n : int
        Samples.
    time_scale : float
        Time over which the load changes [samples].

    Returns
    -------
    ndarray, shape (n,)
        A leaky random walk, an ARMA(1, 1) process, or steps that pass a lag.
    """
    from scipy.signal import lfilter

    kind = str(rng.choice(BACKGROUNDS))
    pole = float(np.exp(-1.0 / max(time_scale, 1.0)))
    if kind == "random_walk":
        load = lfilter([1.0], [1.0, -float(np.exp(-1.0 / max(10.0 * time_scale, 1.0)))], rng.normal(size=n))
    elif kind == "arma":
        load = lfilter([1.0, float(rng.uniform(-0.8, 0.8))], [1.0, -pole], rng.normal(size=n))
    else:
        jumps = rng.normal(size=n) * (rng.random(n) < 1.0 / (20.0 * max(time_scale, 1.0)))
        leaky = lfilter([1.0], [1.0, -float(np.exp(-1.0 / (100.0 * max(time_scale, 1.0))))], jumps)
        load = lfilter([1.0 - pole], [1.0, -pole], leaky)
    load = np.asarray(load) - np.mean(load)
    return load / max(float(load.std()), 1e-12)


def wave_load(rng: np.random.Generator, n: int, period: float) -> NDArray[np.float64]:
    """A periodic load of amplitude 1: a sine whose period drifts, a square wave, or a neighbour's limit cycle.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of chance.
    n : int
        Samples.
    period : float
        Period [samples].

    Returns
    -------
    ndarray, shape (n,)
        The load.
    """
    from scipy.signal import lfilter

    kind = str(rng.choice(WAVES, p=(0.5, 0.2, 0.3)))
    drift = float(rng.choice((0.0, 0.05, 0.15)))
    slow = background_load(rng, n, 5.0 * period) * drift
    phase = np.cumsum(2.0 * np.pi / period * np.exp(slow)) + float(rng.uniform(0.0, 2.0 * np.pi))
    if kind == "sine":
        return np.sin(phase)
    square = np.sign(np.sin(phase))
    if kind == "square":
        pole = float(np.exp(-1.0 / max(float(rng.uniform(0.0, 0.1)) * period, 0.1)))
        return np.asarray(lfilter([1.0 - pole], [1.0, -pole], square))
    # A neighbour that cycles between two levels reaches this loop through an integrating process and a lag.
    ramp = 2.0 / np.pi * np.arcsin(np.sin(phase))
    pole = float(np.exp(-1.0 / max(float(rng.uniform(0.02, 0.2)) * period, 0.1)))
    return np.asarray(lfilter([1.0 - pole], [1.0, -pole], ramp + float(rng.uniform(0.0, 0.6)) * square))
