"""Mean of a signal over the cycles of an oscillation, by phase bins."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["PhaseMeans", "average_by_phase"]

MAX_PHASE_BINS = 48
"""Largest number of phase bins in a cycle; a cycle of fewer samples has fewer bins [-]."""


class PhaseMeans(NamedTuple):
    """Means of a signal in the phase bins of its cycles."""

    inside: NDArray[np.intp]
    """Samples of whole cycles of usual length, shape (n_inside,)."""
    phase: NDArray[np.float64]
    """Their phase, 0 to 1 [-]."""
    place: NDArray[np.intp]
    """Their phase bins."""
    means: NDArray[np.float64]
    """Mean of each phase bin, about the mean of all bins [unit of the signal]."""
    n_cycles: int
    """Number of these cycles."""

    def values(self) -> NDArray[np.float64]:
        """The mean cycle at the samples `inside`, shape (n_inside,)."""
        middles = (np.arange(-1, self.means.size + 1) + 0.5) / self.means.size
        return np.interp(self.phase, middles, np.concatenate((self.means[-1:], self.means, self.means[:1])))


def average_by_phase(x: NDArray[np.float64], band: NDArray[np.float64], samples_per_period: float) -> PhaseMeans:
    """Average a signal [any unit] by its phase in the cycles of another one; without a cycle all means are 0.

    Rises of `band` through zero begin the cycles; those that differ by half from `samples_per_period` are left out.
    """
    positive = band > 0.0
    at = np.flatnonzero(~positive[:-1] & positive[1:])
    begins = at + band[at] / (band[at] - band[at + 1])
    length = np.diff(begins)
    # The samples of a cycle are the first at or after its beginning, up to the next one.
    edges = np.ceil(begins).astype(np.intp)
    usual = np.abs(length / samples_per_period - 1.0) < 0.5
    count = np.diff(edges)
    inside = np.flatnonzero(np.repeat(usual, count)) + (edges[0] if edges.size else 0)
    count = np.where(usual, count, 0)
    phase = (inside - np.repeat(begins[:-1], count)) / np.repeat(length, count)
    places = max(4, min(MAX_PHASE_BINS, int(samples_per_period)))
    place = np.minimum((phase * places).astype(np.intp), places - 1)
    means = np.bincount(place, x[inside], places) / np.maximum(np.bincount(place, minlength=places), 1)
    return PhaseMeans(inside, phase, place, means - means.mean(), int(usual.sum()))
