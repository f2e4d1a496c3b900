"""Average a series over the cycles of OP, to find the part that repeats with the oscillation.

Valve and process models leave a residual of the PV. The part of it that repeats with the oscillation is model error.
The rest is an external disturbance. Model error must not be simulated as a disturbance: it would go on after a remedy
has stopped the oscillation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.oscillation import about_drift, smooth

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["periodic_part"]

MAX_PHASE_BINS = 48
"""Largest number of phase bins in a cycle [-]."""
MIN_CYCLES = 4
"""Smallest number of cycles that are averaged [-]."""


def periodic_part(op: NDArray[np.float64], x: NDArray[np.float64], samples: float) -> NDArray[np.float64]:
    """Return the part of a series that repeats with the cycles of OP.

    Parameters
    ----------
    op, x : ndarray, shape (n_samples,)
        OP [% of span] and the series [any unit].
    samples : float
        Period of the cycle [samples].

    Returns
    -------
    ndarray, shape (n_samples,)
        The mean of `x` over the cycles, repeated in each cycle, reduced by the share that noise adds to such a mean.

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
    rises = np.flatnonzero((wave[:-1] <= 0.0) & (wave[1:] > 0.0))
    begins = rises + wave[rises] / (wave[rises] - wave[rises + 1])
    length = np.diff(begins)
    whole = np.abs(length / samples - 1.0) < 0.5
    if whole.sum() < MIN_CYCLES:
        return periodic
    t = np.arange(x.size)
    cycle = np.clip(np.searchsorted(begins, t, side="right") - 1, 0, length.size - 1)
    phase = (t - begins[cycle]) / length[cycle]
    inside = (phase >= 0.0) & (phase < 1.0) & whole[cycle]
    places = max(4, min(MAX_PHASE_BINS, int(samples)))
    place = np.minimum((phase[inside] * places).astype(np.intp), places - 1)
    count = np.maximum(np.bincount(place, minlength=places), 1)
    mean = np.bincount(place, x[inside], places) / count
    mean -= mean.mean()
    # The mean of n cycles contains 1 / n of the variance of the part that does not repeat; this share is removed.
    rest = float(np.var(x[inside] - mean[place])) * places / inside.sum()
    share = max(1.0 - rest / max(float(np.mean(mean**2)), 1e-300), 0.0)
    middles = (np.arange(-1, places + 1) + 0.5) / places
    periodic[inside] = share * np.interp(phase[inside], middles, np.concatenate((mean[-1:], mean, mean[:1])))
    return periodic
