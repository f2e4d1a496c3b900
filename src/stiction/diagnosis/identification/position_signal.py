"""The recorded valve position: which samples count, and whether it is a measurement or a copy of OP."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["PositionSignal", "hold_length", "is_copy", "position_signal"]


class PositionSignal(NamedTuple):
    """OP and position of the part that is compared."""

    op: NDArray[np.float64]
    """Controller output [% of span], shape (n_samples,)."""
    position: NDArray[np.float64]
    """Recorded position [its unit], shape (n_samples,); NaN where nothing was measured."""


def position_signal(
    op: NDArray[np.float64],
    position: NDArray[np.float64],
    *,
    max_samples: int = 6000,
    min_values: int = 60,
    max_missing: float = 0.5,
    max_delay: int = 5,
) -> PositionSignal | None:
    """Prepare a recorded position.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output without gaps [% of span].
    position : ndarray, shape (n_samples,)
        Recorded valve position [any unit]; NaN is missing.
    max_samples : int
        Samples compared at most, those in the middle [samples].
    min_values : int
        Values of the position that are needed [-].
    max_missing : float
        Share of the part compared that may be missing [-].
    max_delay : int
        Samples that a copy of OP may come late [samples].

    Returns
    -------
    PositionSignal or None
        None where OP or the position does not vary, too little of it was recorded, or it is a copy of OP.
    """
    known = np.isfinite(position)
    if known.sum() < min_values:
        return None
    first, last = int(np.argmax(known)), position.size - int(np.argmax(known[::-1]))
    first += max((last - first - max_samples) // 2, 0)
    last = min(last, first + max_samples)
    op, position, known = op[first:last], position[first:last], known[first:last]
    if known.sum() < min_values or np.mean(~known) > max_missing or not float(np.ptp(op)) > 0.0:
        return None
    values = position[known]
    if not float(np.ptp(values)) > 1e-9 * float(np.abs(values).max()) or is_copy(op, position, max_delay=max_delay):
        return None
    length, start = hold_length(position)
    position = np.where(np.arange(position.size) % length == start, position, np.nan)
    if np.isfinite(position).sum() < min_values:
        return None
    return PositionSignal(np.ascontiguousarray(op), position)


def hold_length(position: NDArray[np.float64]) -> tuple[int, int]:
    """Find how long each value of a position is held.

    Parameters
    ----------
    position : ndarray, shape (n_samples,)
        Recorded position [any unit]; NaN is missing.

    Returns
    -------
    length : int
        k where the position changes only at every k-th sample, 1 where it changes at any [samples].
    first : int
        First sample at which a new value may stand.

    Examples
    --------
    >>> hold_length(np.array([1.0, 4.0, 4.0, 4.0, 2.0, 2.0, 2.0, 3.0]))
    (3, 1)
    """
    known = np.isfinite(position)
    changes = np.flatnonzero(known[1:] & known[:-1] & (np.diff(position) != 0.0)) + 1
    if changes.size < 3:
        return 1, 0
    length = int(np.gcd.reduce(np.diff(changes)))
    return length, int(changes[0] % length)


def is_copy(op: NDArray[np.float64], position: NDArray[np.float64], *, max_delay: int = 5) -> bool:
    """Whether a position is OP on another scale, late and rounded, and not a measurement.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output [% of span].
    position : ndarray, shape (n_samples,)
        Recorded position [any unit]; NaN is missing.
    max_delay : int
        Samples that it may come late [samples].

    Returns
    -------
    bool
        True where a straight line from OP leaves no more than rounding: about a step of the position either way.

    Examples
    --------
    >>> op = 50.0 + np.sin(np.arange(200.0) / 9.0)
    >>> is_copy(op, np.round(4.0 + 0.16 * op, 2))
    True
    """
    known = np.isfinite(position)
    known[:max_delay] = False
    index = np.flatnonzero(known)
    if index.size < 3:
        return False
    y = position[index]
    values = np.unique(y)
    step = float(np.diff(values).min()) if 1 < values.size < 0.5 * y.size else 0.0
    limit = max(0.75 * step, 1e-6 * float(np.ptp(y)))
    return any(_largest_residual(op[index - delay], y) <= limit for delay in range(max_delay + 1))


def _largest_residual(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    dx, dy = x - x.mean(), y - y.mean()
    power = float(dx @ dx)
    return float(np.abs(dy - (float(dx @ dy) / power * dx if power > 0.0 else 0.0)).max())
