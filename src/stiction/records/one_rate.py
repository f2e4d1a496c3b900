"""OP and PV stored at two rates: one held for a fixed count of samples, the other new in each.

A value that is held for the export and not by the controller looks like a transmitter that hangs, and what moves in
between like a disturbance. Both are what the controller saw where the slower one is new, and only there, but that its
law may tell what was between (`diagnosis.identification.restored`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Slower", "slower_of"]

FEWEST_RUNS, EVENLY = 20, 0.8
"""Stored values without which no rate is seen, and the share of them that come a multiple of that rate apart [-]: where
one is missing the next sample shows the new value."""
MOVES = 0.5
"""Share of the samples in which one is held beyond which the other moves [-]."""


class Slower(NamedTuple):
    """Which of OP and PV is stored less often."""

    name: str
    """OP or PV."""
    every: int
    """Samples that it is held for [-]."""
    first: int
    """First sample of the record at which it is new, as it is every `every` samples from there."""


def slower_of(op: NDArray[np.float64], pv: NDArray[np.float64]) -> Slower | None:
    """Find the one that is held while the other moves.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output [% of span]; NaN where it is missing.
    pv : ndarray, shape (n_samples,)
        Process variable [engineering units]; NaN where it is missing.

    Returns
    -------
    Slower or None
        None where both are stored equally often, or too seldom to tell.

    Examples
    --------
    >>> import numpy as np
    >>> k = np.arange(200)
    >>> slower_of(np.sin(k / 9.0), np.cos((k - k % 4) / 9.0))
    Slower(name='PV', every=4, first=0)
    """
    moved = {"OP": _moved(op), "PV": _moved(pv)}
    for name, other in (("PV", "OP"), ("OP", "PV")):
        new, rests = np.flatnonzero(moved[name]) + 1, ~moved[name]
        if new.size <= FEWEST_RUNS or np.count_nonzero(moved[other] & rests) <= MOVES * np.count_nonzero(rests):
            continue
        # A coarse value is often stored again as it was: the rate is then a part of the time that it rests.
        for every in range(int(np.median(np.diff(new))), 1, -1):
            counts = np.bincount(new % every)
            if counts.max() >= EVENLY * new.size:
                return Slower(name, every, int(counts.argmax()))
    return None


def _moved(x: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether each value differs from the last one that was recorded before it, shape (n_samples - 1,)."""
    last = np.maximum.accumulate(np.where(np.isfinite(x), np.arange(x.size), 0))
    return np.diff(x[last]) != 0.0
