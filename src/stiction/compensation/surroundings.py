"""What moves a loop from outside: the moves of its set point, and what valve and process leave of its PV.

What is left of the PV, in its own unit and at the process's output, is measurement noise, random load and the waves of
other loops together, each with the spectrum that it has. A run of the twin is moved by the record's own series, from
any sample on, forward or backward and with either sign: that leaves spectrum and size as they are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.compensation.exchange import exchange
from stiction.simulation import simulate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.models import Loop
    from stiction.records.record import LoopRecord

__all__ = ["Surroundings", "run_in"]


class Surroundings(NamedTuple):
    """Series from outside, as recorded."""

    moves: NDArray[np.float64]
    """Moves of the set point about its mean [PV units], shape (n_samples,)."""
    left: NDArray[np.float64]
    """What valve and process leave of the PV [PV units], shape (n_samples,)."""
    dt: float
    """Sampling period [s]."""

    def drawn(self, rng: np.random.Generator, n: int, dt: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Draw `n` samples of both, every `dt` [s], shape (n,) each."""
        return _played(self.moves, rng, n, dt / self.dt), _played(self.left, rng, n, dt / self.dt)


def run_in(
    around: Surroundings | None,
    loop: Loop,
    sp: NDArray[np.float64],
    load: NDArray[np.float64],
    seed: int,
    pv_start: float,
    op_start: float,
) -> LoopRecord:
    """Run a loop in its surroundings; without any, with its own noise.

    Parameters
    ----------
    around : Surroundings or None
        What moves it from outside, the noise of its PV included.
    loop : Loop
        The loop.
    sp, load : ndarray, shape (n_samples,)
        Set point [PV units] and load [% of span] that are added to them.
    seed : int
        Seed of what is random.
    pv_start, op_start : float
        Operating point [PV units, % of span].

    Returns
    -------
    LoopRecord
        The run, its set point included.
    """
    if around is None:
        return simulate(loop, sp, sp.size * loop.dt, load, seed, pv_start=pv_start, op_start=op_start)
    moves, left = around.drawn(np.random.default_rng([seed, 11]), sp.size, loop.dt)
    quiet = exchange(loop, noise=0.0)
    return simulate(
        quiet, sp + moves, sp.size * loop.dt, load, pv_disturbance=left, pv_start=pv_start, op_start=op_start
    )


def _played(x: NDArray[np.float64], rng: np.random.Generator, n: int, step: float) -> NDArray[np.float64]:
    """Forward and backward in turns from a random sample, `step` samples at a time, with a random sign."""
    last = x.size - 1
    if last < 1:
        return np.full(n, x[0])
    at = (float(rng.integers(0, 2 * last)) + step * np.arange(n)) % (2.0 * last)
    return float(rng.choice([-1.0, 1.0])) * np.interp(np.minimum(at, 2.0 * last - at), np.arange(x.size), x)
