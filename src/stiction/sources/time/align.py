"""Tags that were stored at times of their own, on one even grid."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.display.number_format import count_noun
from stiction.errors import RecordError
from stiction.sources.time.grid import regular_grid
from stiction.sources.time.rounded_stamps import repair_stamps
from stiction.sources.time.stamps import Stamps

if TYPE_CHECKING:
    from collections.abc import Sequence
    from datetime import datetime

    from numpy.typing import NDArray

__all__ = ["AlignedTags", "TagSeries", "align_tags"]

_SCAN_PERCENTILE = 10.0
"""Percentile of the steps of a tag that is the time between two scans, unless the median is as short [%]."""
_MAX_HOLD_STEPS = 20.0
"""Usual steps (their 90th percentile) over which a value is held; beyond them it is missing."""


@dataclass
class TagSeries:
    """Values of a tag at times of its own."""

    name: str
    """Name of the tag, for messages."""
    stamps: Stamps
    """Time of each value, in the order of the source."""
    values: NDArray[np.float64]
    """The values [any unit], NaN where one is no number, shape (n,)."""
    method: str = "last"
    """"last" holds a value for some time, "hold" until the next one (set point, mode), "interpolate" draws a line."""


@dataclass
class AlignedTags:
    """Tags on one even grid."""

    dt: float
    """Sampling period [s]."""
    start: datetime | None
    """Time of the first sample; see `Grid`."""
    clock_jumps: int
    """Largest number of jumps that was corrected in the clock of any tag."""
    dst_changes: int
    """How many of `clock_jumps` were changes to or from summer time."""
    rows: list[NDArray[np.int64]] = field(default_factory=list)
    """For each tag the row whose value stands at each sample, -1 where none does, shape (n_samples,)."""
    values: list[NDArray[np.float64]] = field(default_factory=list)
    """For each tag its values, NaN where none stands, shape (n_samples,)."""
    held_samples: list[int] = field(default_factory=list)
    """For each tag the samples at which the value is that of an earlier one, or lies on a line from it."""
    notes: list[str] = field(default_factory=list)
    """Assumptions, a sentence each."""


class _StoredValues(NamedTuple):
    """Rows of a tag in the order of time, one for each moment."""

    seconds: NDArray[np.float64]
    rows: NDArray[np.int64]
    stamps: Stamps


def align_tags(
    tags: Sequence[TagSeries],
    *,
    dt: float | None = None,
    max_gap: float | None = None,
    name: str = "source",
    first_line: int = 1,
) -> AlignedTags:
    """Put tags with time stamps of their own on one even grid.

    Parameters
    ----------
    tags : sequence of TagSeries
        One or more tags; those with the same `Stamps` object are repaired once.
    dt : float, optional
        Sampling period [s]; the shortest time between two scans of a tag when not given.
    max_gap : float, optional
        Longest time over which a value is held ("last") or a line is drawn ("interpolate") [s]. When not given, it is
        20 times the usual step of the tag, or of all tags together if that is longer.
    name : str
        Name of the source, for messages.
    first_line : int
        Line of its first row, for messages.

    Returns
    -------
    AlignedTags
        Rows and values of each tag, in the order given.

    Raises
    ------
    RecordError
        When a tag has fewer than two readable stamps, some stamps name a zone and others do not, or all are too far
        apart.

    Examples
    --------
    >>> from stiction.sources.time.stamps import Stamps
    >>> pv = TagSeries("PV", Stamps(np.arange(6.0), "relative"), np.arange(6.0))
    >>> sp = TagSeries("SP", Stamps(np.array([0.0, 3.0]), "relative"), np.array([7.0, 8.0]), "hold")
    >>> align_tags([pv, sp]).values[1].tolist()
    [7.0, 7.0, 7.0, 8.0, 8.0, 8.0]
    """
    stored = _sort_stored_values(tags, name, first_line)
    seconds = np.unique(np.concatenate(list({id(one.seconds): one.seconds for one in stored}.values())))
    steps = [np.diff(one.seconds) for one in stored]
    if dt is None:
        dt = min((_scan_time(own) for own in steps if own.size > 1), default=None)
    usual = float(np.percentile(np.diff(seconds), 90.0)) if seconds.size > 1 else 0.0
    hold = _MAX_HOLD_STEPS * usual if max_gap is None else max_gap
    grid = regular_grid(Stamps(seconds, tags[0].stamps.kind), dt=dt, name=name, first_line=first_line, max_hold=hold)
    worst = max((one.stamps for one in stored), key=lambda stamps: (stamps.clock_jumps, -stamps.dst_changes))
    aligned = AlignedTags(grid.dt, grid.start, worst.clock_jumps, worst.dst_changes)
    moments = seconds[np.maximum(grid.source_row, 0)]
    for tag, one, own in zip(tags, stored, steps, strict=True):
        limit = hold
        if max_gap is None:
            limit = max(hold, _MAX_HOLD_STEPS * float(np.percentile(own, 90.0))) if own.size > 1 else np.inf
        last = np.searchsorted(one.seconds, moments, side="right") - 1
        age = moments - one.seconds[np.maximum(last, 0)]
        stands = (last >= 0) & (grid.source_row >= 0) & (age <= (np.inf if tag.method == "hold" else limit))
        rows = np.where(stands, one.rows[np.maximum(last, 0)], -1)
        values = np.where(stands, tag.values[np.maximum(rows, 0)], np.nan)
        if tag.method == "interpolate":
            values = _interpolate(one, tag.values, moments, limit, values)
        aligned.rows.append(rows)
        aligned.values.append(values)
        aligned.held_samples.append(int(np.sum((np.diff(rows) == 0) & (rows[1:] >= 0))))
        aligned.notes += _repeated_stamps(tag, one)
    drawn = [tag.name for tag in tags if tag.method == "interpolate"]
    how = f"; {', '.join(drawn)}: interpolated between values" if drawn else ""
    count = f"{sum(one.rows.size for one in stored)} values of {count_noun(len(tags), 'tag')}"
    aligned.notes += dict.fromkeys(note for one in stored for note in one.stamps.notes)
    aligned.notes += [f"{count}, each on its own time stamps: a value stands until the next{how}.", *grid.notes]
    return aligned


def _sort_stored_values(tags: Sequence[TagSeries], name: str, first_line: int) -> list[_StoredValues]:
    """Repair the stamps of each tag and sort its rows; of several values at one moment the last stays."""
    if len(kinds := {tag.stamps.kind for tag in tags}) > 1:
        raise RecordError(
            f"{name}: the tags have time stamps of different kinds ({', '.join(sorted(kinds))}); export all with a "
            "zone, or give the zone of the others with timezone= (--timezone)."
        )
    sorted_values: dict[int, _StoredValues] = {}
    for tag in tags:
        if id(tag.stamps) not in sorted_values:
            stamps = repair_stamps(tag.stamps)
            order = np.argsort(stamps.seconds, kind="stable")[: int(np.isfinite(stamps.seconds).sum())]  # NaN is last
            seconds = stamps.seconds[order]
            is_last = np.diff(seconds, append=np.inf) > 0.0
            sorted_values[id(tag.stamps)] = _StoredValues(seconds[is_last], order[is_last], stamps)
    if sum(one.rows.size for one in sorted_values.values()) < 2:
        row, cell = tags[0].stamps.first_unread or (0, "")
        raise RecordError(
            f"{name}, line {first_line + row}: {cell!r} is no time stamp known here; "
            "give time_format='...' (--time-format)."
        )
    return [sorted_values[id(tag.stamps)] for tag in tags]


def _repeated_stamps(tag: TagSeries, one: _StoredValues) -> list[str]:
    """Say how many values were dropped because another one has their time stamp."""
    known = np.isfinite(one.stamps.seconds)
    if known.sum() == one.rows.size:
        return []
    standing = tag.values[one.rows[np.searchsorted(one.seconds, one.stamps.seconds[known])]]
    other = (tag.values[known] != standing) & ~(np.isnan(tag.values[known]) & np.isnan(standing))
    values = count_noun(int(other.sum()), "value")
    return (
        [f"Left out: {values} of {tag.name} with the time stamp of the next, which is another."] if other.any() else []
    )


def _scan_time(steps: NDArray[np.float64]) -> float:
    """Time between two scans of a tag [s]: a short number where one is as near as the steps are to one another."""
    usual, least = (float(np.percentile(steps, share)) for share in (50.0, _SCAN_PERCENTILE))
    dt = usual if least >= 0.7 * usual else least
    near = 0.005 * dt if least < (1.0 - 1e-6) * usual else 1e-6 * dt
    shorter = (float(f"{dt:.{digits}g}") for digits in range(1, 5))
    return next((short for short in shorter if abs(short - dt) <= near), dt)


def _interpolate(one: _StoredValues, values: NDArray, moments: NDArray, limit: float, standing: NDArray) -> NDArray:
    """Draw a line between neighbouring values no further apart than `limit`; elsewhere keep the value that stands."""
    if one.seconds.size < 2:
        return standing
    after = np.clip(np.searchsorted(one.seconds, moments, side="left"), 1, one.seconds.size - 1)
    step, y = np.diff(one.seconds)[after - 1], values[one.rows]
    share = (moments - one.seconds[after - 1]) / step
    line = np.where(
        share <= 0.0, y[after - 1], np.where(share >= 1.0, y[after], (1 - share) * y[after - 1] + share * y[after])
    )
    return np.where((share >= 0.0) & (share <= 1.0) & (step <= limit), line, standing)
