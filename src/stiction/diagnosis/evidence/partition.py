"""Exact Bayesian change points of a short series: product partitions with two kinds of segment."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["Boundary", "Level", "find_boundaries", "last_beginnings"]


class Level(NamedTuple):
    """How a quantity varies in one kind of segment."""

    mean: float
    """Mean over all segments."""
    between: float
    """Standard deviation of the level from segment to segment."""
    within: float
    """Standard deviation about the level of a segment."""


class Boundary(NamedTuple):
    """A change from one kind of segment to the other."""

    first: int
    """First place after it."""
    kind: int
    """Kind of the segment that it begins: 0 or 1."""
    probability: float
    """Probability of such a change there, or one place beside it [-]."""


def find_boundaries(
    series: Sequence[NDArray[np.float64]],
    levels: Sequence[tuple[Level, Level]],
    *,
    hazard: float,
    least: float,
    shortest: int = 1,
) -> list[Boundary]:
    """Find the places where a series goes from one kind of segment to the other.

    Parameters
    ----------
    series : sequence of ndarray, shape (n,)
        Quantities, independent of one another; NaN where one is not known.
    levels : sequence of tuple of Level
        For each quantity its levels in segments of kind 0 and of kind 1.
    hazard : float
        Probability of a change at a place [-].
    least : float
        Probability from which a change is told [-].
    shortest : int
        Places of the shortest segment [-].

    Returns
    -------
    list of Boundary
        The changes of the most probable partition that are probable enough, in order.

    Notes
    -----
    The level of a segment is normal, and so are the values about it; its marginal likelihood is then known, and sums
    over all partitions follow from a recursion (Barry and Hartigan 1992; Adams and MacKay 2007).

    References
    ----------
    barry1992; adams2007

    Examples
    --------
    >>> x = np.array([0.1, -0.2, 0.0, 0.1, 3.1, 2.8, 3.0])
    >>> find_boundaries([x], [(Level(0.0, 0.5, 0.3), Level(3.0, 0.5, 0.3))], hazard=0.05, least=0.5)[0][:2]
    (4, 1)
    """
    n = series[0].size
    if n < 2 * shortest:
        return []
    weight, move = _segment_weights(_segment_likelihoods(series, levels), hazard, shortest), np.log(hazard)
    ahead, best = _ahead(weight, move), np.full((2, n), -np.inf)
    back = np.zeros((2, n), dtype=int)
    best[:, 0] = np.log(0.5)
    for t in range(1, n):
        for kind in (0, 1):
            steps = best[1 - kind, :t] + weight[1 - kind, :t, t - 1] + move
            back[kind, t] = int(np.argmax(steps))
            best[kind, t] = float(np.max(steps))
    behind = np.full((2, n), -np.inf)  # log probability of places t .. n-1, a segment beginning at t
    for t in range(n - 1, -1, -1):
        for kind in (0, 1):
            ends = np.append(behind[1 - kind, t + 1 :] + move, 0.0)
            behind[kind, t] = np.logaddexp.reduce(weight[kind, t, t:] + ends)
    total = np.logaddexp(*(ahead[:, 0] + behind[:, 0]))
    posterior = np.exp(ahead + behind - total)
    posterior[:, 0] = 0.0
    final = best + weight[:, :, n - 1]
    kind, first = (int(k) for k in np.unravel_index(np.argmax(final), final.shape))
    found: list[Boundary] = []
    while first > 0:
        near = posterior[kind, max(first - 1, 1) : first + 2]
        found.append(Boundary(first, kind, float(min(near.sum(), 1.0))))
        kind, first = 1 - kind, int(back[kind, first])
    return [one for one in reversed(found) if one.probability >= least]


def last_beginnings(
    series: Sequence[NDArray[np.float64]], levels: Sequence[tuple[Level, Level]], *, hazard: float, power: float
) -> NDArray[np.float64]:
    """Probability of each place that the last segment begins there [-], shape (n,).

    Arguments as for `find_boundaries`. The likelihood counts to a `power` below 1 [-], since quantities that are not
    independent of one another say less than they seem to.

    Examples
    --------
    >>> x = np.array([0.1, -0.2, 0.0, 0.1, 3.1, 2.8, 3.0])
    >>> last_beginnings([x], [(Level(0.0, 0.5, 0.3), Level(3.0, 0.5, 0.3))], hazard=0.05, power=1.0).round(2).tolist()
    [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]
    """
    weight = _segment_weights(power * _segment_likelihoods(series, levels), hazard, 1)
    joint = np.logaddexp.reduce(_ahead(weight, np.log(hazard)) + weight[:, :, -1], axis=0)
    return np.exp(joint - np.logaddexp.reduce(joint))


def _segment_weights(likelihoods: NDArray[np.float64], hazard: float, shortest: int) -> NDArray[np.float64]:
    """Log probability of places a .. b as one segment, shape (2, n, n): none changes within it, none is too short."""
    places = np.arange(likelihoods.shape[1])
    length = places[np.newaxis, :] - places[:, np.newaxis]
    return likelihoods + np.where(length >= shortest - 1, np.log1p(-hazard) * np.maximum(length, 0), -np.inf)


def _ahead(weight: NDArray[np.float64], move: float) -> NDArray[np.float64]:
    """Log probability of places 0 .. t-1 where a segment of a kind begins at t, shape (2, n)."""
    ahead = np.full(weight.shape[:2], -np.inf)
    ahead[:, 0] = np.log(0.5)
    for t in range(1, weight.shape[1]):
        for kind in (0, 1):
            ahead[kind, t] = np.logaddexp.reduce(ahead[1 - kind, :t] + weight[1 - kind, :t, t - 1] + move)
    return ahead


def _segment_likelihoods(
    series: Sequence[NDArray[np.float64]], levels: Sequence[tuple[Level, Level]]
) -> NDArray[np.float64]:
    """Log marginal likelihood of places a .. b as one segment of each kind, shape (2, n, n); for b >= a."""
    n = series[0].size
    out = np.zeros((2, n, n))
    for x, kinds in zip(series, levels, strict=True):
        known = np.isfinite(x)
        y = np.where(known, x, 0.0)
        count, total, square = (_sums(part) for part in (known.astype(float), y, y**2))
        count = np.maximum(count, 0.0)
        mean = total / np.maximum(count, 1.0)
        for kind, (centre, between, within) in enumerate(kinds):
            spread = square - count * mean**2
            out[kind] -= 0.5 * (
                count * np.log(2.0 * np.pi * within**2)
                + np.log1p(count * between**2 / within**2)
                + spread / within**2
                + count * (mean - centre) ** 2 / (within**2 + count * between**2)
            )
    return out


def _sums(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sums over places a .. b, shape (n, n)."""
    ends = np.concatenate([[0.0], np.cumsum(x)])
    return ends[np.newaxis, 1:] - ends[:-1, np.newaxis]
