"""Search for groups: clusters in bins of the period, those that change together, grown by other such loops, joined."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.fleet.coherence import (
    changes_of,
    coherence_floor,
    coherence_matrix,
    common_envelope,
    link_coherent,
    related_loops,
)
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

GROWTH_QUANTILE = 0.95
"""Quantile of the coherence of unrelated changes that a loop must exceed to join a group that is there [-]."""

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
    """A group that was found: period [s], rows of members and of perhaps members, floor."""

    period: float
    members: list[int]
    perhaps: list[int]
    floor: float


@dataclass
class GroupSearch:
    """The loops and their oscillations, and which of these have a group already."""

    means: Sequence[BlockMeans]
    rows: list[OscillationRow]
    min_coherence: float
    rng: np.random.Generator
    linked: NDArray[np.bool_]
    """Pairs of loops that a connection links."""
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
        return max(self.min_coherence, coherence_floor(envelopes, self.rng, quantile=self.quantile(period, bin_width)))

    def quantile(self, period: float, bin_width: float) -> float:
        """Quantile that of all loops near a period [s] less than one exceeds by chance on average [-]."""
        return max(0.95, 1.0 - 0.5 / max(1, len(self.near(period, 2.0 * bin_width))))

    def related(self, chosen: Sequence[int], period: float, quantile: float) -> list[list[int]]:
        """Sets of the chosen rows whose oscillations change together, or whose loops are connected."""
        changes = changes_of(self.envelopes(chosen, period))
        loops = [self.rows[k].loop for k in chosen]
        found = related_loops(changes, quantile, self.linked[np.ix_(loops, loops)])
        return [[chosen[k] for k in each] for each in found]


def search_groups(search: GroupSearch, bin_width: float) -> list[FoundGroup]:
    """Find all groups.

    Parameters
    ----------
    search : GroupSearch
        The loops and their oscillations.
    bin_width : float
        Largest relative difference of the periods that are compared [-].

    Returns
    -------
    list of FoundGroup
        The groups, each with the rows of its members.
    """
    found: list[FoundGroup] = []
    for period, cluster, floor in _clusters(search, bin_width):
        left = [k for k in cluster if k not in search.used]
        for chosen in search.related(left, period, search.quantile(period, bin_width)) if len(left) > 1 else ():
            if len({search.rows[k].loop for k in chosen}) < 2:
                continue
            members, perhaps = _grow(search, period, chosen, floor, bin_width)
            search.used |= set(members)
            found.append(FoundGroup(period, members, perhaps, floor))
    found = _merge(search, found, bin_width)
    return [one for one in found if not _is_harmonic(one, found, search.rows)]


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
        coherence = np.abs(envelopes[len(chosen) :] @ common.conj())
        coherent = [k for k, each in zip(near, coherence, strict=True) if each >= floor]
        first = set(chosen)
        related = [sets[0] for k in coherent if (sets := search.related([*chosen, k], period, GROWTH_QUANTILE))]
        for k in (k for one in related for k in one if k not in first):
            if rows[k].loop not in loops:
                loops.add(rows[k].loop)
                (members if rows[k].oscillation.regularity > 1.0 else perhaps).append(k)
    return members, perhaps


def _merge(search: GroupSearch, found: list[FoundGroup], bin_width: float) -> list[FoundGroup]:
    """Join groups whose common oscillations cohere and change together at the mean of their periods, largest first."""
    merged: list[FoundGroup] = []
    for one in found:
        for k, other in enumerate(merged):
            if abs(np.log(one.period / other.period)) > _period_uncertainty(search.rows, one, other):
                continue
            period = float(np.sqrt(one.period * other.period))
            commons = [common_envelope(search.envelopes(each.members, period)) for each in (one, other)]
            loops = [[search.rows[k].loop for k in each.members] for each in (one, other)]
            related = related_loops(changes_of(np.array(commons)), search.quantile(period, bin_width))
            is_related = bool(related) or search.linked[np.ix_(*loops)].any()
            if is_related and abs(commons[0] @ commons[1].conj()) >= other.floor:
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


def _envelopes(signals: list[tuple[BlockMeans, str]], period: float) -> NDArray:
    """Envelopes of norm 1, shape (n_signals, n_windows); zeros where a signal is missing."""
    envelopes = [complex_envelope(x, period / dt) for x, dt in (signal_at(one, period, name) for one, name in signals)]
    n = max(envelope.size for envelope in envelopes)
    stacked = np.array([np.resize(e, n) if e.size else np.zeros(n, dtype=complex) for e in envelopes])
    norm = np.linalg.norm(stacked, axis=1, keepdims=True)
    return np.divide(stacked, norm, out=np.zeros_like(stacked), where=norm > 0.0)
