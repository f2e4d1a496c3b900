"""A quantity that varies over the valve's travel and, where needed, over the rate of its input."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import ParameterError
from stiction.models.numba_compile import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Table", "lookup"]


@kernel
def _find_cell(p, first: int, n: int, x: float):
    """Cell and weight of `x` among the `n` increasing knots p[first:first + n], constant beyond the ends."""
    if n == 1 or x <= p[first]:
        return 0, 0.0
    if x >= p[first + n - 1]:
        return n - 2, 1.0
    low = 0
    high = n - 1
    while high - low > 1:
        middle = (low + high) // 2
        if x < p[first + middle]:
            high = middle
        else:
            low = middle
    return low, (x - p[first + low]) / (p[first + low + 1] - p[first + low])


@kernel
def lookup(p, first: int, position: float, rate: float) -> float:
    """Bilinear value of the table packed at ``p[first:]``, held constant beyond its ends."""
    n_position = int(p[first])
    n_rate = int(p[first + 1])
    positions = first + 2
    rates = positions + n_position
    values = rates + n_rate
    i, along = _find_cell(p, positions, n_position, position)
    j, across = _find_cell(p, rates, n_rate, rate)
    i_next = min(i + 1, n_position - 1)
    j_next = min(j + 1, n_rate - 1)
    low = (1.0 - across) * p[values + i * n_rate + j] + across * p[values + i * n_rate + j_next]
    high = (1.0 - across) * p[values + i_next * n_rate + j] + across * p[values + i_next * n_rate + j_next]
    return (1.0 - along) * low + along * high


@dataclass(frozen=True, eq=False)
class Table:
    """Linear interpolation over the valve position and, optionally, over the input rate.

    Parameters
    ----------
    position : array_like, shape (n_positions,)
        Valve positions, increasing [% of span].
    value : array_like, shape (n_positions,) or (n_positions, n_rates)
        The quantity there [% of span].
    rate : array_like, shape (n_rates,), optional
        Magnitudes of the input rate, increasing [% of span / s].

    Raises
    ------
    ParameterError
        When the knots do not increase, a value is negative or not finite, or the shapes differ.

    Notes
    -----
    Beyond its ends the table is constant.

    References
    ----------
    srinivasan2008, eq. 5: <sb, sj> = f(x, du).

    Examples
    --------
    >>> from stiction import Table
    >>> float(Table([0.0, 100.0], [1.0, 3.0]).at(25.0))
    1.5
    """

    position: NDArray[np.float64]
    value: NDArray[np.float64]
    rate: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        position = _knots("position", self.position)
        rate = np.zeros(1) if self.rate is None else _knots("rate", self.rate)
        value = _numbers("value", self.value)
        if value.ndim == 1:
            value = value[:, np.newaxis]
        if value.shape != (position.size, rate.size):
            raise ParameterError(
                f"value has shape {value.shape} but position and rate need ({position.size}, {rate.size}); "
                "give one value per position (and rate)."
            )
        if not np.all(np.isfinite(value)) or np.any(value < 0.0):
            raise ParameterError("value has a negative or non-finite entry; give values of 0 or more.")
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "value", value)
        object.__setattr__(self, "rate", rate)

    def pack(self) -> NDArray[np.float64]:
        """Sizes, knots and values in one row, as `lookup` takes them."""
        assert self.rate is not None
        sizes = [float(self.position.size), float(self.rate.size)]
        return np.concatenate([sizes, self.position, self.rate, self.value.ravel()])

    def at(self, position: float, rate: float = 0.0) -> float:
        """Value at a valve position [% of span] and an input rate [% of span / s]."""
        return lookup(self.pack(), 0, position, rate)


def _knots(name: str, value: object) -> NDArray[np.float64]:
    knots = np.atleast_1d(_numbers(name, value))
    if knots.ndim != 1 or knots.size == 0 or not np.all(np.isfinite(knots)) or np.any(np.diff(knots) <= 0.0):
        raise ParameterError(f"{name} must be a series of finite, increasing numbers, got {value!r}.")
    return knots


def _numbers(name: str, value: object) -> NDArray[np.float64]:
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ParameterError(f"{name} must be a series of numbers, got {value!r}.") from None
