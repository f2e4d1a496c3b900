"""How a historian stored a signal, read back from its numbers: lattice, exception, straight lines.

Every number here keeps its meaning under shift and scale of the signals; tolerances are shares of the swing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.records.quantiles import quantiles
from stiction.records.rests import filled, runs

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "coarse",
    "controller_saw",
    "exception_deviation",
    "lattice",
    "straight",
    "swing",
    "usual_swing",
]

ROUNDING = 1e-9
"""Share of the swing below which a difference is rounding of the arithmetic [-]."""
EXACT = 1e-7
"""Share of the swing within which points lie on a straight line [-]."""
CHORDS = 0.25
"""Share of the samples in which OP and PV must both lie between their neighbours to be drawn in short lines [-]."""
FEW_VALUES = 50
"""Values of a signal up to which it is coarse, when it also changes more than twice as often."""


def swing(x: NDArray[np.float64]) -> float:
    """Largest less smallest value, in the signal's unit; 0 when there is none."""
    x = x[np.isfinite(x)]
    return float(x.max() - x.min()) if x.size else 0.0


def usual_swing(x: NDArray[np.float64]) -> float:
    """98 % range of a signal, in its unit, which a few spikes do not widen.

    Examples
    --------
    >>> round(usual_swing(np.array([*np.linspace(0.0, 100.0, 101), 900.0])), 2)
    98.98
    """
    low, high = quantiles(x, 0.01, 0.99)
    return high - low


def lattice(x: NDArray[np.float64]) -> float:
    """Step of which all differences of a signal are multiples, in its unit; 0 when there is none.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        Signal in any unit; NaN are passed over.

    Examples
    --------
    >>> lattice(np.array([57.0, 57.3, 58.8, 57.6, 60.0])), lattice(np.array([0.0, 1.0, 2.617, 3.141]))
    (0.3, 0.0)
    """
    x = x[np.isfinite(x)]
    gaps = np.diff(np.unique(x))
    gaps = gaps[gaps > ROUNDING * gaps.sum()] if gaps.size else gaps
    if gaps.size == 0:
        return 0.0
    smallest = float(gaps.min())
    for part in (1, 2, 3):
        ratio = gaps * (part / smallest)
        whole = np.round(ratio)
        if np.mean(np.abs(ratio - whole) < 0.02) >= 0.98:
            # A straight line visits level after level, and none twice: its slope is no lattice.
            line = gaps.size > 0.95 * x.size > 9.0 and np.mean(whole == 1.0) > 0.95
            return 0.0 if line else float(f"{gaps.sum() / whole.sum():.9g}")
    return 0.0


def exception_deviation(x: NDArray[np.float64], step: float) -> float:
    """Exception deviation with which a signal was stored, in its unit; 0 when nothing points to one.

    A value that is stored when it has left the last one by more than a deviation rests, and then changes by at least
    that deviation. Other signals that rest have small changes too: those of a lattice go by one step, those of a
    historian that looks at the clock come at even distances. And values that are stored as they were measured
    hardly ever come back, those of a coarse signal do.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        Signal in any unit; NaN are passed over.
    step : float
        Its `lattice`.

    Examples
    --------
    >>> x, kept = np.random.default_rng(1).normal(size=400).cumsum(), [0.0]
    >>> for value in x:
    ...     kept.append(value if abs(value - kept[-1]) > 2.0 else kept[-1])
    >>> 2.0 < exception_deviation(np.array(kept), 0.0) < 2.2, exception_deviation(x, 0.0)
    (True, 0.0)
    """
    x = x[np.isfinite(x)]
    moved = np.abs(np.diff(x))
    places = np.flatnonzero(moved > ROUNDING * swing(x))
    changes = moved[places]
    if changes.size < 12 or changes.size > 0.75 * moved.size or coarse(x):
        return 0.0
    smallest, usual = np.percentile(changes, (5, 50))
    rests = np.diff(places)
    by_the_clock = np.mean(rests == np.median(rests)) > 0.9
    return 0.0 if smallest < max(1.5 * step, 0.3 * usual) or by_the_clock else float(smallest)


def coarse(x: NDArray[np.float64]) -> bool:
    """Whether a signal comes back to a few values again and again.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        Signal in any unit, without NaN.

    Examples
    --------
    >>> x = np.random.default_rng(1).normal(size=400)
    >>> coarse(np.round(x)), coarse(x), coarse(np.repeat(x[::20], 20))
    (True, False, False)
    """
    values = np.unique(x).size
    return values <= FEW_VALUES and 2 * values < int(np.count_nonzero(np.diff(x)))


def controller_saw(op: NDArray[np.float64], pv: NDArray[np.float64], op_step: float) -> bool:
    """Whether OP runs straight while PV rests: then the controller saw PV rest, and no historian made it so.

    Integral action of a constant error is a ramp; had PV moved unseen, OP would bend.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        Signals in any unit; NaN of OP are passed over, those of PV taken for rests.
    op_step : float
        Lattice of OP, in its unit.
    """
    still = np.diff(filled(pv)) == 0.0
    rests = sorted((run for run in runs(still) if run[1] - run[0] >= 8), key=lambda run: run[0] - run[1])[:30]
    tolerance = max(op_step, 1e-5 * swing(op))
    straight_ones = bent = 0
    for first, last in rests:
        # Early in a rest the derivative still answers the change before it.
        end = first + int(np.flatnonzero(np.isfinite(pv[first : last + 1]))[-1])  # PV may have moved unseen after it
        part = op[(first + end) // 2 : end + 1]
        seen = np.flatnonzero(np.isfinite(part))
        if seen.size < 4:
            continue
        k, part = seen - seen.mean(), part[seen]
        slope = float(k @ part) / float(k @ k)
        if abs(slope) * float(np.ptp(k) + 1.0) > 3.0 * tolerance:
            off = np.abs(part - part.mean() - slope * k).max()
            straight_ones, bent = (straight_ones + 1, bent) if off <= tolerance else (straight_ones, bent + 1)
    return straight_ones >= 3 and straight_ones >= 4 * bent


def straight(x: NDArray[np.float64], y: NDArray[np.float64], x_step: float, y_step: float) -> int:
    """Count the samples of `x` that a straight line between two others gives, while `y` shows that it should bend.

    A line is five points or more, steep beside the lattice, with a kink at each end; shorter ones, as between every
    second or third sample, count where both signals lie on them again and again. OP and PV of a controller with
    integral action are never straight together, and a signal is not exactly straight while the other is rough; a
    stuck valve without noise gives one straight signal beside a smooth or resting one, which is not counted.

    Parameters
    ----------
    x, y : ndarray, shape (n_samples,)
        The signal and its companion, in any unit, without NaN.
    x_step, y_step : float
        Their lattices.

    Examples
    --------
    >>> k, noise = np.arange(400), np.random.default_rng(1).normal(size=400)
    >>> straight(np.interp(k, k[::10], noise[::10]), noise, 0.0, 0.0)
    351
    """
    if len(x) < 10 or _mirrors(x, y, x_step, y_step):
        return 0
    if not (x_step or y_step):
        together = _on_chords(x) & _on_chords(y)
        if together.mean() > CHORDS:
            return int(together.sum())
    tolerance = max(EXACT * swing(x), 2.01 * x_step)
    slope, y_slope = np.diff(x), np.diff(y)
    bend, y_bend = np.abs(np.diff(slope)), np.abs(np.diff(y_slope))
    steep = np.abs(slope) > max(1e-6 * swing(x), 5.0 * x_step)
    found = np.array(runs((bend <= tolerance) & steep[1:] & steep[:-1]), dtype=np.int64).reshape(-1, 2)
    found = found[found[:, 1] - found[:, 0] >= 3]
    kink = np.concatenate([bend > 3.0 * tolerance, [True]])
    found = found[kink[found[:, 0] - 1] & kink[found[:, 1]]]
    if not found.size:
        return 0
    first, last = found.T
    y_tolerance = max(EXACT * swing(y), 2.01 * y_step)
    y_steep = np.abs(y_slope) > max(1e-6 * swing(y), 5.0 * y_step)
    both = _sums((y_bend <= y_tolerance) & y_steep[1:] & y_steep[:-1], first, last) >= last - first
    if not x_step:
        # Lines between the steps of a coarse signal make a lattice of their own, on which they are not steep.
        moves = np.abs(y_slope) > 1e-6 * swing(y)
        on_line = (y_bend <= EXACT * swing(y)) & moves[1:] & moves[:-1]
        both |= _sums(on_line, first, last) >= last - first
    second = _sums(y_bend, first, last)
    third = _sums(np.abs(np.diff(np.diff(y_slope), append=np.nan)), first, last - 1)
    rough = (third > second) & (second > 3.0 * max(y_tolerance, y_step) * (last - first))
    return int(np.sum((last - first)[both | rough]))


def _on_chords(x: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Where a signal that moves lies exactly between its neighbours, shape (n_samples - 2,)."""
    return (np.abs(np.diff(x, 2)) <= EXACT * swing(x)) & (np.abs(np.diff(x)[1:]) > 1e-6 * swing(x))


def _mirrors(x: NDArray[np.float64], y: NDArray[np.float64], x_step: float, y_step: float) -> bool:
    """Whether one signal is the other in another scale, and both bend: proportional action alone."""
    if np.abs(np.diff(x, 2)).max() <= EXACT * swing(x):
        return False
    a, b = x - x.mean(), y - y.mean()
    power, other = float(np.mean(a * a)), float(np.mean(b * b))
    slope = float(np.mean(a * b)) / other if other > 0.0 else 0.0
    # Rounding to a step leaves a variance of a twelfth of its square; twice that is allowed.
    return power - slope**2 * other <= 1e-10 * power + (x_step**2 + (slope * y_step) ** 2) / 6.0


def _sums(x: NDArray, first: NDArray[np.int64], last: NDArray[np.int64]) -> NDArray[np.float64]:
    total = np.concatenate([[0.0], np.cumsum(np.nan_to_num(x))])
    return total[last] - total[first]
