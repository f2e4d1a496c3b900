"""What the files of a source hold together: signals that one file lacks, and consecutive times of one loop."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from stiction.display.number_format import count_noun, list_first
from stiction.errors import RecordError
from stiction.sources.layouts.headings import parse_role, pick_rows, pick_stamps
from stiction.sources.roles.assign import assign_roles
from stiction.sources.roles.loop_roles import NUMERIC_ROLES, LoopRoles, column_label
from stiction.sources.roles.pair_groups import parse_instrument_tag
from stiction.sources.table import Clock
from stiction.sources.typed_table import stack_series

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.sources.options import ReadOptions
    from stiction.sources.roles.map_file import MapRow
    from stiction.sources.table import TagColumn
    from stiction.sources.time.stamps import Stamps

__all__ = ["complete_loops", "join_same_tags"]

MAX_GAP_STEPS = 20.0
"""Longest time between two files of one record, in steps of their time stamps [-]: as long as a value is held."""
MAX_LISTED = 5
"""Files that a note names [-]."""
ADDED_ROLES = ("sp", "mv", "valve_signal", "mode")
"""Signals that a complete loop may take from another file."""

Columns = dict[str, "TagColumn"]


def complete_loops(
    incomplete: Sequence[Sequence[TagColumn]],
    others: Sequence[Sequence[TagColumn]],
    loops: Sequence[LoopRoles],
    options: ReadOptions,
    rows: Sequence[MapRow] | None,
) -> tuple[list[LoopRoles], RecordError | None]:
    """Find the loops whose signals stand in several files, else why there are none.

    Columns of `incomplete` files have no loop; those of `others` add a set point, position or mode that `loops` lack.
    """
    pool = [column for columns in incomplete for column in columns]
    if rows is None:
        used = {id(column) for loop in loops for column in loop.roles.values()}
        tags = {loop.tag.casefold() for loop in loops}
        for columns in others:
            pairs = [(column, parse_role(column.name)) for column in columns if id(column) not in used]
            pool += [one for one, pair in pairs if pair and pair[0] and pair[0].casefold() not in tags]
        pool = [column for column in pool if not _add_to_loop(column, loops)]
    if len({id(column.table) for column in pool}) < 2:
        return [], None
    try:
        found = assign_roles(_join_pieces(pool), replace(options, tag=None), rows, pool[0].table.origin.name)
    except RecordError as error:
        return [], error
    together = []
    for loop in found:
        files = list(
            dict.fromkeys(part.table.origin.name for one in loop.roles.values() for part in one.parts or (one,))
        )
        if len(files) > 1:
            together.append(loop)
            loop.notes.append(f"The signals of {loop.tag or 'the loop'} stand in {list_first(files, MAX_LISTED)}.")
    return together, None


def _add_to_loop(column: TagColumn, loops: Sequence[LoopRoles]) -> bool:
    """Add a set point, position or mode to the only loop of its tag, which has none, where their times overlap."""
    pair = parse_role(column.name)
    if pair is None or not pair[0] or pair[1] not in ADDED_ROLES:
        return False
    same = [loop for loop in loops if loop.tag.casefold() == pair[0].casefold()]
    if len(same) != 1 or pair[1] in same[0].roles:
        return False
    own, other = column.clock, same[0].roles["op"].clock
    if own is None or other is None or own.stamps.kind != other.stamps.kind:
        return False
    (low, high), (first, last) = _ends(own), _ends(other)
    if min(high, last) - max(low, first) < 0.5 * (last - first):
        return False
    same[0].roles[pair[1]] = column
    name = f"{column_label(column)} of {column.table.origin.name}"
    same[0].notes.append(f"{name} was added: the file of the loop has no {pair[1].upper()}.")
    return True


def _join_pieces(columns: Sequence[TagColumn]) -> list[TagColumn]:
    """Join columns of one tag and role whose times follow each other, as of files of a day each."""
    groups: dict[tuple[object, ...], list[Columns]] = defaultdict(list)
    for column in columns:
        pair = parse_role(column.name)
        is_tag = bool((pair and pair[0]) or parse_instrument_tag(column.name))
        groups[(column.name.casefold(), column.unit) if is_tag else (id(column),)].append({"": column})
    clocks: dict[tuple[int, ...], Clock] = {}
    return [
        _concat(chain, clocks)[""]
        for group in groups.values()
        for chain in (_chains(group)[0] if len(group) > 1 else [group])
    ]


def join_same_tags(loops: Sequence[LoopRoles]) -> list[LoopRoles]:
    """Join loops of one tag that follow each other or are equal; if values differ, each has its file in its tag."""
    groups: dict[object, list[LoopRoles]] = defaultdict(list)
    for loop in loops:
        groups[loop.tag.casefold() or id(loop)].append(loop)
    clocks: dict[tuple[int, ...], Clock] = {}
    found: list[LoopRoles] = []
    for group in groups.values():
        if len(group) == 1:
            found += group
            continue
        by_table = {id(loop.roles["op"].table): loop for loop in group}
        chains, differ = _chains([loop.roles for loop in group])
        joined = []
        for chain in chains:
            parts = [by_table[id(roles["op"].table)] for roles in chain]
            names = [roles["op"].table.origin.name for roles in chain]
            first = parts[0]
            if len(parts) > 1:
                note = f"{count_noun(len(parts), 'file')} of {first.tag} were joined, as their times follow each other "
                note += f"or their values are equal: {list_first(names, MAX_LISTED)}."
                notes = dict.fromkeys(text for one in parts for text in [*one.notes, *one.roles["op"].table.notes])
                first = replace(first, roles=_concat(chain, clocks), notes=[*notes, note])
            joined.append((first, names))
        for (loop, names), short in zip(joined, _short_names([names[0] for _, names in joined]), strict=True):
            others = list_first([other[0] for _, other in joined if other is not names], MAX_LISTED)
            if differ:
                note = f"{others} has other values of {loop.tag} at the same times: each file is a loop of its own."
                loop = replace(loop, tag=f"{loop.tag} ({short})", notes=[*loop.notes, note])
            elif len(joined) > 1:
                note = f"{others} has another record of {loop.tag}, which is not joined to this one: "
                note += "its times do not follow, or its unit, scale or sampling period differs."
                loop = replace(loop, notes=[*loop.notes, note])
            found.append(loop)
    return found


def _chains(group: Sequence[Columns]) -> tuple[list[list[Columns]], bool]:
    """Order the parts of one loop in chains that can be joined; also say whether parts of two chains differ."""
    timed = sorted(group, key=lambda one: _ends(clock)[0] if (clock := _clock_of(one)) else -np.inf)
    chains: list[list[Columns]] = []
    latest: list[Columns] = []  # of each chain, the part that ends last
    differ = False
    for one in timed:
        relations = [_relation(last, one) for last in latest]
        k = next((k for k in reversed(range(len(chains))) if isinstance(relations[k], dict)), None)
        if k is None or not isinstance(rows := relations[k], dict):
            differ |= "different" in relations
            chains.append([one])
            latest.append(one)
            continue
        chains[k].append({role: _pick(column, rows[role]) for role, column in one.items()})
        ends = [_ends(clock)[1] if (clock := _clock_of(part)) else -np.inf for part in (latest[k], one)]
        latest[k] = one if ends[1] > ends[0] else latest[k]
    return chains, differ


def _relation(one: Columns, other: Columns) -> dict[str, NDArray[np.int64]] | str:
    """Rows of the `other` columns, by role, that continue the `one`; else "apart" or "different"."""
    clock, later = _clock_of(one), _clock_of(other)
    if clock is None or later is None or clock.stamps.kind != later.stamps.kind:
        return "different"
    flags = [{role for role in columns if role not in ("sp", "mv", "valve_signal")} for columns in (one, other)]
    is_alike = flags[0] == flags[1] and all(one[role].unit == other[role].unit for role in one.keys() & other.keys())
    is_alike = is_alike and not _has_other_step(clock, later) and not _is_fraction(one, other)
    gap = _ends(later)[0] - _ends(clock)[1]
    if gap > 0.0:
        is_next = gap <= MAX_GAP_STEPS * max(_usual_step(clock), _usual_step(later))
        return (
            {role: np.arange(len(column.cells)) for role, column in other.items()} if is_next and is_alike else "apart"
        )
    rows, n_common = {}, 0
    for role, column in other.items():
        stamps = column.clock.stamps.seconds if column.clock else np.empty(0)
        if role not in one or one[role].clock is None:
            rows[role] = np.arange(stamps.size)
            continue
        known = one[role].clock.stamps.seconds  # pyright: ignore[reportOptionalMemberAccess]
        _, mine, theirs = np.intersect1d(known, stamps, return_indices=True)
        if role in NUMERIC_ROLES or not role:
            n_common += mine.size
            if not _are_equal(one[role].cells.gather(mine), column.cells.gather(theirs)):
                return "different"
        rows[role] = np.flatnonzero(~np.isin(stamps, known))
    return rows if n_common and is_alike else "different"


def _has_other_step(one: Clock, other: Clock, *, most: float = 1.5, regular: float = 0.9) -> bool:
    """Whether both clocks are regular, a share of their steps as usual, with steps that differ by a factor [-]."""
    steps = sorted((_usual_step(one), _usual_step(other)))
    if steps[0] <= 0.0 or steps[1] <= most * steps[0]:
        return False
    seconds = [clock.stamps.seconds for clock in (one, other)]
    return all(np.isclose(np.diff(x), np.median(np.diff(x)), rtol=0.05).mean() >= regular for x in seconds)


def _is_fraction(one: Columns, other: Columns, *, most: float = 1.5, ratio: float = 20.0) -> bool:
    """Whether OP is a fraction in one part, which moves below a limit, and a percentage in the other."""
    if "op" not in one or "op" not in other:
        return False
    cells = (columns["op"].cells.cast(pl.Float64, strict=False).drop_nulls().drop_nans() for columns in (one, other))
    low, high = sorted(cells, key=lambda x: x.abs().max() or 0.0)  # pyright: ignore[reportArgumentType, reportCallIssue]
    top, other_top = (float(x.abs().max() or 0.0) for x in (low, high))  # pyright: ignore[reportArgumentType]
    return 0.0 < top <= most and low.n_unique() > 1 and other_top >= ratio * top


def _are_equal(one: pl.Series, other: pl.Series) -> bool:
    """Whether cells are the same text or the same number."""
    texts, numbers = ([x.cast(kind, strict=False) for x in (one, other)] for kind in (pl.String, pl.Float64))
    return bool((texts[0].eq_missing(texts[1]) | numbers[0].eq(numbers[1]).fill_null(value=False)).all())


def _concat(chain: Sequence[Columns], clocks: dict[tuple[int, ...], Clock]) -> Columns:
    """Join the columns of several files, in their order; `clocks` keeps the joined clocks."""
    if len(chain) == 1:
        return chain[0]
    joined: Columns = {}
    for role in dict.fromkeys(role for one in chain for role in one):
        columns = [one[role] if role in one else _blank(one["op"], role) for one in chain]
        key = tuple(id(column.clock) for column in columns)
        if key not in clocks:
            clocks[key] = _concat_clocks([column.clock for column in columns if column.clock])
        first = next(column for one, column in zip(chain, columns, strict=True) if role in one)
        headings = set.intersection(*(set(column.flags) for column in columns))
        joined[role] = replace(
            first,
            clock=clocks[key],
            load=lambda columns=columns: stack_series(column.cells for column in columns),
            flags={
                name: lambda columns=columns, name=name: stack_series(column.flags[name]() for column in columns)
                for name in headings
            },
            parts=tuple(columns),
        )
    return joined


def _concat_clocks(clocks: Sequence[Clock]) -> Clock:
    def parse() -> Stamps:
        stamps = [clock.stamps for clock in clocks]
        return replace(
            stamps[0],
            seconds=np.concatenate([one.seconds for one in stamps]),
            notes=list(dict.fromkeys(note for one in stamps for note in one.notes)),
            resolution=max(one.resolution for one in stamps),
            clock_jumps=sum(one.clock_jumps for one in stamps),
            dst_changes=sum(one.dst_changes for one in stamps),
        )

    return Clock(parse)


def _blank(beside: TagColumn, name: str) -> TagColumn:
    """A column without values, with the rows of another one."""

    def load() -> pl.Series:
        return pl.repeat(None, len(beside.cells), dtype=beside.cells.dtype, eager=True)

    return replace(beside, name=name, load=load, flags={}, position=None)


def _pick(column: TagColumn, rows: NDArray[np.int64]) -> TagColumn:
    """Some rows of a column; the column itself where these are all."""
    if column.clock is None or rows.size == column.clock.stamps.seconds.size:
        return column
    return pick_rows(column, rows, pick_stamps(column.clock, rows))


def _clock_of(columns: Columns) -> Clock | None:
    return columns["op" if "op" in columns else ""].clock


def _ends(clock: Clock) -> tuple[float, float]:
    """First and last time [s]; an empty span where there is none."""
    seconds = clock.stamps.seconds
    known = seconds[np.isfinite(seconds)]
    return (float(known.min()), float(known.max())) if known.size else (np.inf, -np.inf)


def _usual_step(clock: Clock) -> float:
    """Median time between two rows [s]."""
    seconds = clock.stamps.seconds
    steps = np.abs(np.diff(seconds[np.isfinite(seconds)]))
    return float(np.median(steps)) if steps.size else 0.0


def _short_names(names: Sequence[str]) -> list[str]:
    """File names, with as many of their folders as tell them apart."""
    paths = [PurePath(name) for name in names]
    for n in range(1, max(len(path.parts) for path in paths) + 1):
        short = ["/".join(path.parts[-n:]) for path in paths]
        if len(set(short)) == len(set(names)):
            return short
    return list(names)
