"""One stretch of a record: the dense search by simulation error, and the processes behind a sticky and a good valve."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.grid import Surface, explore, explore_behind
from stiction.diagnosis.identification.processes import answer, dense_processes, near
from stiction.diagnosis.identification.search import follow, remove_local_mean

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.signals import Signals

__all__ = ["Piece", "search_piece", "with_stem"]

N_S, N_J = 24, 10
"""Points of the dense search over S and J / S [-]: a map and a start, from which the closer search tells S."""


class Piece(NamedTuple):
    """What the searches of one stretch found."""

    signals: Signals
    """The stretch."""
    dense: Surface
    """The dense search."""
    linear: Surface
    """The good valve with its best process."""
    stem: NDArray[np.float64]
    """Stem of the sticky valve, sample by sample of OP [% of span], shape of `op`."""
    sticky: Surface
    """That stem with its best process; the dense search where nothing closer was done."""

    @property
    def error(self) -> float:
        """Share of the PV's energy that the sticky valve leaves [-]."""
        return float(self.sticky.error.min())

    @property
    def valve(self) -> tuple[float, float]:
        """S and J / S of the best valve of the dense search [% of span, -]."""
        i, j = _optimum(self.dense)
        return float(self.dense.S[i]), float(self.dense.ratio[j])

    @property
    def process(self) -> tuple[float, float, float, float]:
        """Gain, first and second time constant and dead time of its process, in samples where they are times."""
        return _process(self.sticky)

    @property
    def good(self) -> tuple[float, float, float, float]:
        """The same of the best process behind a good valve."""
        return _process(self.linear)

    def simulated(self) -> NDArray[np.float64]:
        """Answer of the process to the stem about its local mean, shape of `target`."""
        signals, sticky = self.signals, self.sticky
        n = signals.target.size
        out = np.empty(n)
        mv = self.stem.reshape(n, signals.thinned).mean(axis=1)
        i, j = _optimum(sticky)
        lag, whole, part = sticky.best[i, j]
        if lag < 0:
            return np.zeros(n)
        first, second, _ = sticky.processes
        raw = answer(mv, float(first[int(lag)]), float(second[int(lag)]), whole + part)
        remove_local_mean(raw, signals.half, out)
        return float(sticky.gain[i, j]) * out


def search_piece(signals: Signals, sign: float, integrating: bool | None, swing: float) -> Piece:
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

    Returns
    -------
    Piece
        The dense search and the good valve's.
    """
    dense = explore(
        signals,
        swing * np.arange(1, N_S + 1) / N_S,
        np.linspace(0.0, 1.0, N_J),
        dense_processes(signals.scale, signals.target.size, integrating),
        sign,
    )
    i, j = _optimum(dense)
    S, stem = float(dense.S[i]), np.empty(signals.op.size)
    follow(signals.op, S, S * float(dense.ratio[j]), stem)
    return Piece(signals, dense, _behind(signals, signals.op, sign, integrating), stem, dense)


def with_stem(piece: Piece, stem: NDArray[np.float64], sign: float, integrating: bool | None) -> Piece:
    """The piece with another stem and the best process behind that.

    Parameters
    ----------
    piece : Piece
        A stretch searched.
    stem : ndarray, shape of `op`
        Stem position [% of span].
    sign : float
        Sign that the process gain must have; 0 for any.
    integrating : bool or None
        Whether the process integrates; None looks at both kinds.

    Returns
    -------
    Piece
        The same stretch.
    """
    return piece._replace(stem=stem, sticky=_behind(piece.signals, stem, sign, integrating))


def _optimum(surface: Surface) -> tuple[int, int]:
    i, j = np.unravel_index(int(np.argmin(surface.error)), surface.error.shape)
    return int(i), int(j)


def _process(surface: Surface) -> tuple[float, float, float, float]:
    i, j = _optimum(surface)
    lag, whole, part = surface.best[i, j]
    first, second, _ = surface.processes
    return float(surface.gain[i, j]), float(first[int(lag)]), float(second[int(lag)]), float(whole + part)


def _behind(signals: Signals, stem: NDArray[np.float64], sign: float, integrating: bool | None) -> Surface:
    """The best linear process behind a stem, that of a good valve searched as carefully as that of a sticky one."""
    processes = dense_processes(signals.scale, signals.target.size, integrating, 20, 20)
    seen = stem.reshape(-1, signals.thinned).mean(axis=1)
    found = explore_behind(signals, seen, processes, sign)
    for closer in (1.0, 0.5, 0.2):
        finer = explore_behind(signals, seen, near(found.processes, found.best[0, 0], closer, integrating), sign)
        if finer.error[0, 0] < found.error[0, 0]:
            found = finer
    return found
