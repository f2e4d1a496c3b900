"""Average a series over the cycles of OP, to find the part that repeats with the oscillation.

Valve and process models leave a residual of the PV. The part of it that repeats with the oscillation is model error.
The rest is an external disturbance. Model error must not be simulated as a disturbance: it would go on after a remedy
has stopped the oscillation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.oscillation.phase_average import average_by_phase
from stiction.diagnosis.oscillation.signals import about_drift, smooth

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["periodic_part"]

MIN_CYCLES = 4
"""Smallest number of cycles that are averaged [-]."""


def periodic_part(op: NDArray[np.float64], x: NDArray[np.float64], samples: float) -> NDArray[np.float64]:
    """Return the part of a series that repeats with the cycles of OP.

    `op`, `x`: OP [% of span] and the series [any unit]. `samples`: period of the cycle [samples]. Returns the mean of
    `x` over the cycles, repeated in each cycle, reduced by the share that noise adds to such a mean.

    Examples
    --------
    >>> t = np.arange(2000.0)
    >>> wave, other = np.sin(2 * np.pi * t / 50), np.sin(2 * np.pi * t / 31.7)
    >>> periodic = periodic_part(wave, 0.3 * wave + other, 50.0)
    >>> bool(np.std(periodic - 0.3 * wave) < 0.2 * np.std(other))
    True
    """
    periodic = np.zeros(x.size)
    wave = about_drift(smooth(op, samples / 4.0), samples)
    found = average_by_phase(x, wave, samples)
    if found.n_cycles < MIN_CYCLES:
        return periodic
    # The mean of n cycles contains 1 / n of the variance of the part that does not repeat; this share is removed.
    rest = float(np.var(x[found.inside] - found.means[found.place])) * found.means.size / found.inside.size
    share = max(1.0 - rest / max(float(np.mean(found.means**2)), 1e-300), 0.0)
    periodic[found.inside] = share * found.values()
    return periodic
