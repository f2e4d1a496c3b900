"""Which loops share an oscillation: common periods, then coherence of the complex envelopes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.errors import ParameterError, require_count, require_positive, require_seed
from stiction.fleet.block_means import BlockMeans, common_clock, make_block_means
from stiction.fleet.group import Group, Member
from stiction.fleet.loop_oscillations import (
    HARMONICS,
    SAME_PERIOD,
    LoopOscillation,
    complex_envelope,
    find_loop_oscillations,
    signal_at,
)
from stiction.fleet.root_cause import rank_roots

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from stiction.fleet.root_cause import LoopVerdict
    from stiction.records.record import LoopRecord

__all__ = ["coherence_floor", "coherence_matrix", "group_oscillations"]

SHIFTS = 200
"""Pairs of envelopes that are shifted against each other to find the coherence of unrelated loops [-]."""
MAX_FLOOR = 0.9
"""Largest floor of the coherence [-]: two steady waves cohere at every shift."""
MAX_MERGED = 0.4
"""Difference of the logarithms of two periods up to which groups are compared [-]."""


class _Row(NamedTuple):
    """One oscillation of one loop."""

    loop: int
    oscillation: LoopOscillation


class _Found(NamedTuple):
    """A group that was found: period [s], rows of members and of perhaps members, floor of the coherence."""

    period: float
    members: list[int]
    perhaps: list[int]
    floor: float


@dataclass
class _Search:
    """The loops and their oscillations, and which of these have a group already."""

    means: Sequence[BlockMeans]
    rows: list[_Row]
    min_coherence: float
    rng: np.random.Generator
    used: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.order = np.argsort([row.oscillation.period for row in self.rows], kind="stable")
        self.logs = np.log([self.rows[k].oscillation.period for k in self.order])

    def near(self, period: float, distance: float) -> list[int]:
        """Rows whose period differs from `period` [s] by no more than `distance` in the logarithm [-]."""
        first, last = np.searchsorted(self.logs, np.log(period) + distance * np.array([-1.0, 1.0]))
        return [int(k) for k in self.order[first:last]]

    def envelopes(self, chosen: Sequence[int], period: float) -> NDArray:
        """Envelopes of the chosen rows at one period, shape (n_rows, n_windows), each of norm 1."""
        return _envelopes([(self.means[self.rows[k].loop], self.rows[k].oscillation.signal) for k in chosen], period)


def group_oscillations(
    loops: Sequence[LoopRecord | BlockMeans],
    *,
    verdicts: Mapping[str, LoopVerdict] | None = None,
    connections: Iterable[tuple[str, str]] = (),
    spans: Mapping[str, tuple[float, float]] | None = None,
    min_coherence: float = 0.6,
    bin_width: float = 0.04,
    max_chance: float = 0.2,
    max_blocks: int = 4096,
    seed: int = 0,
) -> tuple[Group, ...]:
    """Group the loops that share an oscillation, and rank the loops of each group as its source.

    Parameters
    ----------
    loops : sequence of LoopRecord or of BlockMeans
        One record for each loop, all of the same time; or their block means on one clock.
    verdicts : mapping of str to LoopVerdict, optional
        Tag -> what the diagnosis says of the loop.
    connections : iterable of (str, str), optional
        Tags (from, to) of loops that a stream, a common header or a control signal connects.
    spans : mapping of str to (float, float), optional
        Tag -> range of the transmitter [engineering units].
    min_coherence : float
        Smallest coherence of the envelopes of two loops in one group [-].
    bin_width : float
        Largest relative difference of the periods that are compared [-].
    max_chance : float
        Largest probability that so many unrelated loops have the same period by chance [-]; 1 keeps every group.
    max_blocks : int
        Largest number of block means of a signal [-].
    seed : int
        Seed of the shifts that give the coherence of unrelated loops.

    Returns
    -------
    tuple of Group
        The groups, the largest first; empty where no two loops share an oscillation.

    Raises
    ------
    RecordError
        When there is no record, or only some of the records have a start time.
    ParameterError
        When a number is outside its limits, two loops have the same tag, or block means are on different clocks.

    Notes
    -----
    1. Each loop: periods from the zero crossings of the autocorrelation of control error and OP (`thornhill2003`).
    2. Regular oscillations are collected in overlapping bins of the logarithm of the period. In each bin every signal
       is demodulated in windows of three periods.
    3. The coherence of two envelopes is |E E*|, normalised. The floor is the 95 % quantile of the coherence of
       envelopes that are shifted circularly against each other. Average linkage cuts at the floor.
    4. Groups whose common oscillations cohere at the mean of their periods are one: the period that a loop shows of an
       irregular oscillation differs from loop to loop.
    5. Groups that chance explains are dropped: with m unrelated oscillations per unit of log T near the period T and a
       record of length L, lambda = 2 m T / L loops coincide with one loop, and by Poisson's distribution n - 1 or more
       do so with the probability `Group.chance`.
    6. A loop whose own autocorrelation is not regular enough, but whose envelope coheres with a group, is listed under
       `perhaps_also`.

    The cost grows with the number of loops: only loops of one bin are compared in pairs.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> rng = np.random.default_rng(0)
    >>> wave = np.cumsum(rng.normal(2 * np.pi / 40, 0.05, 4000))
    >>> noise = rng.normal(0.0, 0.2, (3, 4000))
    >>> pvs = [np.sin(wave) + noise[0], 0.5 * np.sin(wave - 1.0) + noise[1], noise[2]]
    >>> records = [LoopRecord(f"FIC-{k}", 1.0, op=50.0 - pv, pv=pv) for k, pv in enumerate(pvs)]
    >>> [(round(group.period), group.tags) for group in group_oscillations(records)]
    [(40, ('FIC-0', 'FIC-1'))]
    """
    min_coherence, bin_width = _check(min_coherence, bin_width)
    if not loops:
        return ()
    means = _means(loops, require_count("max_blocks", max_blocks))
    rows = [_Row(k, one) for k, each in enumerate(means) for one in find_loop_oscillations(each)]
    search = _Search(means, rows, min_coherence, np.random.default_rng(require_seed(seed)))
    found: list[_Found] = []
    for period, chosen, floor in _clusters(search, bin_width):
        chosen = [k for k in chosen if k not in search.used]
        if len({rows[k].loop for k in chosen}) < 2:
            continue
        members, perhaps = _grow(search, period, chosen, floor, bin_width)
        search.used |= set(members)
        found.append(_Found(period, members, perhaps, floor))
    found = _merge(search, found)
    found = [one for one in found if not _is_harmonic(one, found, rows)]
    links = [(a, b) for a, b in connections]
    chances = [_chance(search, one, found) for one in found]
    groups = [
        _make_group(search, one, chance, verdicts or {}, links, spans or {})
        for one, chance in zip(found, chances, strict=True)
        if chance <= max_chance
    ]
    return tuple(sorted(groups, key=lambda group: (-len(group.members), group.period)))


def _check(min_coherence: float, bin_width: float) -> tuple[float, float]:
    if not 0.0 < require_positive("min_coherence", min_coherence) < 1.0:
        raise ParameterError(f"min_coherence = {min_coherence:g} is not below 1; give a value between 0 and 1.")
    if not 0.0 < require_positive("bin_width", bin_width) <= 0.2:
        raise ParameterError(f"bin_width = {bin_width:g} is above 0.2; give a value between 0 and 0.2.")
    return float(min_coherence), float(bin_width)


def _means(loops: Sequence[LoopRecord | BlockMeans], max_blocks: int) -> list[BlockMeans]:
    """Block means of all loops on one clock."""
    records = [one for one in loops if not isinstance(one, BlockMeans)]
    if records and len(records) < len(loops):
        raise ParameterError("loops mixes records and block means; give all of one kind.")
    if records:
        clock = common_clock(records, max_blocks=max_blocks)
        means = [make_block_means(record, clock) for record in records]
    else:
        means = [one for one in loops if isinstance(one, BlockMeans)]
        if any(one.clock != means[0].clock for one in means):
            raise ParameterError("loops holds block means on different clocks; make them with one common_clock.")
    tags = [one.tag for one in means]
    if len(set(tags)) < len(tags):
        double = next(tag for tag in tags if tags.count(tag) > 1)
        raise ParameterError(f"Two loops have the tag {double!r}; give each loop a tag of its own.")
    return means


def _clusters(search: _Search, bin_width: float) -> list[tuple[float, list[int], float]]:
    """Clusters of all bins: period [s], rows, floor; the largest and most coherent first."""
    rows = search.rows
    regular = sorted((k for k, row in enumerate(rows) if row.oscillation.regular), key=lambda k: _period(rows[k]))
    logs = np.log([_period(rows[k]) for k in regular])
    found: dict[tuple[int, ...], tuple[float, float, float]] = {}
    first = 0
    while first < len(regular):
        last = int(np.searchsorted(logs, logs[first] + bin_width, side="right"))
        chosen = regular[first:last]
        if len({rows[k].loop for k in chosen}) > 1:
            period = float(np.exp(np.median(logs[first:last])))
            envelopes = search.envelopes(chosen, period)
            coherence = coherence_matrix(envelopes)
            floor = max(search.min_coherence, coherence_floor(envelopes, search.rng))
            for cluster in _link(coherence, floor):
                mean = float(coherence[np.ix_(cluster, cluster)].mean())
                found[tuple(chosen[k] for k in cluster)] = (period, mean, floor)
        first = int(np.searchsorted(logs, logs[first] + 0.5 * bin_width, side="right"))
    ranked = sorted(found.items(), key=lambda item: (-len(item[0]), -item[1][1]))
    return [(period, list(chosen), floor) for chosen, (period, _, floor) in ranked]


def _link(coherence: NDArray[np.float64], floor: float) -> list[NDArray[np.intp]]:
    """Clusters of two or more by average linkage, cut at the floor."""
    from scipy.cluster.hierarchy import fcluster, linkage
    from scipy.spatial.distance import squareform

    distance = np.clip(1.0 - coherence, 0.0, 1.0)
    np.fill_diagonal(distance, 0.0)
    labels = fcluster(linkage(squareform(distance, checks=False), "average"), 1.0 - floor, "distance")
    clusters = [np.flatnonzero(labels == label) for label in np.unique(labels)]
    return [cluster for cluster in clusters if cluster.size > 1]


def _grow(
    search: _Search, period: float, chosen: list[int], floor: float, bin_width: float
) -> tuple[list[int], list[int]]:
    """Rows of other loops with nearly this period that cohere with the group: members, and perhaps members."""
    rows = search.rows
    loops = {rows[k].loop for k in chosen}
    near = [k for k in search.near(period, 2.0 * bin_width) if rows[k].loop not in loops and k not in search.used]
    members, perhaps = list(chosen), []
    if near:
        envelopes = search.envelopes([*chosen, *near], period)
        common = _common(envelopes[: len(chosen)])
        for k, coherence in zip(near, np.abs(envelopes[len(chosen) :] @ common.conj()), strict=True):
            if coherence >= floor and rows[k].loop not in loops:
                loops.add(rows[k].loop)
                (members if rows[k].oscillation.regularity > 1.0 else perhaps).append(k)
    return members, perhaps


def _merge(search: _Search, found: list[_Found]) -> list[_Found]:
    """Join groups whose common oscillations cohere at the mean of their periods, the largest groups first."""
    merged: list[_Found] = []
    for one in found:
        for k, other in enumerate(merged):
            if abs(np.log(one.period / other.period)) > _period_uncertainty(search.rows, one, other):
                continue
            period = float(np.sqrt(one.period * other.period))
            commons = [_common(search.envelopes(each.members, period)) for each in (one, other)]
            if abs(commons[0] @ commons[1].conj()) >= other.floor:
                members = other.members + _of_new_loops(search.rows, one.members, other.members)
                perhaps = _of_new_loops(search.rows, other.perhaps + one.perhaps, members)
                merged[k] = _Found(other.period, members, perhaps, other.floor)
                break
        else:
            merged.append(one)
    return merged


def _period_uncertainty(rows: list[_Row], *groups: _Found) -> float:
    """Difference of the logarithms of two periods that irregularity explains: two deviations, with r = T / (3 sigma)."""
    regularity = min(float(np.median([rows[k].oscillation.regularity for k in one.members])) for one in groups)
    return min(MAX_MERGED, 2.0 / (3.0 * regularity))


def _of_new_loops(rows: list[_Row], chosen: list[int], present: list[int]) -> list[int]:
    """Those of the chosen rows whose loops are not among the present ones, one for each loop."""
    loops = {rows[k].loop for k in present}
    first = {rows[k].loop: k for k in reversed(chosen)}
    return [k for loop, k in first.items() if loop not in loops]


def _common(envelopes: NDArray) -> NDArray:
    """Common oscillation of a group: first principal component of the envelopes, shape (n_windows,)."""
    return np.linalg.svd(envelopes, full_matrices=False)[2][0]


def _is_harmonic(one: _Found, found: list[_Found], rows: list[_Row]) -> bool:
    """Whether most loops of a group are in another one with 2 to 7 times the period."""
    loops = {rows[k].loop for k in one.members}
    for other in found:
        shared = loops & {rows[k].loop for k in (*other.members, *other.perhaps)}
        orders = (abs(other.period / one.period / n - 1.0) < SAME_PERIOD for n in HARMONICS)
        if 2 * len(shared) >= len(loops) and any(orders):
            return True
    return False


def _duration(means: BlockMeans, period: float) -> float:
    """Length of the signals in which a period is looked at [s]."""
    clock = means.clock
    dt = signal_at(means, period, "op")[1]
    return dt * (clock.fast_count if clock.fast_count and dt == clock.fast_dt else clock.count)


def _chance(search: _Search, one: _Found, found: list[_Found], *, width: float = 0.2) -> float:
    """Probability that the loops of a group have the same period by chance; other groups count as one loop each."""
    from scipy.special import gammainc

    loops = {search.rows[k].loop for k in (*one.members, *one.perhaps)}
    others = {k: number for number, other in enumerate(found) if other is not one for k in other.members}
    near = [k for k in search.near(one.period, width) if search.rows[k].oscillation.regular]
    unrelated = {(k in others, others.get(k, k)) for k in near if search.rows[k].loop not in loops}
    expected = len(unrelated) / (2.0 * width) * 2.0 * one.period / _duration(search.means[0], one.period)
    return float(gammainc(len({search.rows[k].loop for k in one.members}) - 1, expected)) if expected else 0.0


def _make_group(
    search: _Search,
    found: _Found,
    chance: float,
    verdicts: Mapping[str, LoopVerdict],
    connections: list[tuple[str, str]],
    spans: Mapping[str, tuple[float, float]],
) -> Group:
    """Describe one group and rank its loops."""
    rows, means = search.rows, search.means
    chosen = [rows[k] for k in found.members]
    period = float(np.median([_period(row) for row in chosen]))
    envelopes = search.envelopes(found.members, period)
    along = envelopes @ _common(envelopes).conj()
    members = [
        Member(
            means[row.loop].tag, _period(row), row.oscillation.regularity, row.oscillation.signal,
            min(1.0, float(abs(part))), float(np.degrees(np.angle(part))),
        )
        for row, part in zip(chosen, along, strict=True)
    ]  # fmt: skip
    roots = rank_roots(
        [means[row.loop] for row in chosen], period, verdicts=verdicts, connections=connections, spans=spans
    )
    order = {root.tag: k for k, root in enumerate(roots)}
    members.sort(key=lambda member: order[member.tag])
    perhaps = tuple(means[rows[k].loop].tag for k in found.perhaps)
    duration = _duration(means[0], period)
    around = [rows[k] for k in search.near(period, min(1.0, period / duration))]
    near = [_period(row) for row in around if row.oscillation.regular and means[row.loop].tag not in order]
    remark = _remark(period, duration, near)
    return Group(period, tuple(members), perhaps, roots, found.floor, period**2 / duration, chance, remark)


def _remark(period: float, duration: float, near: list[float]) -> str:
    """Say which other periods the record is too short to tell from the one of the group."""
    resolution = period**2 / duration
    close = sorted((p for p in near if abs(p - period) < resolution), key=lambda p: abs(p - period))
    if not close:
        return ""
    difference = max(abs(close[-1] - period), 1e-3 * period)
    return (
        f"{len(close)} more oscillation{'s' if len(close) > 1 else ''} with a period within {resolution:.3g} s of this "
        f"one cannot be told from it: periods {difference:.2g} s apart need {period**2 / difference / 3600.0:.3g} h of "
        f"data, the record has {duration / 3600.0:.3g} h."
    )


def _envelopes(signals: list[tuple[BlockMeans, str]], period: float) -> NDArray:
    envelopes = [complex_envelope(x, period / dt) for x, dt in (signal_at(one, period, name) for one, name in signals)]
    n = max(envelope.size for envelope in envelopes)
    stacked = np.array([np.resize(e, n) if e.size else np.zeros(n, dtype=complex) for e in envelopes])
    norm = np.linalg.norm(stacked, axis=1, keepdims=True)
    return np.divide(stacked, norm, out=np.zeros_like(stacked), where=norm > 0.0)


def coherence_matrix(envelopes: NDArray) -> NDArray[np.float64]:
    """Coherence of every two envelopes.

    Parameters
    ----------
    envelopes : ndarray of complex, shape (n_loops, n_windows)
        Complex envelopes at one period, each of norm 1.

    Returns
    -------
    ndarray, shape (n_loops, n_loops)
        |E E*|, from 0 to 1 [-].

    Examples
    --------
    >>> wave = np.exp(1j * np.array([[0.0, 0.1, 0.3], [2.0, 2.1, 2.3], [0.0, 2.1, 4.2]])) / np.sqrt(3.0)
    >>> coherence_matrix(wave).round(2).tolist()
    [[1.0, 1.0, 0.1], [1.0, 1.0, 0.1], [0.1, 0.1, 1.0]]
    """
    return np.abs(envelopes @ envelopes.conj().T)


def coherence_floor(envelopes: NDArray, rng: np.random.Generator, *, quantile: float = 0.95) -> float:
    """Coherence that envelopes reach when they are shifted circularly against each other.

    Parameters
    ----------
    envelopes : ndarray of complex, shape (n_loops, n_windows)
        Complex envelopes at one period, each of norm 1.
    rng : numpy.random.Generator
        Where pairs and shifts are drawn from.
    quantile : float
        Quantile of the shifted coherences that is the floor [-].

    Returns
    -------
    float
        The floor, at most 0.9 [-].

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> noise = rng.normal(size=(10, 100)) + 1j * rng.normal(size=(10, 100))
    >>> noise /= np.linalg.norm(noise, axis=1, keepdims=True)
    >>> 0.1 < coherence_floor(noise, rng) < 0.25
    True
    """
    n, windows = envelopes.shape
    if windows < 4:
        return MAX_FLOOR
    a, b = rng.integers(0, n, (2, SHIFTS))
    shift = rng.integers(2, windows - 1, SHIFTS)
    index = (np.arange(windows) + shift[:, None]) % windows
    shifted = np.abs(np.einsum("ij,ij->i", envelopes[a], np.take_along_axis(envelopes[b], index, axis=1).conj()))
    return min(MAX_FLOOR, float(np.quantile(shifted, quantile)))


def _period(row: _Row) -> float:
    return row.oscillation.period
