"""Candidate valves, and the pattern search that refines the best of them: the one search driver of this room."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

__all__ = ["Candidates", "Valve", "combinations", "joined", "pattern_search"]


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
        """The best candidates that are not close to a better one, shape (<= count, 4).

        Parameters
        ----------
        count : int
            Number of candidates at most.
        S_distance : float
            Smallest distance in ln S [-].
        ratio_distance : float
            Smallest distance in J / S [-].
        """
        order = self._order()
        rows = self.valves[order]
        log_S = np.log(rows[:, 0])
        free = np.ones(len(rows), dtype=bool)
        chosen: list[int] = []
        while len(chosen) < count and free.any():
            i = int(np.argmax(free))
            chosen.append(i)
            near = np.abs(log_S - log_S[i]) <= S_distance
            free &= ~(near & (np.abs(rows[:, 1] - rows[i, 1]) <= ratio_distance) & (rows[:, 2] == rows[i, 2]))
        return rows[chosen]


def combinations(*axes: NDArray[np.float64]) -> NDArray[np.float64]:
    """All combinations of values, one a row."""
    return np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)


def pattern_search(
    evaluate: Callable[[NDArray[np.float64]], Candidates],
    found: Candidates,
    steps: Sequence[tuple[float, float, float, int]],
    max_S: float,
    *,
    diagonal: bool = False,
) -> Candidates:
    """Add the neighbours of the best candidates, with smaller and smaller steps.

    Parameters
    ----------
    evaluate : callable
        From candidate rows to `Candidates`.
    found : Candidates
        Where to begin.
    steps : sequence of tuple
        For each round the steps in ln S, in J / S and in the start, and the number of candidates refined [-].
    max_S : float
        Largest S [% of span].
    diagonal : bool
        Try a larger S with a smaller J / S too, and the reverse: a valve that breaks loose at the same distance.

    Returns
    -------
    Candidates
        All of them.
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
    return np.unique(rows.round(12), axis=0)
