"""Values that stand alone far off all others: a historian's code for a bad value, a lost digit, a bit that fell over.

One such value in two thousand is the largest OP of the record, or most of the PV's variance: it can hide a valve that
sticks, or show a limit where there is none. It is taken for missing, and said so.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.stretches import runs

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["far_off", "without_outliers"]

RUN = 2
"""Samples in a row that are an outlier at most [-]; more are an upset."""
AT_ONCE = 0.75
"""Share of the way there, and of the way back, that is one step [-]."""
SHARE = 0.005
"""Share of a record beyond which such values are a habit of the loop [-]."""
OP_OFF, OTHERS_OFF = 1.0, 5.0
"""Distance from the others beyond which a value is one, in widths of all but a hundredth at both ends [-]. A PV that
spikes less far is a transmitter's fault, and a finding."""
NEAR = 2
"""Samples about a spike of the PV in which OP spikes because of it [-]."""


def far_off(x: NDArray[np.float64], widths: float) -> NDArray[np.bool_]:
    """Mark what stands alone far off all others, shape (n_samples,).

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        A signal.
    widths : float
        Distance from the others, in widths of all of them but a hundredth at both ends [-].

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.records.outliers import far_off
    >>> x = np.sin(np.arange(900.0))
    >>> x[[40, 200, 201, 202]] = 9.0
    >>> np.flatnonzero(far_off(x, 1.0)).tolist()
    [40]
    """
    mask = np.zeros(x.size, dtype=bool)
    finite = x[np.isfinite(x)]
    if finite.size == 0:
        return mask
    low, high = np.percentile(finite, (1.0, 99.0))
    middle, away = 0.5 * (low + high), widths * (high - low)
    for first, last in runs((x < low - away) | (x > high + away)):
        farthest = np.abs(x[first:last] - middle).max()
        there = abs(x[first] - x[first - 1]) if first else farthest
        back = abs(x[last - 1] - x[last]) if last < x.size else farthest
        # What goes there and back in steps, or has a gap beside it, may be an upset.
        mask[first:last] = last - first <= RUN and min(there, back) >= AT_ONCE * farthest
    return mask if mask.sum() <= max(SHARE * finite.size, 1.0) else np.zeros(x.size, dtype=bool)


def without_outliers(record: LoopRecord) -> LoopRecord:
    """The record with what stands alone far off in OP, PV or the valve's position missing, and counted.

    Parameters
    ----------
    record : LoopRecord
        What was recorded.

    Returns
    -------
    LoopRecord
        The same one where there is none.
    """
    signals = {name: x for name in ("op", "pv", "mv") if (x := getattr(record, name)) is not None}
    marks = {name: far_off(x, OP_OFF if name == "op" else OTHERS_OFF) for name, x in signals.items()}
    if record.pv is not None and marks["op"].any():
        spikes = np.convolve(far_off(record.pv, OP_OFF), np.ones(2 * NEAR + 1), "same") > 0.0
        marks["op"] &= ~spikes | marks["pv"]
    count = int(sum(mark.sum() for mark in marks.values()))
    if not count:
        return record
    held = {name: np.where(marks[name], np.nan, x) for name, x in signals.items()}
    told = ", ".join(f"{name.upper()} {signals[name][mark][0]:.4g}" for name, mark in marks.items() if mark.any())
    guess = f"{count} values far off all others count as missing (such as {told})."
    origin = record.provenance
    origin = replace(origin, guesses=(*origin.guesses, guess), outliers=origin.outliers + count)
    return replace(record, **held, provenance=origin)
