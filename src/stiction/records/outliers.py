"""Values that stand alone far off all others: a historian's code for a bad value, a lost digit, a bit that fell over.

One such value in two thousand is the largest OP of the record, or most of the PV's variance: it can hide a valve that
sticks, or show a limit where there is none. It is taken for missing, and said so.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.quantiles import quantiles
from stiction.records.rests import runs

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["OP_OFF", "far_off", "outlier_masks"]

REST = 0.025, 0.975
"""Shares of the values between which the others lie [-]."""
RUN = 2
"""Samples in a row that are an outlier at most [-]; more are an upset."""
STANDS, STANDS_OFF = 30, 5.0
"""Samples for which one and the same value is an outlier at most, and its distance from the others, as below [-]."""
AT_ONCE = 0.75
"""Share of the way there, and of the way back, that is one step [-]."""
AT_ENDS = 20.0
"""The same distance beyond which a sample at an end of the record or beside a gap is one [-]: nothing shows the way
there or back."""
SHARE = 0.02
"""Share of a record beyond which such values are a habit of the loop [-]."""
AGAIN, MOSTLY, MOST_SIGNS = 5, 0.4, 0.4
"""How often a value below or above all others comes at least to be a sign for a bad one, the share of that which stands
alone, and the largest share of the record that such a sign takes [-]."""
LIMITS = (0.0, 1.0, 100.0)
"""Values at which OP, as a share or in %, is by itself; only beyond `STANDS_OFF` are they a sign."""
OP_OFF, OTHERS_OFF = 1.0, 5.0
"""Distance from the others beyond which a value is one, in widths of all but a fortieth at both ends [-]. A PV that
spikes less far is a transmitter's fault, and a finding."""
NEAR = 2
"""Samples about a spike of the PV, or a step of the set point, in which OP kicks because of it [-]."""


def far_off(x: NDArray[np.float64], widths: float, held: int = 1) -> NDArray[np.bool_]:
    """Mark what stands alone far off all others, shape (n_samples,).

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        A signal.
    widths : float
        Distance from the others, in widths of all of them but a fortieth at both ends [-].
    held : int
        Samples for which a stored value stands [-].

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.records.outliers import far_off
    >>> x = np.sin(np.arange(900.0))
    >>> x[[40, 200, 201, 202]] = 9.0
    >>> np.flatnonzero(far_off(x, 1.0)).tolist()
    [40]
    """
    signs = _signs(x, widths, held)
    alone = _alone(np.where(signs, np.nan, x), widths, held)
    return signs | alone if alone.sum() <= max(SHARE * np.isfinite(x).sum(), held) else signs


def _signs(x: NDArray[np.float64], widths: float, held: int) -> NDArray[np.bool_]:
    """Mark a value below or above all others that comes again and again, mostly alone: a sign for a bad value.

    However often it comes, it is no habit of the loop.
    """
    if not x.size:
        return np.zeros(0, dtype=bool)
    ends = {value: x == value for value in (np.fmin.reduce(x), np.fmax.reduce(x))}
    again = {value: same for value, same in ends.items() if AGAIN <= same.sum() <= MOST_SIGNS * x.size}
    signs = np.zeros(x.size, dtype=bool)
    usual = _usual(np.where(np.logical_or.reduce([signs, *again.values()]), np.nan, x))
    for value, same in again.items():
        far = max(widths, STANDS_OFF) if value in LIMITS else widths
        alone = int((same & _alone(x, far, held, usual)).sum())
        if alone >= max(AGAIN, MOSTLY * same.sum()):
            signs |= same
    return signs


def _usual(x: NDArray[np.float64]) -> tuple[float, float]:
    """Between what most values lie."""
    low, high = quantiles(x, *REST)
    return (0.0, 0.0) if math.isnan(low) else (low, high)


def _alone(
    x: NDArray[np.float64], widths: float, held: int, usual: tuple[float, float] | None = None
) -> NDArray[np.bool_]:
    """Mark what lies far off what is usual, for a moment or as one value, and the way there and back in one step."""
    mask = np.zeros(x.size, dtype=bool)
    low, high = _usual(x) if usual is None else usual
    width, middle = high - low, 0.5 * (low + high)
    if not width > 0.0:
        return mask
    for first, last in runs((x < low - widths * width) | (x > high + widths * width)):
        farthest = np.abs(x[first:last] - middle).max()
        at_end = farthest if farthest > AT_ENDS * width else 0.0
        there = abs(x[first] - x[first - 1]) if first and np.isfinite(x[first - 1]) else at_end
        back = abs(x[last - 1] - x[last]) if last < x.size and np.isfinite(x[last]) else at_end
        values = 1 + np.count_nonzero(np.diff(x[first:last]))
        # What goes there and back in steps may be an upset.
        at_once = min(there, back) >= AT_ONCE * farthest
        brief = values <= RUN and last - first <= RUN * held
        stands = values == 1 and last - first <= STANDS * held and farthest > STANDS_OFF * width
        mask[first:last] = at_once and (brief or stands)
    return mask


def outlier_masks(signals: dict[str, NDArray[np.float64] | None], held: int = 1) -> dict[str, NDArray[np.bool_]]:
    """Mark what stands alone far off in OP, PV and the valve's position.

    Parameters
    ----------
    signals : dict
        "op", "pv", "sp" and "mv" -> the signal, shape (n_samples,), or None where it was not recorded.
    held : int
        Samples for which a stored value stands [-].

    Returns
    -------
    dict
        "op", "pv" and "mv", as far as recorded -> the mask, shape (n_samples,). An OP that kicks with a spike of the PV
        or a step of the set point is no outlier.
    """
    recorded = {name: x for name in ("op", "pv", "mv") if (x := signals[name]) is not None}
    marks = {name: far_off(x, OP_OFF if name == "op" else OTHERS_OFF, held) for name, x in recorded.items()}
    if marks["op"].any():
        kicks = np.zeros(marks["op"].size, dtype=bool)
        if (sp := signals["sp"]) is not None:
            moved = np.abs(np.diff(sp)) > 0.0
            kicks[1:] = moved & (moved.mean() <= SHARE)  # a set point that moves all the time explains no kick
        if "pv" in recorded:
            kicks |= far_off(recorded["pv"], OP_OFF, held) & ~marks["pv"]
        marks["op"] &= ~(np.convolve(kicks, np.ones(2 * NEAR + 1), "same") > 0.0)
    return marks
