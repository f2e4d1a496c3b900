"""Where the search looks: valves over (S, J / S), processes over lags and dead times."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.behind import best_behind
from stiction.diagnosis.identification.search import search, work_space

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.signals import Signals

__all__ = ["LONGEST_DELAY", "OF_RECORD", "Processes", "Surface", "dense_processes", "explore", "explore_behind", "near"]

LONGEST_DELAY, OF_RECORD = 0.45, 0.125
"""Longest dead time tried, as a share of the period, and of the record [-]."""


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
        with np.errstate(divide="ignore"):
            return np.exp(-1.0 / self.first), np.exp(-1.0 / self.second)


class Surface(NamedTuple):
    """What the search found for each valve; S and J span a grid, row by row."""

    S: NDArray[np.float64]
    """Values of S [% of span], shape (n_S,)."""
    ratio: NDArray[np.float64]
    """Values of J / S [-], shape (n_J,)."""
    error: NDArray[np.float64]
    """Share of the target's energy left by the best process [-], shape (n_S, n_J)."""
    gain: NDArray[np.float64]
    """Gain of that process [PV units per % of span, per sample where it integrates], shape (n_S, n_J)."""
    best: NDArray[np.float64]
    """Index of its lag pair, whole and fractional dead time [samples], shape (n_S, n_J, 3)."""
    processes: Processes
    """The candidates."""
    by_delay: NDArray[np.float64]
    """Share left by the best lag pair at each whole dead time [-], shape (n_S, n_J, n_delays); empty behind a stem."""


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
        The candidates.
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
    tau, second = float(processes.first[lag]), float(processes.second[lag])
    spread = 1.0 + 1.2 * closer
    step = int(np.max(np.diff(processes.delays), initial=1))
    reach = max(round(closer * step), 2)
    delays = np.arange(max(centre - reach, -1), centre + reach + 2)
    if np.isinf(tau):
        tails = np.concatenate([[0.0], max(second, 0.7) * np.geomspace(1.0 / spread, spread, 7)])
        pairs = [(np.inf, tail) for tail in tails]
        if integrating is None:
            pairs += [(slow, 0.0) for slow in np.max(processes.delays) * np.array([4.0, 8.0])]
        return _candidates(pairs, delays)
    lags = max(tau, 0.3) * np.geomspace(1.0 / spread, spread, 5)
    share = second / max(tau, 0.3)
    shares = np.array([0.0, 0.15, 0.4, 1.0])
    if share > 0.0:
        shares = np.append(share * np.geomspace(1.0 / spread, spread, 5), 0.0)
    pairs = [(0.0, 0.0)] if tau < 0.7 else []
    pairs += [(t, t * part) for t in lags for part in shares if part <= 1.01]
    return _candidates(pairs, delays)


def _candidates(pairs: list[tuple[float, float]], delays: NDArray[np.int64]) -> Processes:
    return Processes(np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs]), delays)


def explore(
    signals: Signals,
    S: NDArray[np.float64],
    ratio: NDArray[np.float64],
    processes: Processes,
    sign: float,
) -> Surface:
    """Try every (S, J / S) with every process candidate, on two threads.

    Parameters
    ----------
    signals : Signals
        What to compare.
    S, ratio : ndarray, shape (n_S,), (n_J,)
        The valves.
    processes : Processes
        The process candidates.
    sign : float
        Sign that the process gain must have; 0 for any.

    Returns
    -------
    Surface
        The error left by the best process for each valve.
    """
    n = signals.target.size
    first, second = processes.decays()
    delays, begin = processes.delays, _begin(signals, processes)
    shape, valves = (S.size, ratio.size), S.size * ratio.size
    band, jump = np.repeat(S, ratio.size), np.outer(S, ratio).ravel()
    left, gain, best = np.empty(valves), np.empty(valves), np.empty((valves, 3))
    by_delay = np.empty((valves, delays.size))

    def rows(part: slice) -> None:
        work = work_space(n, signals.half, first.size, delays, begin, band[part].size)
        search(
            signals.op, signals.thinned, signals.target, signals.half, band[part], jump[part], first, second,
            delays, begin, float(sign), left[part], gain[part], best[part], by_delay[part], work,
        )  # fmt: skip

    middle = valves // 2
    if valves * n * (first.size + 0.1 * first.size * delays.size) > 4e6:
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(rows, (slice(0, middle), slice(middle, valves))))
    else:
        rows(slice(0, valves))
    error, by_delay = (_shares(signals, begin, x) for x in (left, by_delay))
    places = best.reshape(*shape, 3), processes, by_delay.reshape(*shape, delays.size)
    return Surface(S, ratio, error.reshape(shape), gain.reshape(shape), *places)


def explore_behind(signals: Signals, stem: NDArray[np.float64], processes: Processes, sign: float) -> Surface:
    """Try every process candidate behind a stem that is known.

    Parameters
    ----------
    signals : Signals
        What to compare.
    stem : ndarray, shape of `op`
        Stem position [% of span].
    processes : Processes
        The process candidates.
    sign : float
        Sign that the process gain must have; 0 for any.

    Returns
    -------
    Surface
        A surface of one valve, whose S is 0: it follows the stem.
    """
    begin = _begin(signals, processes)
    seen = stem.reshape(-1, signals.thinned).mean(axis=1)
    left, gain, best = best_behind(
        seen, signals.target, signals.half, *processes.decays(), processes.delays, begin, float(sign)
    )
    error = _shares(signals, begin, np.array([[left]]))
    gains, place = np.array([[gain]]), best.reshape(1, 1, 3)
    return Surface(np.zeros(1), np.zeros(1), error, gains, place, processes, np.empty((1, 1, 0)))


def _begin(signals: Signals, processes: Processes) -> int:
    """First sample compared: where every answer has a local mean and, in a long record, has forgotten its start."""
    n, longest = signals.target.size, int(processes.delays[-1])
    begin = signals.half + longest + 2
    if n > 6.0 * signals.scale:
        begin += round(signals.scale)
    return min(begin, max(n // 3, longest + 2), max(n - signals.half - 1, 0))


def _shares(signals: Signals, begin: int, left: NDArray[np.float64]) -> NDArray[np.float64]:
    """What is left as a share of the target's energy; rounded, lest the unit of a signal decide a tie."""
    energy = float(np.sum(signals.target[begin : signals.target.size - signals.half] ** 2))
    return np.round(left / energy, 10) if energy > 0.0 else np.ones_like(left)
