"""Candidate valves, and the pattern search that refines the best of them: the one search driver of this room."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.models.numba_compile import kernel

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

__all__ = ["CHUNK", "Candidates", "Valve", "combinations", "evaluated", "halved_steps", "joined", "pattern_search"]

CHUNK = 64
"""Candidate valves whose positions are in memory at the same time [-]."""


class Valve(NamedTuple):
    """A candidate valve."""

    S: float
    """Deadband plus stickband [% of span]."""
    ratio: float
    """Slip jump over S, J / S [-]."""
    rests: float
    """1 for a stem that rests again after every sample, 0 for one that moves on with OP [-]."""
    start: float
    """First position from OP, in units of (S + J) / 2 [-]."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """Candidate valves and their costs."""

    valves: NDArray[np.float64]
    """Rows of `Valve`, shape (n_valves, 4)."""
    cost: NDArray[np.float64]
    """Minus twice the log likelihood, but for a constant [-], shape (n_valves,)."""

    @property
    def best(self) -> Valve:
        """The candidate with the smallest cost."""
        return Valve(*self.valves[self._order()[0]].tolist())

    def _order(self) -> NDArray[np.int64]:
        """Indices by increasing cost; valves that move alike cost the same, and rounding errors must not decide."""
        return np.argsort(np.round(self.cost, 5), kind="stable")

    def local_minima(self, count: int, S_distance: float, ratio_distance: float) -> NDArray[np.float64]:
        """Up to `count` best candidates, none within both distances in ln S and in J / S [-] of a better one."""
        rows = self.valves[self._order()]
        chosen = np.empty(count, dtype=np.int64)
        return rows[chosen[: _choose_apart(rows, np.log(rows[:, 0]), S_distance, ratio_distance, chosen)]]


@kernel
def _choose_apart(rows, log_S, S_distance, ratio_distance, chosen):
    """Fill `chosen` with rows that are within both distances of none chosen before, and return their number."""
    count = 0
    for i in range(rows.shape[0]):
        free = True
        for k in range(count):
            j = chosen[k]
            near = abs(log_S[i] - log_S[j]) <= S_distance and abs(rows[i, 1] - rows[j, 1]) <= ratio_distance
            free = free and not (near and rows[i, 2] == rows[j, 2])
        if free:
            chosen[count] = i
            count += 1
            if count == chosen.size:
                break
    return count


def combinations(*axes: NDArray[np.float64]) -> NDArray[np.float64]:
    """All combinations of values, one a row."""
    return np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)


def evaluated(rows: NDArray[np.float64], cost: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> Candidates:
    """Candidate rows with their costs, a few rows at a time."""
    chunks = [rows[i : i + CHUNK] for i in range(0, len(rows), CHUNK)]
    return Candidates(rows, np.concatenate([cost(one) for one in chunks]))


def halved_steps(S: float, ratio: float, start: float, count: int) -> list[tuple[float, float, float, int]]:
    """Six rounds of `pattern_search`: the steps halve, and the candidates refined decrease by the root of 2, to two."""
    return [(S / 2**k, ratio / 2**k, start / 2**k, max(round(count / 2 ** (0.5 * k)), 2)) for k in range(6)]


def pattern_search(
    evaluate: Callable[[NDArray[np.float64]], Candidates],
    found: Candidates,
    steps: Sequence[tuple[float, float, float, int]],
    max_S: float,
    *,
    diagonal: bool = False,
) -> Candidates:
    """Add the neighbours of the best candidates, with smaller and smaller steps.

    Each round has its steps in ln S, in J / S and in the start, and its number of candidates refined [-]; `max_S` is
    the largest S [% of span]. With `diagonal` a larger S is tried with a smaller J / S too, and the reverse: a valve
    that breaks loose at the same distance.
    """
    for S_step, ratio_step, start_step, count in steps:
        centres = found.local_minima(count, 0.8 * S_step, 0.8 * ratio_step)
        steps_tried = DIAGONAL_PATTERN if diagonal else PATTERN
        found = joined(found, evaluate(_neighbours(centres, steps_tried * (S_step, ratio_step, start_step), max_S)))
    return found


def joined(one: Candidates, other: Candidates) -> Candidates:
    """Two sets of candidates as one."""
    return Candidates(np.concatenate([one.valves, other.valves]), np.concatenate([one.cost, other.cost]))


PATTERN = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (1, 1, 0), (-1, -1, 0), (0, 0, 1), (0, 0, -1)])
"""Directions of the pattern search in (ln S, J / S, start)."""
DIAGONAL_PATTERN = np.concatenate([PATTERN, [(1, -1, 0), (-1, 1, 0)]])
"""The same with the other diagonal."""


def _neighbours(centres: NDArray[np.float64], steps: NDArray[np.float64], max_S: float) -> NDArray[np.float64]:
    """Candidates one step away from each centre, without duplicates."""
    rows = np.repeat(centres, len(steps), axis=0)
    step = np.tile(steps, (len(centres), 1))
    rows[:, 0] = np.minimum(rows[:, 0] * np.exp(step[:, 0]), max_S)
    rows[:, 1] = np.clip(rows[:, 1] + step[:, 1], 0.0, 1.0)
    rows[:, 3] = np.clip(rows[:, 3] + step[:, 2], -0.95, 0.95)
    rows = rows.round(12)
    rows = rows[np.lexsort(rows.T[::-1])]  # several times as fast as `numpy.unique` of rows
    return rows[np.append(True, (rows[1:] != rows[:-1]).any(axis=1))]
