"""The recorded valve position: which samples count, and how well a straight line from simulated stems explains it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.candidates import CHUNK, evaluated
from stiction.diagnosis.identification.regression import MIN_ERROR
from stiction.diagnosis.identification.stems import as_valve_arrays, first_order_lags, valve_positions

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.candidates import Candidates

__all__ = [
    "PositionRegression",
    "PositionSignal",
    "StraightLine",
    "hold_length",
    "is_copy",
    "position_regression",
    "position_signal",
]

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


class StraightLine(NamedTuple):
    """A recorded position as a straight line of a stem."""

    slope: float
    """Scale of the position [its unit per % of span]."""
    level: float
    """Position where the stem stands at 0 % [its unit]."""
    lag: float
    """Time constant of the position signal [samples]."""
    delay: int
    """Samples that it comes late [-]."""
    explained: float
    """Share of the variance of the position that the line explains [-]."""


@dataclass(frozen=True, eq=False)
class PositionRegression:
    """The recorded position, ready to be compared with many stems.

    Every stem is compared with each delay and lag, and the best of them counts. The same samples of the position are
    compared for all of them.
    """

    op: NDArray[np.float64]
    """Controller output [% of span], shape (n_samples,)."""
    position: NDArray[np.float64]
    """Recorded position about its mean [its unit], shape (n_samples,); 0 where it is not compared."""
    weight: NDArray[np.float64]
    """1 where the position is compared, else 0 [-], shape (n_samples,)."""
    level: float
    """Mean of the recorded position [its unit]."""
    earlier: NDArray[np.float64]
    """Position and weight, each earlier by the delays, shape (n_samples, 2 n_delays)."""
    memory: NDArray[np.float64]
    """Room for the stems that are compared at a time, shape (3, `CHUNK`, n_samples): new memory takes longer."""
    lags: tuple[float, ...] = (0.0, 2.0, 6.0)
    """Time constants of the position signal that are tried [samples]."""
    delays: tuple[int, ...] = tuple(range(MAX_DELAY + 1))
    """Delays of the position that are tried [samples]."""
    per_block: int = 1
    """Samples of OP for each sample of the position [-]."""

    @property
    def n_predicted(self) -> int:
        """Samples of the position that are compared [-]."""
        return int(self.weight.sum())

    def positions(self, valves: NDArray[np.float64]) -> NDArray[np.float64]:
        """Stems of candidate rows (S, J / S, rests, start), shape (n_valves, n_samples) [% of span]."""
        out = np.empty((len(valves), self.op.size))
        valve_positions(self.op, 1, *as_valve_arrays(valves), out)
        return out

    def evaluate(self, valves: NDArray[np.float64]) -> Candidates:
        """Candidate valves with their costs."""
        return evaluated(valves, lambda some: self.cost_of_positions(self.positions(some)))

    def cost_of_positions(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Minus twice the log likelihood of stems, but for a constant [-], shape (n_valves,)."""
        n = self.n_predicted
        return n * np.log(self._errors(positions).min(axis=(0, 2)) / n)

    def line(self, stem: NDArray[np.float64]) -> StraightLine:
        """The best line from a stem, shape (n_samples,) [% of span]."""
        errors = self._errors(stem[np.newaxis])[:, 0]
        i, j = np.unravel_index(int(np.argmin(errors)), errors.shape)
        lag, delay = self.lags[int(i)], self.delays[int(j)]
        index = np.flatnonzero(self.weight)
        x, y = first_order_lags(stem, lag, settled=True)[index - delay], self.position[index]
        dx = x - x.mean()
        power = float(dx @ dx)
        slope = float(dx @ y) / power if power > 0.0 else 0.0
        left = y - y.mean() - slope * dx
        level = self.level + float(y.mean() - slope * x.mean())
        return StraightLine(slope, level, lag, delay, 1.0 - float(left @ left) / float(y @ y))

    def residuals(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """What the lines leave of the position [its unit], shape (n_valves, n_predicted)."""
        index = np.flatnonzero(self.weight)
        rows = []
        for stem in positions:
            line = self.line(stem)
            x = first_order_lags(stem, line.lag, settled=True)[index - line.delay]
            rows.append(self.position[index] + self.level - line.level - line.slope * x)
        return np.array(rows)

    def around(self, lags: set[float], factor: float) -> PositionRegression:
        """The same with lags a factor above and below some."""
        near = {
            other for lag in lags for other in ((0.0, 0.5, 1.0) if lag == 0.0 else (lag / factor, lag, lag * factor))
        }
        return replace(self, lags=tuple(sorted(near)))

    def _errors(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Residual sums of squares, shape (n_lags, n_valves, n_delays)."""
        energy, n = float(self.position @ self.position), len(self.delays)
        x, lagged, square = self.memory[:, : len(positions)]
        np.subtract(positions, float(self.op.mean()), out=x)
        errors = []
        for lag in self.lags:
            z = first_order_lags(x, lag, settled=True, out=lagged)
            products, total = z @ self.earlier, np.multiply(z, z, out=square) @ self.earlier[:, n:]
            power = total - products[:, n:] ** 2 / self.n_predicted
            moves = power > 1e-9 * total + 1e-12  # less is rounding: the stem rests
            errors.append(energy - np.where(moves, products[:, :n] ** 2 / np.where(moves, power, 1.0), 0.0))
        return np.maximum(np.array(errors), MIN_ERROR * energy)


def position_regression(signal: PositionSignal) -> PositionRegression:
    """Prepare the comparison; a tenth of the samples passes first, since where the stem stood before is not known."""
    known = np.isfinite(signal.position)
    known[: max(PositionRegression.delays[-1], known.size // 10)] = False
    level = float(signal.position[known].mean())
    y, weight = np.where(known, signal.position - level, 0.0), known.astype(np.float64)
    earlier = [np.append(x[d:], np.zeros(d)) for x in (y, weight) for d in PositionRegression.delays]
    memory = np.empty((3, CHUNK, y.size))
    return PositionRegression(signal.op, y, weight, level, np.stack(earlier, axis=1), memory)
