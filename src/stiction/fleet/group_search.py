"""Search for groups: clusters in bins of the period, grown by other coherent loops, joined, and checked for chance."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.fleet.coherence import coherence_floor, coherence_matrix, common_envelope, link_coherent
from stiction.fleet.loop_oscillations import (
    HARMONICS,
    SAME_PERIOD,
    LoopOscillation,
    complex_envelope,
    signal_at,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.fleet.block_means import BlockMeans

__all__ = ["FoundGroup", "GroupSearch", "OscillationRow", "search_groups", "signal_duration"]

MAX_MERGED = 0.4
"""Difference of the logarithms of two periods up to which groups are compared [-]."""

MIN_WINDOWS = 4
"""Windows of the envelopes below which loops are not compared [-]: 7.5 periods."""


class OscillationRow(NamedTuple):
    """One oscillation of one loop."""

    loop: int
    oscillation: LoopOscillation

    @property
    def period(self) -> float:
        """Period [s]."""
        return self.oscillation.period


class FoundGroup(NamedTuple):
    """A group that was found: period [s], rows of members and of perhaps members, floor, chance."""

    period: float
    members: list[int]
    perhaps: list[int]
    floor: float
    chance: float = 0.0


@dataclass
class GroupSearch:
    """The loops and their oscillations, and which of these have a group already."""

    means: Sequence[BlockMeans]
    rows: list[OscillationRow]
    min_coherence: float
    rng: np.random.Generator
    used: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.order = np.argsort([row.period for row in self.rows], kind="stable")
        self.logs = np.log([self.rows[k].period for k in self.order])

    def near(self, period: float, distance: float) -> list[int]:
        """Rows whose period differs from `period` [s] by no more than `distance` in the logarithm [-]."""
        first, last = np.searchsorted(self.logs, np.log(period) + distance * np.array([-1.0, 1.0]))
        return [int(k) for k in self.order[first:last]]

    def envelopes(self, chosen: Sequence[int], period: float) -> NDArray:
        """Envelopes of the chosen rows at one period, shape (n_rows, n_windows), each of norm 1."""
        return _envelopes([(self.means[self.rows[k].loop], self.rows[k].oscillation.signal) for k in chosen], period)

    def floor(self, envelopes: NDArray, period: float, bin_width: float) -> float:
        """Coherence that of all loops near a period [s] less than one reaches by chance on average [-]."""
        compared = len(self.near(period, 2.0 * bin_width))
        quantile = max(0.95, 1.0 - 0.5 / max(1, compared))
        return max(self.min_coherence, coherence_floor(envelopes, self.rng, quantile=quantile))


def search_groups(search: GroupSearch, bin_width: float, max_chance: float) -> list[FoundGroup]:
    """Find all groups.

    Parameters
    ----------
    search : GroupSearch
        The loops and their oscillations.
    bin_width : float
        Largest relative difference of the periods that are compared [-].
    max_chance : float
        Largest probability that chance explains a group [-].

    Returns
    -------
    list of FoundGroup
        The groups, each with the rows of its members.
    """
    found: list[FoundGroup] = []
    for period, cluster, floor in _clusters(search, bin_width):
        chosen = [k for k in cluster if k not in search.used]
        if len({search.rows[k].loop for k in chosen}) < 2:
            continue
        members, perhaps = _grow(search, period, chosen, floor, bin_width)
        search.used |= set(members)
        found.append(FoundGroup(period, members, perhaps, floor))
    found = _merge(search, _drop_chance(search, found, max_chance))
    found = [one for one in found if not _is_harmonic(one, found, search.rows)]
    return _drop_chance(search, found, max_chance)


def _clusters(search: GroupSearch, bin_width: float) -> list[tuple[float, list[int], float]]:
    """Clusters of all bins: period [s], rows, floor; the largest and most coherent first."""
    rows = search.rows
    regular = sorted((k for k, row in enumerate(rows) if row.oscillation.regular), key=lambda k: rows[k].period)
    logs = np.log([rows[k].period for k in regular])
    found: dict[tuple[int, ...], tuple[float, float, float]] = {}
    first = 0
    while first < len(regular):
        last = int(np.searchsorted(logs, logs[first] + bin_width, side="right"))
        chosen = regular[first:last]
        if len({rows[k].loop for k in chosen}) > 1:
            period = float(np.exp(np.median(logs[first:last])))
            envelopes = search.envelopes(chosen, period)
            enough = envelopes.shape[1] >= MIN_WINDOWS
            coherence = coherence_matrix(envelopes)
            floor = search.floor(envelopes, period, bin_width) if enough else 1.0
            for cluster in link_coherent(coherence, floor) if enough else ():
                mean = float(coherence[np.ix_(cluster, cluster)].mean())
                found[tuple(chosen[k] for k in cluster)] = (period, mean, floor)
        first = int(np.searchsorted(logs, logs[first] + 0.5 * bin_width, side="right"))
    ranked = sorted(found.items(), key=lambda item: (-len(item[0]), -item[1][1]))
    return [(period, list(chosen), floor) for chosen, (period, _, floor) in ranked]


def _grow(
    search: GroupSearch, period: float, chosen: list[int], floor: float, bin_width: float
) -> tuple[list[int], list[int]]:
    """Rows of other loops with nearly this period that cohere with the group: members, and perhaps members."""
    rows = search.rows
    loops = {rows[k].loop for k in chosen}
    near = [k for k in search.near(period, 2.0 * bin_width) if rows[k].loop not in loops and k not in search.used]
    members, perhaps = list(chosen), []
    if near:
        envelopes = search.envelopes([*chosen, *near], period)
        common = common_envelope(envelopes[: len(chosen)])
        for k, coherence in zip(near, np.abs(envelopes[len(chosen) :] @ common.conj()), strict=True):
            if coherence >= floor and rows[k].loop not in loops:
                loops.add(rows[k].loop)
                (members if rows[k].oscillation.regularity > 1.0 else perhaps).append(k)
    return members, perhaps


def _merge(search: GroupSearch, found: list[FoundGroup]) -> list[FoundGroup]:
    """Join groups whose common oscillations cohere at the mean of their periods, the largest groups first."""
    merged: list[FoundGroup] = []
    for one in found:
        for k, other in enumerate(merged):
            if abs(np.log(one.period / other.period)) > _period_uncertainty(search.rows, one, other):
                continue
            period = float(np.sqrt(one.period * other.period))
            commons = [common_envelope(search.envelopes(each.members, period)) for each in (one, other)]
            if abs(commons[0] @ commons[1].conj()) >= other.floor:
                members = other.members + _of_new_loops(search.rows, one.members, other.members)
                perhaps = _of_new_loops(search.rows, other.perhaps + one.perhaps, members)
                merged[k] = FoundGroup(other.period, members, perhaps, other.floor)
                break
        else:
            merged.append(one)
    return merged


def _period_uncertainty(rows: list[OscillationRow], *groups: FoundGroup) -> float:
    """Difference of log periods that irregularity explains: two standard deviations, with r = T / (3 sigma)."""
    regularity = min(float(np.median([rows[k].oscillation.regularity for k in one.members])) for one in groups)
    return min(MAX_MERGED, 2.0 / (3.0 * regularity))


def _of_new_loops(rows: list[OscillationRow], chosen: list[int], present: list[int]) -> list[int]:
    """Those of the chosen rows whose loops are not among the present ones, one for each loop."""
    loops = {rows[k].loop for k in present}
    first = {rows[k].loop: k for k in reversed(chosen)}
    return [k for loop, k in first.items() if loop not in loops]


def _is_harmonic(one: FoundGroup, found: list[FoundGroup], rows: list[OscillationRow]) -> bool:
    """Whether most loops of a group are in another one with 2 to 7 times the period."""
    loops = {rows[k].loop for k in one.members}
    for other in found:
        shared = loops & {rows[k].loop for k in (*other.members, *other.perhaps)}
        orders = (abs(other.period / one.period / n - 1.0) < SAME_PERIOD for n in HARMONICS)
        if 2 * len(shared) >= len(loops) and any(orders):
            return True
    return False


def signal_duration(means: BlockMeans, period: float) -> float:
    """Length of the signals in which a period is looked at [s]."""
    clock = means.clock
    dt = signal_at(means, period, "op")[1]
    return dt * (clock.fast_count if clock.fast_count and dt == clock.fast_dt else clock.count)


def _drop_chance(search: GroupSearch, found: list[FoundGroup], max_chance: float) -> list[FoundGroup]:
    """Keep the groups that chance does not explain."""
    found = [one._replace(chance=_chance(search, one, found)) for one in found]
    return [one for one in found if one.chance <= max_chance]


def _chance(search: GroupSearch, one: FoundGroup, found: list[FoundGroup], *, width: float = 0.2) -> float:
    """Probability that the loops of a group have the same period by chance; other groups count as one loop each."""
    from scipy.special import gammainc

    loops = {search.rows[k].loop for k in (*one.members, *one.perhaps)}
    others = {k: number for number, other in enumerate(found) if other is not one for k in other.members}
    near = [k for k in search.near(one.period, width) if search.rows[k].oscillation.regular]
    unrelated = {(k in others, others.get(k, search.rows[k].loop)) for k in near if search.rows[k].loop not in loops}
    expected = len(unrelated) / (2.0 * width) * 2.0 * one.period / signal_duration(search.means[0], one.period)
    return float(gammainc(len({search.rows[k].loop for k in one.members}) - 1, expected)) if expected else 0.0


def _envelopes(signals: list[tuple[BlockMeans, str]], period: float) -> NDArray:
    """Envelopes of norm 1, shape (n_signals, n_windows); zeros where a signal is missing."""
    envelopes = [complex_envelope(x, period / dt) for x, dt in (signal_at(one, period, name) for one, name in signals)]
    n = max(envelope.size for envelope in envelopes)
    stacked = np.array([np.resize(e, n) if e.size else np.zeros(n, dtype=complex) for e in envelopes])
    norm = np.linalg.norm(stacked, axis=1, keepdims=True)
    return np.divide(stacked, norm, out=np.zeros_like(stacked), where=norm > 0.0)
