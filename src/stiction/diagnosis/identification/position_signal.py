"""The recorded valve position: which samples count, and whether it is a measurement or a copy of OP."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["PositionSignal", "hold_length", "is_copy", "position_signal"]

MAX_DELAY = 5
"""Samples that a position, or a copy of OP, may come late [-]."""


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
) -> PositionSignal | None:
    """OP [% of span] and position [any unit] of the samples in the middle of a record, `max_samples` at most.

    None where OP or the position does not vary, fewer than `min_values` or less than 1 - `max_missing` of the position
    were recorded, or it is a copy of OP.
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
    if not float(np.ptp(values)) > 1e-9 * float(np.abs(values).max()) or is_copy(op, position):
        return None
    length, start = hold_length(position)
    position = np.where(np.arange(position.size) % length == start, position, np.nan)
    if np.isfinite(position).sum() < min_values:
        return None
    return PositionSignal(np.ascontiguousarray(op), position)


def hold_length(position: NDArray[np.float64]) -> tuple[int, int]:
    """The k where a position changes only at every k-th sample, else 1, and the first sample of a new value.

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


def is_copy(op: NDArray[np.float64], position: NDArray[np.float64]) -> bool:
    """Whether a position is OP on another scale, up to `MAX_DELAY` samples late and rounded, and not a measurement.

    A straight line from OP then leaves no more than rounding: about a step of the position either way.

    Examples
    --------
    >>> op = 50.0 + np.sin(np.arange(200.0) / 9.0)
    >>> is_copy(op, np.round(4.0 + 0.16 * op, 2))
    True
    """
    known = np.isfinite(position)
    known[:MAX_DELAY] = False
    index = np.flatnonzero(known)
    if index.size < 3:
        return False
    y = position[index]
    values = np.unique(y)
    step = float(np.diff(values).min()) if 1 < values.size < 0.5 * y.size else 0.0
    limit = max(0.75 * step, 1e-6 * float(np.ptp(y)))
    return any(_largest_residual(op[index - delay], y) <= limit for delay in range(MAX_DELAY + 1))


def _largest_residual(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    dx, dy = x - x.mean(), y - y.mean()
    power = float(dx @ dx)
    return float(np.abs(dy - (float(dx @ dy) / power * dx if power > 0.0 else 0.0)).max())
