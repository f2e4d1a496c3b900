"""What repeats with the cycle: the part of a series that is alike in cycle after cycle of another one.

What valve and process leave of the PV is moved from outside as far as it does not keep step with the loop's own cycle.
What keeps step is the model's error: were it played as a disturbance, it would go on when the cycle has been ended.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.oscillation import about_drift, smooth

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["locked_to"]

PLACES = 48
"""Places in a cycle; fewer where it has fewer samples [-]."""
FEWEST = 4
"""Cycles below which nothing is averaged [-]."""


def locked_to(op: NDArray[np.float64], x: NDArray[np.float64], samples: float) -> NDArray[np.float64]:
    """Mean of a series over the cycles of OP, laid out along them.

    Parameters
    ----------
    op, x : ndarray, shape (n_samples,)
        OP [% of span], and the series.
    samples : float
        Period of the cycle [samples].

    Returns
    -------
    ndarray, shape (n_samples,)
        What of `x` keeps step with OP; its chance share, one over the number of cycles, is left in `x`.

    Examples
    --------
    >>> t = np.arange(2000.0)
    >>> wave, other = np.sin(2 * np.pi * t / 50), np.sin(2 * np.pi * t / 31.7)
    >>> kept = locked_to(wave, 0.3 * wave + other, 50.0)
    >>> bool(np.std(kept - 0.3 * wave) < 0.2 * np.std(other))
    True
    """
    kept = np.zeros(x.size)
    wave = about_drift(smooth(op, samples / 4.0), samples)
    rises = np.flatnonzero((wave[:-1] <= 0.0) & (wave[1:] > 0.0))
    begins = rises + wave[rises] / (wave[rises] - wave[rises + 1])
    length = np.diff(begins)
    whole = np.abs(length / samples - 1.0) < 0.5
    if whole.sum() < FEWEST:
        return kept
    t = np.arange(x.size)
    cycle = np.clip(np.searchsorted(begins, t, side="right") - 1, 0, length.size - 1)
    phase = (t - begins[cycle]) / length[cycle]
    inside = (phase >= 0.0) & (phase < 1.0) & whole[cycle]
    places = max(4, min(PLACES, int(samples)))
    place = np.minimum((phase[inside] * places).astype(np.intp), places - 1)
    count = np.maximum(np.bincount(place, minlength=places), 1)
    mean = np.bincount(place, x[inside], places) / count
    mean -= mean.mean()
    # The mean of n cycles holds an n-th of the variance of what keeps no step: as much is not taken.
    rest = float(np.var(x[inside] - mean[place])) * places / inside.sum()
    share = max(1.0 - rest / max(float(np.mean(mean**2)), 1e-300), 0.0)
    middles = (np.arange(-1, places + 1) + 0.5) / places
    kept[inside] = share * np.interp(phase[inside], middles, np.concatenate((mean[-1:], mean, mean[:1])))
    return kept
