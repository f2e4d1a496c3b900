"""The dense search: every valve over (S, J / S) before every process candidate, and the processes behind one stem."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.behind import best_behind
from stiction.diagnosis.identification.search import search, work_space

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.processes import Processes
    from stiction.diagnosis.identification.signals import Signals

__all__ = ["Surface", "explore", "explore_behind"]

MUCH = 4e6
"""Valves times samples times lags, a dead time counting a tenth of a lag, beyond which two threads share the search
[-]: it then takes longer than their start."""


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
    if valves * n * (first.size + 0.1 * first.size * delays.size) > MUCH:
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(rows, (slice(0, middle), slice(middle, valves))))
    else:
        rows(slice(0, valves))
    error, by_delay = (_shares(signals, begin, x) for x in (left, by_delay))
    places = best.reshape(*shape, 3), processes, by_delay.reshape(*shape, delays.size)
    return Surface(S, ratio, error.reshape(shape), gain.reshape(shape), *places)


def explore_behind(signals: Signals, seen: NDArray[np.float64], processes: Processes, sign: float) -> Surface:
    """Try every process candidate behind a stem that is known.

    Parameters
    ----------
    signals : Signals
        What to compare.
    seen : ndarray, shape of `target`
        Stem position, its mean over each sample of the target [% of span].
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
