"""The valves that are tried for a recorded position: of a grid, those that its moves tell, and ones near a good one.

A valve is a row: S [% of span], J / S [-], slope and level of the position over OP [its unit], lag and lateness of the
position [samples], and 1 for a stem that rests after every sample, 0 for one that goes on.
"""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import zip_longest
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.moves import told_by_moves
from stiction.diagnosis.identification.watched import LATEST
from stiction.models.compiled import kernel
from stiction.records.quantiles import quantiles

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["DELAYS", "LAGS", "by_turns", "draws", "first_apart", "grid", "near_by", "told"]

DELAYS = ((0.3, 0), (2.0, 0), (0.3, 1), (0.3, 2))
"""Lags and whole samples late that are tried at first, with every valve [samples]."""
LAGS = (0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
"""Lags tried at first with a good valve [samples]."""
SOME_LAGS = (0.3, 2.0)
"""Lags tried at first with a valve that the moves tell [samples]."""
OFF = np.array([-0.04, 0.0, 0.04])
"""Levels tried at first, about that on which the position lies evenly, as shares of OP's swing [-]."""
STEPS = np.array([0.06, 0.06, 0.02, 0.08, 0.4, 0.8, 0.0])
"""First steps of a closer search: of how far OP goes from a resting stem before it slips and of how far a moving one
stays behind OP (both in S), of the slope (relative), of the level (in S), of the lag (relative) and of how late it is
[samples]."""
TINY = float(np.finfo(float).tiny)
"""In place of an S of 0, that J / S is a number [% of span]."""
ANY_LAG = 0.3
"""Added to a lag before it is changed by a share of it [samples]: one of none would stay so."""
ANY_BAND = 0.3
"""Least size of a step in S and in level, as a share of the largest S that is looked for [-], for the same reason."""


def grid(
    op: NDArray[np.float64],
    y: NDArray[np.float64],
    swing: float,
    S: NDArray[np.float64],
    ratio: NDArray[np.float64],
    slopes: NDArray[np.float64],
    delays: list[tuple[float, int]] | tuple[tuple[float, int], ...],
    stops: tuple[float, ...] = (0.0,),
) -> NDArray[np.float64]:
    """All rows of these, each on the level about which the position `y` lies evenly; `swing` is OP's."""
    rows, mean = [], float(op.mean())
    for slope in slopes:
        off = quantiles(y - slope * op, *((0.02, 0.98) if S[-1] > 0.0 else (0.5, 0.5)))
        levels = 0.5 * float(np.sum(off)) + slope * mean + slope * OFF * swing
        axes = np.meshgrid(S, ratio, slope, levels, 0.0, 0.0, stops, indexing="ij")
        one = np.stack([axis.ravel() for axis in axes], axis=1)
        for delay in delays:
            rows.append(one.copy())
            rows[-1][:, 4:6] = delay
    return np.concatenate(rows)


def told(
    op: NDArray[np.float64], y: NDArray[np.float64], noise: float, slopes: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Rows of the valves that the plain moves of the position tell, with stems that go on and that rest."""
    rows, mean = [], float(op.mean())
    for slope in slopes:
        for late in range(LATEST + 1):
            by_moves = told_by_moves(op[: op.size - late], y[late:], slope, noise)
            if by_moves is not None:
                S, J, level = by_moves
                at_mean = level + slope * mean
                rows += [[S, J / S, slope, at_mean, lag, late, stops] for lag in SOME_LAGS for stops in (0.0, 1.0)]
    return np.array(rows).reshape(-1, 7)


def first_apart(rows: NDArray[np.float64], most: int) -> list[NDArray[np.float64]]:
    """The first rows, up to `most`, that are apart from those before them in S, J / S, scale or delay."""
    found = np.empty(most, dtype=np.int64)
    return [rows[i] for i in found[: _apart(np.ascontiguousarray(rows), found)]]


@kernel
def _apart(rows, found):
    """Fill `found` (n,) with which rows are apart from those found before, up to n of them; returns how many are."""
    count = 0
    for i in range(rows.shape[0]):
        near = False
        for one in found[:count]:
            near |= (
                abs(rows[i, 0] - rows[one, 0]) <= 0.1 * rows[one, 0]
                and abs(rows[i, 1] - rows[one, 1]) <= 0.25
                and rows[i, 2] == rows[one, 2]
                and abs(rows[i, 4] + rows[i, 5] - rows[one, 4] - rows[one, 5]) <= 1.0 + 0.3 * rows[one, 4]
            )
        if not near:
            found[count] = i
            count += 1
            if count == found.shape[0]:
                break
    return count


def by_turns(rows: list[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    """Rows with stems that go on and with such as rest by turns: no step of a search leads from one to the other."""
    goes_on, rests = ([row for row in rows if row[6] == stops] for stops in (0.0, 1.0))
    return [row for pair in zip_longest(goes_on, rests) for row in pair if row is not None]


@lru_cache(maxsize=8)
def draws(shapes: tuple[tuple[int, int, int], ...]) -> tuple[NDArray[np.float64], ...]:
    """Chance for `near_by`: how far each entry is changed and whether, shape (2, searches, rounds, tries, 7) for each.

    The same for every search of so many, so that a record is always told the same; kept, since drawing takes as long as
    changing.
    """
    rng, drawn = np.random.default_rng(0), tuple(np.empty((2, *shape, 7)) for shape in shapes)
    for one, shape in zip(drawn, shapes, strict=True):
        for i, k in np.ndindex(shape[:2]):
            rng.standard_normal(out=one[0, i, k])
            rng.random(out=one[1, i, k])
    return drawn


def near_by(
    rows: NDArray[np.float64],
    near: NDArray[np.float64],
    chance: NDArray[np.float64],
    bounds: NDArray[np.float64],
    noise: float,
) -> NDArray[np.float64]:
    """Rows about each of some, some of their entries changed, shape (n, tries, 7).

    S and J are changed by (S + J) / 2, which says when a stem slips, and by (S - J) / 2, which says where it then is:
    what the position tells of one it hardly tells of the other.

    Parameters
    ----------
    rows : ndarray, shape (n, 7)
        The valves.
    near : ndarray, shape (n,)
        Size of the steps, 1 for `STEPS` [-].
    chance : ndarray, shape (2, n, tries, 7)
        How far each entry is changed and whether (see `draws`).
    bounds : ndarray, shape (n, 7)
        Least and largest S [% of span] and J / S [-], a slope [unit of the position per % of span], and its least and
        largest multiple [-].
    noise : float
        Of the position [its unit]: a level is changed by no less.

    Returns
    -------
    ndarray, shape (n, tries, 7)
    """
    change = near[:, np.newaxis, np.newaxis] * STEPS * chance[0] * (chance[1] < 0.5)
    others = np.empty(change.shape)
    _change(rows, change, np.exp(change[:, :, 4]), bounds, noise, others)
    return others


@kernel
def _change(rows, change, longer, bounds, noise, others):
    """Fill `others` (n, tries, 7) with `rows` changed by `change`, and their lags by factors `longer` (n, tries)."""
    for i in range(rows.shape[0]):
        row = rows[i]
        least, most, low, high = bounds[i, 0], bounds[i, 1], bounds[i, 2], bounds[i, 3]
        slope, under, over = bounds[i, 4], bounds[i, 5], bounds[i, 6]
        size = max(row[0], ANY_BAND * most)
        height = math.copysign(max(size * abs(row[2]), noise / STEPS[3]), row[2])
        for t in range(change.shape[1]):
            by, other = change[i, t], others[i, t]
            reach = 0.5 * row[0] * (1.0 + row[1]) + size * by[0]
            behind = 0.5 * row[0] * (1.0 - row[1]) + size * by[1]
            other[0] = min(max(reach + behind, least), most)
            other[1] = min(max((reach - behind) / max(other[0], TINY), low), high)
            other[2] = slope * min(max(row[2] * (1.0 + by[2]) / slope, under), over)
            other[3] = row[3] + height * by[3]
            other[4] = min(max((row[4] + ANY_LAG) * longer[i, t] - ANY_LAG, 0.0), LAGS[-1])
            other[5] = min(max(row[5] + np.rint(by[5]), 0.0), float(LATEST))
            other[6] = row[6]
