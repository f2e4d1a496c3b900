"""Movement of the signals: reversals of OP, resemblance of neighbouring samples, and the unit of OP."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.records.quantiles import robust_std

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["count_reversals", "detect_op_scale", "last_value_correlation", "spike_share"]


def count_reversals(x: NDArray[np.float64], min_move: float = 0.0) -> int:
    """Count how often a signal reverses its direction.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        A signal without NaN [any unit].
    min_move : float
        Moves up to this, before or after a reversal, do not count [unit of `x`].

    Returns
    -------
    int
        Reversals [-].

    Notes
    -----
    Friction shows only where the valve reverses.

    Examples
    --------
    >>> x = np.array([0.0, 5.0, 10.0, 9.9, 10.0, 4.0, 0.0, 8.0])
    >>> count_reversals(x), count_reversals(x, 1.5)
    (4, 2)
    """
    directions = np.sign(np.diff(x))
    directions = directions[moving := directions != 0.0]
    if not directions.size:
        return 0
    turning = x[:-1][moving][np.append(True, directions[1:] != directions[:-1])]
    count, direction, farthest = 0, 0.0, float(turning[0])
    low = high = farthest
    for value in [*turning.tolist(), float(x[-1])]:
        if direction == 0.0:
            low, high = min(low, value), max(high, value)
            direction = 1.0 if value - low > min_move else -1.0 if high - value > min_move else 0.0
            farthest = value
        elif direction * (value - farthest) > 0.0:
            farthest = value
        elif direction * (farthest - value) > min_move:
            count, direction, farthest = count + 1, -direction, value
    return count


def last_value_correlation(x: NDArray[np.float64]) -> float:
    """Correlation of a signal with its last value.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        A signal without NaN [any unit].

    Returns
    -------
    float
        The correlation, by von Neumann's ratio [-]: 0 for white noise, 1 for a constant, cos(2 pi / n) for a sine of
        n samples per cycle.

    Examples
    --------
    >>> round(last_value_correlation(np.sin(np.arange(6000) * np.pi / 3)), 2)
    0.5
    """
    variance = float(np.var(x))
    return 1.0 - float(np.mean(np.diff(x) ** 2)) / (2.0 * variance) if variance > 0.0 else 1.0


def detect_op_scale(low: float, high: float) -> str:
    """Say which unit an OP between two values may have.

    Parameters
    ----------
    low, high : float
        Smallest and largest OP [its unit].

    Returns
    -------
    str
        "percent", "fraction" (of span), "normalised" (mean removed), or "other".

    Examples
    --------
    >>> [detect_op_scale(*ends) for ends in ((20.0, 70.0), (0.2, 0.7), (-1.9, 2.2), (-52.0, -45.0))]
    ['percent', 'fraction', 'normalised', 'other']
    """
    if low >= 0.0 and high <= 1.0:
        return "fraction"
    if low < -10.0 or high > 110.0:
        return "other"
    return "normalised" if low < -0.5 and high <= 5.0 else "percent"


def spike_share(x: NDArray[np.float64], *, min_jump: float = 8.0) -> float:
    """Share of the samples in which a signal jumps away from both neighbours, by robust deviations of its moves [-].

    Examples
    --------
    >>> x = np.sin(np.arange(100.0))
    >>> x[40] = 50.0
    >>> round(spike_share(x), 2)
    0.01
    """
    moves = np.diff(x)
    usual = robust_std(moves) if moves.size else 0.0
    if not usual > 0.0:
        return 0.0
    away = (moves[:-1] * moves[1:] < 0.0) & (np.minimum(np.abs(moves[:-1]), np.abs(moves[1:])) > min_jump * usual)
    return float(np.mean(away))
