"""Tags that were stored at times of their own, on one even grid."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError
from stiction.records.digits import number_of
from stiction.records.durations import in_seconds
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
    values: NDArray[np.float64] | None = None
    """The values [any unit], shape (n,); None for a tag of text, of which only the rows are wanted."""
    method: str = "last"
    """"last" holds a value for some time, "hold" until the next one (set point, mode), "interpolate" draws a line."""


@dataclass
class AlignedTags:
    """Tags on one even grid."""

    dt: float
    """Sampling period [s]."""
    start: datetime | None
    """Time of the first sample."""
    rows: list[NDArray[np.int64]]
    """For each tag the row whose value stands at each sample, -1 where none does, shape (n_samples,)."""
    values: list[NDArray[np.float64] | None]
    """For each tag its values, NaN where none stands, shape (n_samples,); None for a tag of text."""
    held_samples: list[int]
    """For each tag the samples at which a value stands, or lies on a line, that was not stored for them."""
    clock_jumps: int = 0
    """Largest number of jumps that was corrected in the clock of any tag."""
    dst_changes: int = 0
    """How many of `clock_jumps` were changes to or from summer time."""
    notes: list[str] = field(default_factory=list)
    """Assumptions, a sentence each."""


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
    stored = _stored_values(tags, name, first_line)
    seconds = np.unique(np.concatenate([one.seconds for one in stored]))
    steps = [np.diff(one.seconds) for one in stored]
    usual = float(np.percentile(np.diff(seconds), 90.0)) if seconds.size > 1 else 0.0
    dt = dt or min((_scan_time(own) for own in steps if own.size > 1), default=None)
    kind = tags[0].stamps.kind
    hold = _MAX_HOLD_STEPS * usual if max_gap is None else max_gap
    grid = regular_grid(Stamps(seconds, kind), dt=dt, name=name, first_line=first_line, max_hold=hold)
    moments = seconds[np.maximum(grid.source_row, 0)]
    aligned = AlignedTags(grid.dt, grid.start, [], [], [])
    for tag, one, own in zip(tags, stored, steps, strict=True):
        limit = max_gap
        if limit is None:
            own_usual = float(np.percentile(own, 90.0)) if own.size > 1 else np.inf
            limit = max(hold, _MAX_HOLD_STEPS * own_usual)
        last = np.searchsorted(one.seconds, moments, side="right") - 1
        age = moments - one.seconds[np.maximum(last, 0)]
        stands = (last >= 0) & (grid.source_row >= 0) & (age <= (np.inf if tag.method == "hold" else limit))
        rows = np.where(stands, one.rows[np.maximum(last, 0)], -1)
        values = None if tag.values is None else np.where(stands, tag.values[np.maximum(rows, 0)], np.nan)
        if tag.method == "interpolate" and tag.values is not None and values is not None:
            values = _interpolate(one, tag.values, moments, limit, values)
        aligned.rows.append(rows)
        aligned.values.append(values)
        aligned.held_samples.append(int(np.sum((np.diff(rows) == 0) & (rows[1:] >= 0))))
    worst = max(stored, key=lambda one: (one.clock_jumps, -one.dst_changes))
    aligned.clock_jumps, aligned.dst_changes = worst.clock_jumps, worst.dst_changes
    notes = [note for one in stored for note in one.notes]
    aligned.notes = [*dict.fromkeys(notes), _describe(tags, stored, max_gap), *grid.notes]
    return aligned


@dataclass
class _Stored:
    """Values of a tag as stored, in the order of time, one for each moment."""

    seconds: NDArray[np.float64]
    rows: NDArray[np.int64]
    clock_jumps: int
    dst_changes: int
    notes: list[str]


def _stored_values(tags: Sequence[TagSeries], name: str, first_line: int) -> list[_Stored]:
    """Repair the stamps of each tag; of several values at one moment keep the last."""
    if len(kinds := {tag.stamps.kind for tag in tags}) > 1:
        raise RecordError(
            f"{name}: the tags have time stamps of different kinds ({', '.join(sorted(kinds))}); export all with a "
            "zone, or give the zone of the others with timezone= (--timezone)."
        )
    repaired: dict[int, tuple[Stamps, NDArray[np.int64], NDArray[np.float64]]] = {}
    for tag in tags:
        if id(tag.stamps) not in repaired:
            stamps = repair_stamps(tag.stamps)
            order = np.argsort(stamps.seconds, kind="stable")  # NaN last
            order = order[: int(np.isfinite(stamps.seconds).sum())]
            repaired[id(tag.stamps)] = stamps, order, stamps.seconds[order]
    if sum(order.size for _, order, _ in repaired.values()) < 2:
        row, cell = tags[0].stamps.first_unread or (0, "")
        raise RecordError(
            f"{name}, line {first_line + row}: {cell!r} is no time stamp known here; "
            "give time_format='...' (--time-format)."
        )
    stored = []
    for tag in tags:
        stamps, order, seconds = repaired[id(tag.stamps)]
        is_last = np.append(np.diff(seconds) > 0.0, True)[: seconds.size]
        notes = list(stamps.notes)
        if tag.values is not None and not is_last.all():
            twice = np.flatnonzero(~is_last)
            first, second = tag.values[order[twice]], tag.values[order[twice + 1]]
            if n_lost := int((~((first == second) | (np.isnan(first) & np.isnan(second)))).sum()):
                values = number_of(n_lost, "value")
                notes.append(f"Left out: {values} of {tag.name} with the time stamp of the next, which is another.")
        stored.append(_Stored(seconds[is_last], order[is_last], stamps.clock_jumps, stamps.dst_changes, notes))
    return stored


def _scan_time(steps: NDArray[np.float64]) -> float:
    """Time between two scans of a tag [s]: a short number where one is as near as the steps are to one another."""
    usual, least = (float(np.percentile(steps, share)) for share in (50.0, _SCAN_PERCENTILE))
    dt = usual if least >= 0.7 * usual else least
    near = 0.005 * dt if least < (1.0 - 1e-6) * usual else 1e-6 * dt
    shorter = (float(f"{dt:.{digits}g}") for digits in range(1, 5))
    return next((short for short in shorter if abs(short - dt) <= near), dt)


def _interpolate(one: _Stored, values: NDArray, moments: NDArray, limit: float, standing: NDArray) -> NDArray:
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


def _describe(tags: Sequence[TagSeries], stored: Sequence[_Stored], max_gap: float | None) -> str:
    """Say how tags were aligned."""
    count = sum(one.rows.size for one in stored)
    drawn = [tag.name for tag in tags if tag.method == "interpolate"]
    gap = "" if max_gap is None else f", for at most {in_seconds(max_gap)}"
    held = f"a value stands until the next{gap}" if len(drawn) < len(tags) else f"values are interpolated{gap}"
    other = f"; {', '.join(drawn)}: interpolated" if drawn and len(drawn) < len(tags) else ""
    return f"{count} values of {number_of(len(tags), 'tag')}, each on its own time stamps: {held}{other}."
