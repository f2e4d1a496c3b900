"""One stretch of a record searched: dense, then fine, then close about several valleys, and the best good valve."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.grid import Processes, Surface, dense_processes, explore, near
from stiction.diagnosis.identification.search import follow, lag_pair, remove_local_mean

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.signals import Signals

__all__ = ["Piece", "search_piece"]

N_S, N_J = 30, 30
"""Points of the dense search over S and J / S."""
FINE_STEP, N_FINE_J = 0.013, 36
"""Relative step of the fine search over S [-], and its points over J / S."""
PROMISING = 1200
"""Valves of the fine search that are tried [-]."""
N_VALLEYS, N_J_VALLEYS = 8, 3
"""Bands of S and of J / S from each of which the search may go closer."""
STAGES = ((1.0, 8), (0.4, 4), (0.15, 4))
"""Width of each closer search, in steps of the fine one, and how many valleys it follows."""


class Piece(NamedTuple):
    """What the searches of one stretch found."""

    signals: Signals
    """The stretch."""
    found: list[Surface]
    """All searches; the dense one is the first."""
    linear: Surface
    """The good valve with its best process."""

    @property
    def closest(self) -> Surface:
        """The search that came closest."""
        return min(self.found, key=lambda surface: float(surface.error.min()))

    @property
    def error(self) -> float:
        """Share of the PV's energy that the best sticky valve leaves [-]."""
        return float(self.closest.error.min())

    @property
    def valve(self) -> tuple[float, float]:
        """S and J / S of the best valve [% of span, -]."""
        i, j = _optimum(self.closest)
        return float(self.closest.S[i]), float(self.closest.ratio[j])

    @property
    def process(self) -> tuple[float, float, float, float]:
        """Gain, first and second time constant and dead time of its process, in samples where they are times."""
        return _process(self.closest)

    @property
    def good(self) -> tuple[float, float, float, float]:
        """The same of the best process behind a good valve."""
        return _process(self.linear)

    def simulated(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Stem position, shape of `op`, and answer of the process about its local mean, shape of `target`."""
        signals = self.signals
        n = signals.target.size
        stem, raw, out = np.empty(signals.op.size), np.empty(n), np.empty(n)
        S, ratio = self.valve
        follow(signals.op, S, S * ratio, *self.closest.start, stem)
        mv = stem.reshape(n, signals.thinned).mean(axis=1)
        i, j = _optimum(self.closest)
        lag, whole, part = self.closest.best[i, j]
        if lag < 0:
            return stem, np.zeros(n)
        first, second = self.closest.processes.decays()
        lag_pair(mv, float(mv.mean()), first[int(lag)], second[int(lag)], raw)
        raw = (1.0 - part) * _shifted(raw, int(whole) + 1) + part * _shifted(raw, int(whole) + 2)
        remove_local_mean(raw, signals.half, out)
        return stem, float(self.closest.gain[i, j]) * out


def search_piece(
    signals: Signals, sign: float, integrating: bool | None, swing: float, *, closer: bool = True
) -> Piece:
    """Search one stretch.

    Parameters
    ----------
    signals : Signals
        The stretch.
    sign : float
        Sign that the process gain must have; 0 for any.
    integrating : bool or None
        Whether the process integrates; None looks at both kinds.
    swing : float
        Largest S to look for [% of span].
    closer : bool
        Go on from the dense search to the fine ones.

    Returns
    -------
    Piece
        All searches and the good valve's.
    """
    dense = explore(
        signals,
        swing * np.arange(1, N_S + 1) / N_S,
        np.linspace(0.0, 1.0, N_J),
        dense_processes(signals.scale, signals.target.size, integrating),
        sign,
    )
    found = _closer(signals, dense, sign, integrating, swing) if closer else [dense]
    return Piece(signals, found, _linear(signals, sign, integrating))


def _optimum(surface: Surface) -> tuple[int, int]:
    i, j = np.unravel_index(int(np.argmin(surface.error)), surface.error.shape)
    return int(i), int(j)


def _process(surface: Surface) -> tuple[float, float, float, float]:
    i, j = _optimum(surface)
    lag, whole, part = surface.best[i, j]
    first, second, _ = surface.processes
    return float(surface.gain[i, j]), float(first[int(lag)]), float(second[int(lag)]), float(whole + part)


def _closer(signals: Signals, dense: Surface, sign: float, integrating: bool | None, swing: float) -> list[Surface]:
    """Search the whole (S, J / S) plane again with few processes, then the best region with richer ones.

    A noisy OP makes the error surface rugged: a slip comes when the noise carries the OP over the band, so a
    band that is wrong by a few per cent slips at other moments. The true valve is a narrow dip, which only
    steps of about a per cent can find; the process is known well enough from the dense search to try few. Where
    the stem stands when the record begins is not known either: the middle of its band is tried, and what it
    would be had the stem moved until OP turned, up or down.
    """
    least = 0.25 * swing
    steps = int(np.ceil(np.log(swing / least) / np.log1p(FINE_STEP)))
    S = np.geomspace(least, swing, steps)
    ratio, few = np.linspace(0.0, 1.0, N_FINE_J), _few(dense)
    only = _promising(dense, S, ratio)
    found = [dense]
    found += [explore(signals, S, ratio, few, sign, start, only) for start in ((0, 0.0), *signals.turns)]
    valleys = _valleys(found, np.geomspace(least, swing, N_VALLEYS + 1)[1:])
    for closer, keep in STAGES:
        valleys = sorted(valleys, key=lambda valley: float(valley[0].error[valley[1:]]))[:keep]
        for n, (surface, i, j) in enumerate(valleys):
            width = closer * np.linspace(-2.0, 2.0, 9)
            ratio = np.unique(np.clip(surface.ratio[j] + width / N_FINE_J, 0.0, 1.0))
            processes = near(surface.processes, surface.best[i, j], closer, integrating)
            finer = explore(signals, surface.S[i] * (1.0 + FINE_STEP * width), ratio, processes, sign, surface.start)
            found.append(finer)
            place = _optimum(finer)
            if finer.error[place] < surface.error[i, j]:
                valleys[n] = (finer, *place)
    return found


def _promising(dense: Surface, S: NDArray[np.float64], ratio: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether a valve (S, J / S) lies in one of the best cells of the dense search or beside one."""
    error = np.pad(dense.error, 1, mode="edge")
    n_S, n_J = dense.error.shape
    about = np.min([error[i : i + n_S, j : j + n_J] for i in range(3) for j in range(3)], axis=0)
    rows = np.abs(S[:, np.newaxis] - dense.S).argmin(axis=1)
    columns = np.abs(ratio[:, np.newaxis] - dense.ratio).argmin(axis=1)
    there = about[np.ix_(rows, columns)]
    return there <= np.partition(there, min(PROMISING, there.size) - 1, axis=None)[min(PROMISING, there.size) - 1]


def _valleys(found: list[Surface], ends: NDArray[np.float64]) -> list[tuple[Surface, int, int]]:
    """The best valve in each band of S up to `ends` and of J / S, in whichever search.

    The error has valleys along which S and dead time trade, and others along which J and the gain do.
    """
    best: dict[tuple[int, int], tuple[Surface, int, int]] = {}
    for surface in found:
        rows = np.minimum(np.searchsorted(ends, surface.S * (1.0 - 1e-9)), ends.size - 1)
        columns = np.minimum((surface.ratio * N_J_VALLEYS).astype(int), N_J_VALLEYS - 1)
        for band in np.unique(rows):
            for part in range(N_J_VALLEYS):
                i_, j_ = np.flatnonzero(rows == band), np.flatnonzero(columns == part)
                error = surface.error[i_[0] : i_[-1] + 1, j_[0] : j_[-1] + 1]
                i, j = np.unravel_index(int(np.argmin(error)), error.shape)
                known = best.get((int(band), part))
                if known is None or error[i, j] < known[0].error[known[1:]]:
                    best[int(band), part] = (surface, int(i_[i]), int(j_[j]))
    return list(best.values())


def _few(dense: Surface) -> Processes:
    """The lag pairs of the best valves of the dense search, and all dead times about theirs."""
    order = np.argsort(dense.error, axis=None)[:12]
    best = dense.best.reshape(-1, 3)[order]
    lags = np.unique(best[:, 0].astype(int))[:4]
    low, high = int(best[:, 1].min()), int(best[:, 1].max())
    delays = np.unique(np.linspace(max(low - 1, -1), high + 2, 7).astype(np.int64))
    return Processes(dense.processes.first[lags], dense.processes.second[lags], delays)


def _linear(signals: Signals, sign: float, integrating: bool | None) -> Surface:
    """The best linear process behind a good valve, searched as carefully as the sticky one."""
    nothing, one = np.zeros(1), np.zeros(1)
    found = explore(
        signals, nothing, one, dense_processes(signals.scale, signals.target.size, integrating, 20, 20), sign
    )
    for closer in (1.0, 0.5, 0.2):
        processes = near(found.processes, found.best[0, 0], closer, integrating)
        finer = explore(signals, nothing, one, processes, sign)
        if finer.error[0, 0] < found.error[0, 0]:
            found = finer
    return found


def _shifted(x: NDArray[np.float64], samples: int) -> NDArray[np.float64]:
    return x if samples == 0 else np.concatenate([np.full(samples, x[0]), x[:-samples]])
