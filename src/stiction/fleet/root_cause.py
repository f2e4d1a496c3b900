"""Which loop of a group is the source: a sum of log odds, each part with its reason."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.display.number_format import format_number, format_probability
from stiction.errors import ParameterError
from stiction.fleet.group import RootCandidate, RootEvidence
from stiction.fleet.loop_oscillations import signal_at
from stiction.fleet.root_features import arrival_order, harmonics_share, nonlinearity_of, oscillation_amplitude

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from stiction.fleet.block_means import BlockMeans

__all__ = ["DEFAULT_WEIGHTS", "LoopVerdict", "RootWeights", "explain_connection", "linked_loops", "rank_roots"]


@dataclass(frozen=True, slots=True)
class LoopVerdict:
    """What the diagnosis says of one loop: the probability that it oscillates by itself."""

    stiction: float = 0.0
    """Probability that the valve sticks [-]."""
    tuning: float = 0.0
    """Probability that the loop oscillates because of its tuning [-]."""

    def __post_init__(self) -> None:
        for name in ("stiction", "tuning"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ParameterError(
                    f"{name} = {getattr(self, name)!r} is not a probability; give a value from 0 to 1."
                )

    @property
    def log_odds(self) -> float:
        """Log odds that one of the two is true, limited to those of 0.02 and 0.98 [-]."""
        either = 1.0 - (1.0 - self.stiction) * (1.0 - self.tuning)
        return float(np.log(np.clip(either, 0.02, 0.98) / np.clip(1.0 - either, 0.02, 0.98)))


@dataclass(frozen=True, slots=True)
class RootWeights:
    """Log odds that each finding adds, relative to the mean of the group; each part is limited to `limit`."""

    verdict: float = 1.0
    """Per log odds of the loop's own verdict [-]."""
    arrival: float = 5.0
    """Per period by which the oscillation arrives earlier [-]."""
    amplitude: float = 2.5
    """Per decade of the amplitude [-]."""
    share: float = 2.0
    """Per decade of the share of OP's variance that the oscillation carries [-]."""
    nonlinearity: float = 0.4
    """Per unit of Thornhill's N, which is cut to -1 to 3 [-]."""
    harmonics: float = 0.5
    """Per decade of the share of the third, fifth and seventh harmonic [-]."""
    cascade: float = 1.0
    """Added to a secondary loop and taken off its primary, where both are in the group [-]."""
    reach: float = 2.0
    """Per share of the group's other loops that the connections lead to [-]."""
    limit: float = 3.0
    """Largest size of one part [-]."""


DEFAULT_WEIGHTS = RootWeights()


class _Finding(NamedTuple):
    """One finding of all loops: value, value on the scale of its weight, and weight."""

    name: str
    values: NDArray[np.float64]
    scaled: NDArray[np.float64]
    weight: float


def rank_roots(
    members: Sequence[BlockMeans],
    period: float,
    *,
    verdicts: Mapping[str, LoopVerdict] | None = None,
    connections: Iterable[tuple[str, str]] = (),
    spans: Mapping[str, tuple[float, float]] | None = None,
    weights: RootWeights = DEFAULT_WEIGHTS,
) -> tuple[RootCandidate, ...]:
    """Rank the loops of a group as the source of its oscillation.

    Parameters
    ----------
    members : sequence of BlockMeans
        The loops of the group, on one clock.
    period : float
        Period of the group [s].
    verdicts : mapping of str to LoopVerdict, optional
        Tag -> what the diagnosis says of the loop. A loop without one counts as the mean of the others.
    connections : iterable of (str, str), optional
        Tags (from, to) of connected loops; loops outside the group may lie between.
    spans : mapping of str to (float, float), optional
        Tag -> range of the transmitter [engineering units]. With it the larger of the amplitudes of OP and PV over
        their spans counts, without it the one of OP alone.
    weights : RootWeights
        Log odds that each finding adds.

    Returns
    -------
    tuple of RootCandidate
        All members, the most likely source first.

    Notes
    -----
    The findings: the loop's own verdict; the order of arrival (`arrival_order`; delays for this purpose: `bauer2008`);
    amplitude over span, and its share of OP's variance, because a disturbance loses strength on its way; nonlinearity
    (`thornhill2005`) and odd harmonics, because processes are low-pass filters (`thornhill2003b`); topology, as a
    secondary loop disturbs its primary and a source must reach the other loops (`jiang2009`). A finding that is unknown
    of a loop counts as the group's mean. The probability is exp(score) over its sum: it holds if one of the members is
    the source.

    Examples
    --------
    >>> from stiction.fleet.block_means import common_clock, make_block_means
    >>> from stiction.records import LoopRecord
    >>> phase = np.cumsum(2 * np.pi / 40 * (1 + 0.3 * np.random.default_rng(0).standard_normal(4000)))
    >>> source, late = 2.0 * np.sin(phase), np.roll(np.sin(phase), 6)
    >>> records = [LoopRecord("FIC-1", 1.0, op=50 - late, pv=late), LoopRecord("FIC-2", 1.0, op=50 - source, pv=source)]
    >>> members = [make_block_means(record, common_clock(records)) for record in records]
    >>> rank_roots(members, 40.0)[0].tag
    'FIC-2'
    """
    tags = [one.tag for one in members]
    parts: list[list[RootEvidence]] = [[] for _ in members]
    for finding in _findings(members, period, verdicts or {}, list(connections), spans or {}, weights):
        known = np.isfinite(finding.scaled)
        if not known.any() or not np.ptp(finding.scaled[known]) > 0.0:
            continue
        about = np.where(known, finding.scaled - finding.scaled[known].mean(), 0.0)
        added = np.clip(finding.weight * about, -weights.limit, weights.limit)
        for k in np.flatnonzero(known):
            value = float(finding.values[k])
            parts[k].append(RootEvidence(finding.name, value, float(added[k]), _text(finding.name, value)))
    scores = np.array([sum(part.log_odds for part in each) for each in parts])
    odds = np.exp(scores - scores.max())
    probability, scores = odds / odds.sum(), scores - scores.mean()
    order = np.argsort(-scores, kind="stable")
    return tuple(RootCandidate(tags[k], float(scores[k]), float(probability[k]), tuple(parts[k])) for k in order)


def _findings(
    members: Sequence[BlockMeans],
    period: float,
    verdicts: Mapping[str, LoopVerdict],
    connections: list[tuple[str, str]],
    spans: Mapping[str, tuple[float, float]],
    weights: RootWeights,
) -> list[_Finding]:
    """All findings of all members."""
    rows = [_measure(one, period, spans.get(one.tag)) for one in members]
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    sizes = {x.size for one in members for x, _ in (signal_at(one, period, "op"), signal_at(one, period, "error"))}
    size = max(sizes)
    signals = []
    for one, is_error in zip(members, columns["error_shows_it"], strict=True):
        x, dt = signal_at(one, period, "error" if is_error else "op")
        signals.append((x if x.size else np.zeros(size), dt))
    delay = arrival_order(signals, period)
    own = np.array([verdicts[one.tag].log_odds if one.tag in verdicts else np.nan for one in members])
    reach, cascade = _topology(members, connections)
    amplitude, share, index = columns["amplitude"], columns["share"], columns["nonlinearity"]
    harmonics = columns["harmonics"]
    return [
        _Finding("verdict", own, own, weights.verdict),
        _Finding("arrival", delay * period, -delay, weights.arrival),
        _Finding("amplitude", amplitude, _decades(amplitude, 0.01), weights.amplitude),
        _Finding("share", share, _decades(share, 1e-3), weights.share),
        _Finding("nonlinearity", index, np.clip(index, -1.0, 3.0), weights.nonlinearity),
        _Finding("harmonics", harmonics, _decades(harmonics, 1e-3), weights.harmonics),
        _Finding("cascade", cascade, cascade, weights.cascade),
        _Finding("reach", reach, reach, weights.reach),
    ]


def _text(name: str, value: float) -> str:
    """Sentence for one loop."""
    if name == "verdict":
        chance = format_probability(1.0 / (1.0 + math.exp(-value)))
        return f"Its own record shows a fault of valve or tuning with probability {chance}."
    if name == "arrival":
        when = "earlier" if value < 0.0 else "later"
        return f"Its swing grows and shrinks {format_number(abs(value), 's', 2)} {when} than on average in the group."
    if name == "amplitude":
        return f"It swings by {format_number(value, '% of span', 2)}."
    if name == "share":
        return f"This oscillation makes {100.0 * value:.0f} % of the movement (variance) of its OP."
    if name == "nonlinearity":
        return f"Its wave is {'bent like that of a sticky valve' if value > 1.0 else 'close to a smooth one'}."
    if name == "harmonics":
        return f"Its wave has corners, as behind a sticky valve ({format_number(100.0 * value, '%', 2)} odd harmonics)."
    if name == "cascade":
        return f"It is {({1.0: 'a secondary loop', -1.0: 'a primary loop', 0.0: 'no part'})[value]} of a cascade."
    share = "all" if value > 0.999 else f"{100.0 * value:.0f} %"
    return f"The connections lead from it to {share} of the other loops."


def _measure(one: BlockMeans, period: float, span: tuple[float, float] | None) -> dict[str, float]:
    """Findings of one loop from its own signals."""
    amplitude, share = oscillation_amplitude(one, period, "op")
    error_amplitude, error_share = oscillation_amplitude(one, period, "error")
    if span is not None:
        amplitude = max(amplitude, 100.0 * error_amplitude / (span[1] - span[0]))
    index, harmonics = float("nan"), float("nan")
    for signal in ("error", "op"):
        x, dt = signal_at(one, period, signal)
        if x.size:
            index = float(np.fmax(index, nonlinearity_of(x, period / dt)))
            if signal == "error":
                harmonics = harmonics_share(x, period / dt)
    return {
        "amplitude": amplitude,
        "share": share,
        "nonlinearity": index,
        "harmonics": harmonics,
        "error_shows_it": float(error_share > share),
    }


def _decades(x: NDArray[np.float64], smallest: float) -> NDArray[np.float64]:
    return np.log10(np.maximum(x, smallest))


def linked_loops(loops: Sequence[BlockMeans], connections: Iterable[tuple[str, str]]) -> NDArray[np.bool_]:
    """Find the pairs of loops between which a path of connections leads, either way, or which make a cascade.

    Parameters
    ----------
    loops : sequence of BlockMeans
        The loops.
    connections : iterable of (str, str)
        Tags (from, to) of connected loops; other loops may lie between two of `loops`.

    Returns
    -------
    ndarray of bool, shape (n_loops, n_loops)
        Whether each pair is linked.
    """
    place = {one.tag: k for k, one in enumerate(loops)}
    following = _following(connections)
    linked = np.zeros((len(loops), len(loops)), dtype=bool)
    for k, one in enumerate(loops):
        reached = [place[tag] for tag in _reached(one.tag, following) if tag in place]
        linked[k, [*reached, *([place[one.secondary_tag]] if one.secondary_tag in place else [])]] = True
    return linked | linked.T


def explain_connection(source: BlockMeans, loop: BlockMeans, connections: Iterable[tuple[str, str]]) -> str:
    """Say how the oscillation of a source comes to another loop; empty of the source itself.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> pic, tic, lic = (SimpleNamespace(tag=tag, secondary_tag="") for tag in ("PIC-1", "TIC-2", "LIC-3"))
    >>> links = [("PIC-1", "TIC-2"), ("TIC-2", "LIC-3")]
    >>> explain_connection(pic, tic, links), explain_connection(pic, lic, links), explain_connection(lic, pic, links)
    ('connected to it', 'through TIC-2', 'swings change together; no connection is listed')
    """
    if source.tag == loop.tag:
        return ""
    if loop.tag == source.secondary_tag or source.tag == loop.secondary_tag:
        return "in a cascade with it"
    following = _following(connections)
    paths: list[tuple[str, ...]] = [(source.tag,)]
    seen = {source.tag}
    for path in paths:
        for tag in sorted(following.get(path[-1], set()) - seen):
            if tag == loop.tag:
                return f"through {', '.join(path[1:])}" if len(path) > 1 else "connected to it"
            seen.add(tag)
            paths.append((*path, tag))
    return "swings change together; no connection is listed"


def _following(connections: Iterable[tuple[str, str]]) -> dict[str, set[str]]:
    following: dict[str, set[str]] = {}
    for start, end in connections:
        following.setdefault(start, set()).add(end)
    return following


def _reached(tag: str, following: dict[str, set[str]]) -> set[str]:
    """Tags that the connections lead to from one tag."""
    seen, waiting = {tag}, [tag]
    while waiting:
        new = following.get(waiting.pop(), set()) - seen
        seen |= new
        waiting += new
    return seen - {tag}


def _topology(
    members: Sequence[BlockMeans], connections: list[tuple[str, str]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Share of the other members that each one reaches; +1 of a secondary, -1 of a primary with both in the group."""
    tags = {one.tag for one in members}
    following = _following(connections)
    secondary = {one.secondary_tag for one in members}
    reach = np.array([len(_reached(one.tag, following) & tags) / max(1, len(members) - 1) for one in members])
    cascade = np.array([float(one.tag in secondary) - float(one.secondary_tag in tags) for one in members])
    return reach if connections else np.full(len(members), np.nan), cascade
