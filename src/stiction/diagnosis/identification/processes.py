"""Process candidates, which both searches try behind a stem, and what one of them answers to it."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.search import lag_pair
from stiction.diagnosis.identified import ProcessFit

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

__all__ = ["LONGEST_DELAY", "OF_RECORD", "Processes", "answer", "dense_processes", "in_seconds", "late_by_mean", "near"]

LONGEST_DELAY, OF_RECORD = 0.45, 0.125
"""Longest dead time tried, as a share of the period, and of the record [-]."""
TINY = float(np.finfo(float).tiny)
"""In place of no lag, that one divided by it is a number [samples]."""
FIVE, SEVEN = np.linspace(-1.0, 1.0, 5), np.linspace(-1.0, 1.0, 7)
"""Powers of the spread at which candidates lie about the best [-]."""


class Processes(NamedTuple):
    """Process candidates: every pair of lags with every dead time."""

    first: NDArray[np.float64]
    """First time constant [samples]; infinity integrates. Shape (n_lags,)."""
    second: NDArray[np.float64]
    """Second time constant [samples], shape (n_lags,)."""
    delays: NDArray[np.int64]
    """Dead time [samples]; -1 when the PV sees the stem within the sample. Shape (n_delays,), increasing."""

    def decays(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Decay per sample of the first and of the second lag; 1 integrates, 0 is no lag."""
        return np.exp(-1.0 / np.maximum(self.first, TINY)), np.exp(-1.0 / np.maximum(self.second, TINY))


@lru_cache(maxsize=16)
def dense_processes(
    scale: float, n_samples: int, integrating: bool | None, n_lags: int = 10, n_delays: int = 10
) -> Processes:
    """Process candidates for a first look, from no lag to an integrator.

    Parameters
    ----------
    scale : float
        Period of the oscillation, or another time scale of the record [samples].
    n_samples : int
        Length of the record [samples].
    integrating : bool or None
        Whether the process integrates; None looks at both kinds.
    n_lags, n_delays : int
        Number of lags and of dead times [-].

    Returns
    -------
    Processes
        The candidates, the same for stretches that are alike: not to be written to.
    """
    longest = min(LONGEST_DELAY * scale, OF_RECORD * n_samples)
    delays = np.unique(np.round(np.linspace(-1.0, max(longest, 2.0), n_delays)).astype(np.int64))
    if integrating:
        second = np.concatenate([[0.0], np.geomspace(0.02, 0.5, n_lags - 1) * scale])
        return Processes(np.full(n_lags, np.inf), second, delays)
    if integrating is None:
        lags = np.concatenate([[0.0], np.geomspace(0.7, max(scale, 2.0), n_lags - 2), [np.inf]])
    else:
        lags = np.concatenate([[0.0], np.geomspace(0.7, 2.0 * max(scale, 2.0), n_lags - 1)])
    return Processes(lags, np.zeros(lags.size), delays)


def near(processes: Processes, best: NDArray[np.float64], closer: float, integrating: bool | None) -> Processes:
    """Candidates about the `best` of `processes`: lags within a factor, second lags, neighbouring dead times.

    Parameters
    ----------
    processes : Processes
        The candidates searched before.
    best : ndarray, shape (3,)
        Index of the best lag pair among them, whole and fractional dead time [samples].
    closer : float
        Width of the new search as a share of the old one's steps [-].
    integrating : bool or None
        Whether the process integrates; None looks at both kinds.

    Returns
    -------
    Processes
        The new candidates, their dead times without gaps.
    """
    lag, centre = int(best[0]), int(best[1])
    tau, second, tried = float(processes.first[lag]), float(processes.second[lag]), processes.delays.tolist()
    spread = 1.0 + 1.2 * closer
    step = max((later - one for one, later in pairwise(tried)), default=1)
    reach = max(round(closer * step), 2)
    delays = np.arange(max(centre - reach, -1), centre + reach + 2)
    if math.isinf(tau):
        tails = [0.0, *(max(second, 0.7) * spread**SEVEN).tolist()]
        pairs = [(math.inf, tail) for tail in tails]
        if integrating is None:
            pairs += [(slow * tried[-1], 0.0) for slow in (4.0, 8.0)]
        return _candidates(pairs, delays)
    lags = (max(tau, 0.3) * spread**FIVE).tolist()
    share = second / max(tau, 0.3)
    shares = [*(share * spread**FIVE).tolist(), 0.0] if share > 0.0 else [0.0, 0.15, 0.4, 1.0]
    pairs = [(0.0, 0.0)] if tau < 0.7 else []
    pairs += [(t, t * part) for t in lags for part in shares if part <= 1.01]
    return _candidates(pairs, delays)


def _candidates(pairs: list[tuple[float, float]], delays: NDArray[np.int64]) -> Processes:
    first, second = zip(*pairs, strict=True)
    return Processes(np.array(first), np.array(second), delays)


def answer(mv: NDArray[np.float64], first: float, second: float, dead_time: float) -> NDArray[np.float64]:
    """Answer of one process with a gain of one to a stem about its mean.

    Parameters
    ----------
    mv : ndarray, shape (n_samples,)
        Stem position [% of span].
    first, second : float
        Time constants [samples]; infinity integrates, 0 is no lag.
    dead_time : float
        Dead time [samples]: between two whole ones the answer is a weighted mean of both; -1 answers within the sample.

    Returns
    -------
    ndarray, shape (n_samples,)
        The answer [% of span].
    """
    raw, whole = np.empty(mv.size), math.floor(dead_time)
    decay_1, decay_2 = (math.exp(-1.0 / lag) if lag > 0.0 else 0.0 for lag in (first, second))
    lag_pair(mv, float(mv.mean()), decay_1, decay_2, raw)
    part = dead_time - whole
    return (1.0 - part) * _later(raw, whole + 1) + part * _later(raw, whole + 2)


def _later(x: NDArray[np.float64], samples: int) -> NDArray[np.float64]:
    return x if samples == 0 else np.concatenate([np.full(samples, x[0]), x[:-samples]])


def in_seconds(process: Iterable[float], dt: float, width: int) -> ProcessFit:
    """Tell a process that was found in samples.

    Parameters
    ----------
    process : iterable of float
        Gain [PV units per % of span, of an integrating process per sample], first and second lag and dead time
        [samples]; the first lag of an integrating one is infinite.
    dt : float
        Time between two samples [s].
    width : int
        Samples of the record that each is the mean of.

    Returns
    -------
    ProcessFit
        The same in seconds.
    """
    gain, first, second, delay = (float(x) for x in process)
    integrating = math.isinf(first)
    return ProcessFit(
        gain=gain / (dt if integrating else 1.0),
        time_constant=(second if integrating else first + second) * dt,
        dead_time=max(delay + late_by_mean(width), 0.0) * dt,
        integrating=integrating,
        lag=0.0 if integrating else min(first, second) * dt,
    )


def late_by_mean(width: int) -> float:
    """What the answer to a mean over `width` samples, which speaks of their middle, is late by itself [means]."""
    return 0.5 * (1.0 - 1.0 / width)
