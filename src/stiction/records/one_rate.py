"""At which samples OP and PV were stored: held for a fixed count of samples, by exception, or drawn as lines between.

A value that is held for the export and not by the controller looks like a transmitter that hangs, and what moves in
between like a disturbance. Where the slower one is new both are what the controller saw, and its law may tell what was
between (`diagnosis.identification.restored`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.records.storage import coarse, lattice

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Slower", "Stored", "slower_of", "stored_samples"]

FEWEST_RUNS, EVENLY = 20, 0.8
"""Stored values without which no rate is seen, and the share of them that come a multiple of that rate apart [-]: where
one is missing the next sample shows the new value."""
MOVES = 0.5
"""Share of the samples in which one is held beyond which the other moves [-]."""
SELDOM = 0.03
"""Share of the PV that is left out below which an OP that rests does so by itself [-]."""
TOGETHER = 0.98
"""Share of what is left out of one that is left out of the other as well beyond which both were only repeated [-]: by a
record that is finer than the controller is fast, or a historian that was not reached."""
LEFT_OUT = 0.02
"""Share of the samples that rest, or lie on lines, up to which nothing was left out there [-]."""
STEPS = 10.0
"""Steps of rounding that a value moves by from one that is stored to the next [-]: a coarse one rests by itself."""
ALL = 0.98
"""Share of the samples from which a signal is taken as stored at all of them [-]."""
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


class Stored(NamedTuple):
    """At which samples OP and PV were stored."""

    op: NDArray[np.bool_]
    """Where OP was, shape (n_samples,)."""
    pv: NDArray[np.bool_]
    """Where PV was, shape (n_samples,)."""

    @property
    def seldom(self) -> dict[str, float]:
        """Those of OP and PV that were not stored at all samples, and at what share of them [-]."""
        shares = {"OP": self.op.sum() / max(self.op.size, 1), "PV": self.pv.sum() / max(self.pv.size, 1)}
        return {name: float(share) for name, share in shares.items() if share < ALL}


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


def stored_samples(op: NDArray[np.float64], pv: NDArray[np.float64]) -> Stored:
    """Find the samples at which OP and PV were stored: where they are new, or off the line between their neighbours.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output [% of span]; NaN where it is missing.
    pv : ndarray, shape (n_samples,)
        Process variable [engineering units]; NaN where it is missing.

    Returns
    -------
    Stored
        The first value counts as stored, though it may be an older one. A coarse signal rests by itself, an OP that
        rests beside a PV at every sample may be that of a controller that writes no small moves, and two that rest
        together were repeated: all of theirs count.

    Examples
    --------
    >>> import numpy as np
    >>> k = np.arange(200)
    >>> kept = stored_samples(np.sin(k / 9.0), np.interp(k, [0, 90, 96, 150, 199], [0.0, 5.0, 3.0, 3.5, 1.0]))
    >>> kept.op.all(), np.flatnonzero(kept.pv).tolist()
    (np.True_, [0, 90, 96, 150, 199])
    """
    finite, slower = Stored(np.isfinite(op), np.isfinite(pv)), slower_of(op, pv)
    if slower is not None:
        new = np.arange(op.size) % slower.every == slower.first
        return finite._replace(op=finite.op & new) if slower.name == "OP" else finite._replace(pv=finite.pv & new)
    (of_op, rests), (of_pv, _) = _stored(op), _stored(pv)
    left_out = finite.op & ~of_op, finite.pv & ~of_pv
    together = (left_out[0] & left_out[1]).sum() > TOGETHER * min(left_out[0].sum(), left_out[1].sum()) > 0.0
    by_itself = rests and left_out[0].any() and left_out[1].mean() < SELDOM
    return finite if together or by_itself else Stored(of_op, of_pv)


def _stored(x: NDArray[np.float64]) -> tuple[NDArray[np.bool_], bool]:
    """Where a signal was stored, shape (n_samples,), and whether it rests between.

    Beside a missing value nothing is known: what rests may show one that was stored while it was missing.
    """
    finite = np.isfinite(x)
    beside = finite[1:] & finite[:-1]
    rests, straight = beside & (np.diff(x) == 0.0), finite[1:-1] & beside[1:] & beside[:-1]
    step = lattice(x[finite]) if finite.any() else 0.0
    swing = float(np.ptp(x[finite])) if finite.any() else 0.0
    lines = straight & (np.abs(np.diff(x, 2)) <= max(STRAIGHT[0] * swing, STRAIGHT[1] * step))
    resting = rests.sum() >= lines.sum()
    if max(rests.sum(), lines.sum()) <= LEFT_OUT * x.size or (finite.any() and coarse(x[finite])):
        return finite, resting
    own = np.ones(x.size, dtype=bool)
    if resting:
        own[1:] = beside & ~rests
    else:
        own[1:-1] = straight & ~lines
    own &= finite
    steps = np.abs(np.diff(x[own]))
    return (own, resting) if steps.size and np.median(steps) >= STEPS * step else (finite, resting)


def _moved(x: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether each value differs from the last one that was recorded before it, shape (n_samples - 1,)."""
    last = np.maximum.accumulate(np.where(np.isfinite(x), np.arange(x.size), 0))
    return np.diff(x[last]) != 0.0
