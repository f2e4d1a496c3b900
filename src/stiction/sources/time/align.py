"""Tags that were stored at times of their own, on one even grid."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.number_format import count_noun
from stiction.errors import RecordError, Setting
from stiction.sources.time.grid import Grid, regular_grid
from stiction.sources.time.stamps import Stamps, unread_stamp_error
from stiction.sources.time.time_order import MAX_SHARED_STAMPS, shortest_number, sort_by_time, spread_rounded_stamps

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["AlignedTags", "TagSeries", "align_tags"]


@dataclass
class TagSeries:
    """Values of a tag at times of its own."""

    name: str
    """Name of the tag, for messages."""
    stamps: Stamps
    """Time of each value, in the order of the source."""
    values: NDArray[np.float64] | None
    """The values [any unit], NaN where one is no number, shape (n,); None for a tag of text."""
    method: str = "last"
    """"last" holds a value for some time, "hold" until the next one (set point, mode), "interpolate" draws a line."""


@dataclass
class AlignedTags(Grid):
    """Tags on one even grid; each list has an entry for each tag."""

    rows: list[NDArray[np.int64]] = field(default_factory=list)
    """Row whose value stands at each sample, -1 where none does, shape (n_samples,)."""
    values: list[NDArray[np.float64] | None] = field(default_factory=list)
    """Values, NaN where none stands, shape (n_samples,)."""
    held_samples: list[int] = field(default_factory=list)
    """Samples at which the value is that of an earlier one, or lies on a line from it."""


def align_tags(
    tags: Sequence[TagSeries],
    *,
    dt: float | None = None,
    max_gap: float | None = None,
    name: str = "source",
    first_line: int = 1,
) -> AlignedTags:
    """Put tags with stamps of their own on one even grid of `dt` [s], by default the shortest time between scans.

    Values are held ("last") or interpolated for `max_gap` [s], by default 20 usual steps (the 90th percentile) of the
    tag, or of all tags if that is longer.
    """
    kinds = sorted({tag.stamps.kind for tag in tags})
    if len(kinds) > 1:
        raise RecordError(
            f"the tags have time stamps of different kinds ({', '.join(kinds)})",
            remedy=("export all with a zone, or give the zone of the others with ", Setting("timezone")),
            where=name,
        )
    different = {id(tag.stamps): tag.stamps for tag in tags}
    sorted_rows = {key: _sort_rows(stamps) for key, stamps in different.items()}
    for key, (_, rows) in sorted_rows.items():
        if rows.size == 0:
            raise unread_stamp_error(different[key], name, first_line)
    distinct = {key: np.unique(own.seconds) for key, (own, _) in sorted_rows.items()}
    seconds = np.unique(np.concatenate([*distinct.values()]))
    if dt is None:
        dt = min((_scan_time(np.diff(t)) for t in distinct.values() if t.size > 2), default=None)
    hold = _longest_hold(seconds, 0.0) if max_gap is None else max_gap
    grid = regular_grid(Stamps(seconds, kinds[0]), dt=dt, name=name, first_line=first_line, max_hold=hold)
    worst = max((own for own, _ in sorted_rows.values()), key=lambda own: (own.clock_jumps, -own.dst_changes))
    aligned = AlignedTags(grid.source_row, grid.dt, grid.start, worst.clock_jumps, worst.dst_changes)
    moments = np.where(grid.source_row >= 0, seconds[grid.source_row], np.nan)
    for tag in tags:
        own, own_rows = sorted_rows[id(tag.stamps)]
        is_last = np.diff(own.seconds, append=np.inf) > 0.0
        t, source = distinct[id(tag.stamps)], own_rows[is_last]
        limit = max(hold, _longest_hold(t, np.inf)) if max_gap is None else max_gap
        last = np.where(np.isnan(moments), -1, np.searchsorted(t, moments, side="right") - 1)
        is_held = (last >= 0) & ((tag.method == "hold") | (moments - t[last] <= limit))
        rows = np.where(is_held, source[last], -1)
        values = None
        if tag.values is not None:
            values = np.where(rows >= 0, tag.values[rows], np.nan)
            if tag.method == "interpolate" and t.size > 1:
                values = _interpolate(t, tag.values[source], moments, limit, values)
            aligned.notes += _note_repeated_stamps(tag.name, tag.values[own_rows], is_last, name)
        aligned.rows.append(rows)
        aligned.values.append(values)
        aligned.held_samples.append(int(np.sum((np.diff(rows) == 0) & (rows[1:] >= 0))))
    drawn = [tag.name for tag in tags if tag.method == "interpolate"]
    how = f"; {', '.join(drawn)}: interpolated between values" if drawn else ""
    n_values = sum(distinct[id(tag.stamps)].size for tag in tags)
    aligned.notes += dict.fromkeys(note for tag in tags for note in tag.stamps.notes)
    aligned.notes += dict.fromkeys(note for own, _ in sorted_rows.values() for note in own.notes)
    aligned.notes.append(
        f"{n_values} values of {count_noun(len(tags), 'tag')}, each tag with its own time stamps: a value is used "
        f"until the next one{how}."
    )
    aligned.notes += grid.notes
    return aligned


def _sort_rows(stamps: Stamps) -> tuple[Stamps, NDArray[np.int64]]:
    """Sort the rows of a tag by time and spread rounded stamps."""
    own, rows = sort_by_time(stamps)
    if rows.size > 1:
        own.seconds = spread_rounded_stamps(own.seconds, rows, stamps.resolution, own.notes)
    return own, rows


def _longest_hold(t: NDArray[np.float64], default: float) -> float:
    """Time over which a value is held [s]: 20 usual steps, where there are two steps or more."""
    return 20.0 * float(np.percentile(np.diff(t), 90.0)) if t.size > 2 else default


def _note_repeated_stamps(name: str, values: NDArray, is_last: NDArray[np.bool_], source: str) -> list[str]:
    """Say how many values were dropped because another one has their time stamp; refuse to drop many."""
    standing = values[is_last][np.cumsum(is_last) - is_last]
    n_other = int(((values != standing) & ~(np.isnan(values) & np.isnan(standing))).sum())
    if n_other > MAX_SHARED_STAMPS * values.size:
        raise RecordError(
            f"{n_other} of {values.size} values of {name} have the time of another value, which differs "
            f"(at most {100.0 * MAX_SHARED_STAMPS:g} % may): it holds several series under one name; export the column "
            "that tells them apart, or one series at a time.",
            where=source,
        )
    note = (
        f"Left out: {count_noun(n_other, 'value')} of {name} with the same time stamp as the next value, which differs."
    )
    return [note] if n_other else []


def _scan_time(steps: NDArray[np.float64]) -> float:
    """Time between two scans of a tag [s]: a short number where one is as near as the steps are to one another."""
    usual, least = (float(np.percentile(steps, share)) for share in (50.0, 10.0))
    dt = usual if least >= 0.7 * usual else least
    return shortest_number(dt, 0.005 * dt if least < (1.0 - 1e-6) * usual else 1e-6 * dt)


def _interpolate(t: NDArray, y: NDArray, moments: NDArray, limit: float, standing: NDArray) -> NDArray:
    """Draw a line between neighbouring values no further apart than `limit`; elsewhere keep the value that stands."""
    after = np.clip(np.searchsorted(t, moments, side="left"), 1, t.size - 1)
    step = np.diff(t)[after - 1]
    is_between = (moments >= t[after - 1]) & (moments <= t[after]) & (step <= limit)
    is_stored = np.isin(moments, t)
    return np.where(is_between & ~is_stored, np.interp(moments, t, y), standing)
