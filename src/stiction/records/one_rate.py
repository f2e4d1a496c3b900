"""One of OP and PV stored seldom, the other at every sample: held or drawn as lines between its stored values.

A value that is held for the export and not by the controller looks like a transmitter that hangs, and what moves in
between like a disturbance. Both are what the controller saw where the slower one is new, and only there, but that its
law may tell what was between (`diagnosis.identification.restored`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.records.storage import lattice

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Slower", "slower_of", "unevenly_stored"]

FEWEST_RUNS, EVENLY = 20, 0.8
"""Stored values without which no rate is seen, and the share of them that come a multiple of that rate apart [-]: where
one is missing the next sample shows the new value."""
MOVES = 0.5
"""Share of the samples in which one is held beyond which the other moves [-]."""
SELDOM, ALWAYS = 0.7, 0.9
"""Share of the samples at which one is stored up to which that is seldom, and from which the other always is [-]."""
STEPS = 10.0
"""Steps of rounding that a value moves by from one that is stored to the next [-]: a coarse one rests by itself."""
STRAIGHT = 1e-9, 2.5
"""Bend up to which three samples lie on a line: a share of the swing, and steps of rounding, three of which may differ
by two [-]."""


class Slower(NamedTuple):
    """Which of OP and PV is stored less often."""

    name: str
    """OP or PV."""
    every: int
    """Samples that it is held for [-]."""
    first: int
    """First sample of the record at which it is new, as it is every `every` samples from there."""

    def at(self, samples: int) -> NDArray[np.intp]:
        """The samples of a record of so many at which it is new."""
        return np.arange(self.first, samples, self.every)


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


def unevenly_stored(op: NDArray[np.float64], pv: NDArray[np.float64]) -> tuple[str, NDArray[np.intp]] | None:
    """Find the one that is stored now and then, by exception or a swinging door, while the other is at every sample.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output [% of span]; NaN where it is missing.
    pv : ndarray, shape (n_samples,)
        Process variable [engineering units]; NaN where it is missing.

    Returns
    -------
    tuple of str and ndarray, or None
        OP or PV, and the samples at which it was stored, the first one among them, whose value may be an older one;
        None where that is neither or both, or the values are coarse. An OP that rests is none: a controller that writes
        no small moves looks the same.

    Examples
    --------
    >>> import numpy as np
    >>> k = np.arange(200)
    >>> name, at = unevenly_stored(np.sin(k / 9.0), np.interp(k, [0, 90, 96, 150, 199], [0.0, 5.0, 3.0, 3.5, 1.0]))
    >>> name, at.tolist()
    ('PV', [0, 90, 96, 150, 199])
    """
    new = {"OP": _moved(op), "PV": _moved(pv)}
    kinks = {"OP": _kinks(op), "PV": _kinks(pv)}
    stored = {name: min(float(np.mean(new[name])), float(np.mean(kinks[name]))) for name in new}
    for name, other, x in (("PV", "OP", pv), ("OP", "PV", op)):
        if stored[name] > SELDOM or stored[other] < ALWAYS:
            continue
        lines = np.mean(new[name]) > SELDOM
        at = np.flatnonzero(kinks[name]) if lines else np.concatenate([[0], np.flatnonzero(new[name]) + 1])
        if (lines or name == "PV") and np.nanmedian(np.abs(np.diff(x[at]))) >= STEPS * lattice(x[np.isfinite(x)]):
            return name, at
    return None


def _kinks(x: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether each value lies off the line between its neighbours, shape (n_samples,); the ends do."""
    out = np.isfinite(x)
    known = x[out]
    if known.size:
        share, steps = STRAIGHT
        out[1:-1] &= np.abs(np.diff(x, 2)) > max(share * float(np.ptp(known)), steps * lattice(known))
    return out


def _moved(x: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether each value differs from the last one that was recorded before it, shape (n_samples - 1,)."""
    last = np.maximum.accumulate(np.where(np.isfinite(x), np.arange(x.size), 0))
    return np.diff(x[last]) != 0.0
