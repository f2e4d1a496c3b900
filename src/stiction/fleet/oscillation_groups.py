"""Which loops share an oscillation: common periods, coherence of the complex envelopes, and of their changes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import ParameterError, require_count, require_positive, require_seed
from stiction.fleet.block_means import BlockMeans, common_clock, make_block_means
from stiction.fleet.coherence import common_envelope
from stiction.fleet.group import Group, Member
from stiction.fleet.group_search import GroupSearch, OscillationRow, search_groups
from stiction.fleet.loop_oscillations import find_loop_oscillations
from stiction.fleet.root_cause import explain_connection, linked_loops, rank_roots

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from stiction.fleet.group_search import FoundGroup
    from stiction.fleet.loop_oscillations import LoopOscillation
    from stiction.fleet.root_cause import LoopVerdict
    from stiction.records.record import LoopRecord

__all__ = ["group_oscillations"]


def group_oscillations(
    loops: Sequence[LoopRecord | BlockMeans],
    *,
    verdicts: Mapping[str, LoopVerdict] | None = None,
    connections: Iterable[tuple[str, str]] = (),
    spans: Mapping[str, tuple[float, float]] | None = None,
    oscillations: Mapping[str, Sequence[LoopOscillation]] | None = None,
    min_coherence: float = 0.6,
    bin_width: float = 0.04,
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
    oscillations : mapping of str to sequence of LoopOscillation, optional
        Tag -> what `find_loop_oscillations` found; computed where it is not given.
    min_coherence : float
        Smallest coherence of the envelopes of two loops in one group [-].
    bin_width : float
        Largest relative difference of the periods that are compared [-].
    max_blocks : int
        Largest number of block means of a signal [-].
    seed : int
        Seed of the shifts that give the coherence of unrelated loops [-].

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
    3. The coherence of two envelopes is ``abs(E E*)``, normalised. The floor is a quantile of the coherence of
       envelopes that are shifted circularly against each other: 0.95, or 1 - 0.5 / n for n oscillations near the
       period, so that in a large plant less than one exceeds it by chance. Average linkage cuts at the floor.
    4. Groups whose common oscillations cohere at the mean of their periods are one: the period that a loop shows of an
       irregular oscillation differs from loop to loop.
    5. Two steady waves of nearly one period cohere although nothing connects them. Therefore the changes of the
       envelopes from window to window must cohere as well: those of each loop with the common changes of the others of
       its group, by more than independent noise does with the quantile of the floor. Loops that a path of the
       connections or a cascade links need not change together. Other regular oscillations within `bin_width` of the
       period are listed under `Group.similar`: similar periods, connection not shown.
    6. A loop whose own autocorrelation is not regular enough, but whose envelope coheres with a group, is listed under
       `perhaps_also`.

    The cost grows with the number of loops: only loops of one bin are compared in pairs.

    Examples
    --------
    >>> import numpy as np
    >>> import stiction as st
    >>> rng = np.random.default_rng(0)
    >>> wave = np.cumsum(rng.normal(2 * np.pi / 40, 0.05, 4000))
    >>> noise = rng.normal(0.0, 0.2, (3, 4000))
    >>> pvs = [np.sin(wave) + noise[0], 0.5 * np.sin(wave - 1.0) + noise[1], noise[2]]
    >>> records = [st.LoopRecord(f"FIC-{k}", 1.0, op=50.0 - pv, pv=pv) for k, pv in enumerate(pvs)]
    >>> [(round(group.period), group.tags) for group in st.group_oscillations(records)]
    [(40, ('FIC-0', 'FIC-1'))]
    """
    min_coherence, bin_width = _check(min_coherence, bin_width)
    if not loops:
        return ()
    means = _to_block_means(loops, require_count("max_blocks", max_blocks))
    known = oscillations or {}
    found_of = [known[each.tag] if each.tag in known else find_loop_oscillations(each) for each in means]
    rows = [OscillationRow(k, one) for k, each in enumerate(found_of) for one in each]
    links = [(a, b) for a, b in connections]
    linked = linked_loops(means, links)
    search = GroupSearch(means, rows, min_coherence, np.random.default_rng(require_seed(seed)), linked)
    found = search_groups(search, bin_width)
    members = {search.rows[k].loop for one in found for k in (*one.members, *one.perhaps)}
    groups = []
    for one in found:
        near = [search.rows[k] for k in search.near(one.period, bin_width)]
        similar = dict.fromkeys(row.loop for row in near if row.oscillation.regular and row.loop not in members)
        tags = tuple(sorted(means[loop].tag for loop in similar))
        groups.append(_make_group(search, one, tags, verdicts or {}, links, spans or {}))
    return tuple(sorted(groups, key=lambda group: (-len(group.members), group.period)))


def _check(min_coherence: float, bin_width: float) -> tuple[float, float]:
    if not 0.0 < require_positive("min_coherence", min_coherence) < 1.0:
        raise ParameterError(f"min_coherence = {min_coherence:g} is not below 1; give a value between 0 and 1.")
    if not 0.0 < require_positive("bin_width", bin_width) <= 0.2:
        raise ParameterError(f"bin_width = {bin_width:g} is above 0.2; give a value between 0 and 0.2.")
    return float(min_coherence), float(bin_width)


def _to_block_means(loops: Sequence[LoopRecord | BlockMeans], max_blocks: int) -> list[BlockMeans]:
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
            raise ParameterError(
                "loops contains block means with different clocks; compute all of them with one common_clock."
            )
    tags = [one.tag for one in means]
    if len(set(tags)) < len(tags):
        double = next(tag for tag in tags if tags.count(tag) > 1)
        raise ParameterError(f"Two loops have the tag {double!r}; give each loop a tag of its own.")
    return means


def _make_group(
    search: GroupSearch,
    found: FoundGroup,
    similar: tuple[str, ...],
    verdicts: Mapping[str, LoopVerdict],
    connections: list[tuple[str, str]],
    spans: Mapping[str, tuple[float, float]],
) -> Group:
    """Describe one group and rank its loops."""
    rows, means = search.rows, search.means
    chosen = [rows[k] for k in found.members]
    period = float(np.median([row.period for row in chosen]))
    envelopes = search.envelopes(found.members, period)
    along = envelopes @ common_envelope(envelopes).conj()
    roots = rank_roots(
        [means[row.loop] for row in chosen], period, verdicts=verdicts, connections=connections, spans=spans
    )
    source = next(means[row.loop] for row in chosen if means[row.loop].tag == roots[0].tag)
    members = [
        Member(
            means[row.loop].tag, row.period, row.oscillation.regularity, row.oscillation.signal,
            min(1.0, float(abs(part))), float(np.degrees(np.angle(part))),
            explain_connection(source, means[row.loop], connections),
        )
        for row, part in zip(chosen, along, strict=True)
    ]  # fmt: skip
    order = {root.tag: k for k, root in enumerate(roots)}
    members.sort(key=lambda member: order[member.tag])
    perhaps = tuple(means[rows[k].loop].tag for k in found.perhaps)
    return Group(period, tuple(members), perhaps, roots, found.floor, similar)
