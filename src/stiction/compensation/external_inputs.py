"""External inputs of a loop: set point changes, and disturbances of the PV.

The disturbances are the residual of the PV that valve and process do not explain: measurement noise, random load and
oscillations of other loops. A run of the twin uses the recorded series, from a random sample on, forward or backward
and with a random sign. That keeps spectrum and amplitude.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.compensation.replace_parts import replace_parts
from stiction.simulation import simulate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.models import Loop
    from stiction.records.record import LoopRecord

__all__ = ["ExternalInputs", "simulate_with_inputs"]


class ExternalInputs(NamedTuple):
    """Recorded external inputs."""

    sp_deviation: NDArray[np.float64]
    """Set point minus its mean [PV units], shape (n_samples,)."""
    pv_residual: NDArray[np.float64]
    """PV that valve and process do not explain [PV units], shape (n_samples,)."""
    dt: float
    """Sampling period [s]."""

    def sample(self, rng: np.random.Generator, n: int, dt: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return `n` samples of both, every `dt` [s], shape (n,) each."""
        step = dt / self.dt
        return _sample_series(self.sp_deviation, rng, n, step), _sample_series(self.pv_residual, rng, n, step)


def simulate_with_inputs(
    inputs: ExternalInputs | None,
    loop: Loop,
    sp: NDArray[np.float64],
    load: NDArray[np.float64],
    seed: int,
    pv_start: float,
    op_start: float,
) -> LoopRecord:
    """Simulate a loop with external inputs, or with its own noise when there are none.

    Parameters
    ----------
    inputs : ExternalInputs or None
        External inputs, which include the measurement noise.
    loop : Loop
        The loop.
    sp, load : ndarray, shape (n_samples,)
        Set point [PV units] and load [% of span] to which they are added.
    seed : int
        Seed of the random numbers.
    pv_start, op_start : float
        Operating point [PV units, % of span].

    Returns
    -------
    LoopRecord
        The simulated record.
    """
    if inputs is None:
        return simulate(loop, sp, sp.size * loop.dt, load, seed, pv_start=pv_start, op_start=op_start)
    sp_deviation, pv_residual = inputs.sample(np.random.default_rng([seed, 11]), sp.size, loop.dt)
    quiet = replace_parts(loop, noise=0.0)
    return simulate(
        quiet,
        sp + sp_deviation,
        sp.size * loop.dt,
        load,
        pv_disturbance=pv_residual,
        pv_start=pv_start,
        op_start=op_start,
    )


def _sample_series(x: NDArray[np.float64], rng: np.random.Generator, n: int, step: float) -> NDArray[np.float64]:
    """Return the series from a random sample on, forward and backward, every `step` samples, with a random sign."""
    last = x.size - 1
    if last < 1:
        return np.full(n, x[0])
    at = (float(rng.integers(0, 2 * last)) + step * np.arange(n)) % (2.0 * last)
    return float(rng.choice([-1.0, 1.0])) * np.interp(np.minimum(at, 2.0 * last - at), np.arange(x.size), x)
