"""Rows in the order of time: newest-first files reversed, a clock that was set back undone, the rest sorted."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.duration_format import format_seconds
from stiction.display.number_format import count_noun

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from stiction.sources.time.stamps import Stamps

    RowsDiffer = Callable[[NDArray[np.int64], NDArray[np.int64]], NDArray[np.bool_]]

__all__ = ["MAX_SHARED_STAMPS", "SortedRows", "is_newest_first", "sort_by_time", "to_datetime"]

MAX_SHARED_STAMPS = 0.1
"""Share of the rows that may have the stamp of another one and other values [-]."""
_HOUR = 3600.0


@dataclass
class SortedRows:
    """Rows with a readable stamp in the order of time."""

    seconds: NDArray[np.float64]
    """Time of each row, clock changes undone [s], shape (n_rows,)."""
    rows: NDArray[np.int64]
    """Row of the source, shape (n_rows,)."""
    clock_jumps: int
    """Steps back that were undone or sorted, and changes to or from summer time."""
    dst_changes: int
    """How many of `clock_jumps` were changes to or from summer time."""
    notes: list[str] = field(default_factory=list)
    """Assumptions, a sentence each."""


def sort_by_time(stamps: Stamps, rows_differ: RowsDiffer | None = None) -> SortedRows:
    """Bring rows into the order of time; `rows_differ` tells for pairs of rows whether they have other values.

    Without `rows_differ` no clock counts as set back, since rows with earlier times may be copies. Only a clock of kind
    "local" has summer time.

    Examples
    --------
    >>> from stiction.sources.time.stamps import Stamps
    >>> result = sort_by_time(Stamps(np.r_[0.0:8.0, 4.0:12.0], "relative"), np.not_equal)
    >>> float(np.diff(result.seconds).max()), result.notes[0]
    (1.0, 'The clock was set back by 4 s at row 9 of the data: the rows from there on are taken to follow the last.')
    """
    rows = np.flatnonzero(np.isfinite(stamps.seconds))
    result = SortedRows(stamps.seconds[rows], rows, stamps.clock_jumps, stamps.dst_changes)
    if is_newest_first(result.seconds):
        result.seconds, result.rows = result.seconds[::-1], rows[::-1]
        result.notes.append("The file runs from the newest row to the oldest and was turned round.")
    steps = np.diff(result.seconds)
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    if stamps.kind == "local" and 0.0 < usual < _HOUR / 2:
        _undo_summer_time(result, usual)
    if rows_differ is not None:
        _undo_set_back(result, usual, rows_differ)
    if n_back := int((np.diff(result.seconds) < 0).sum()):
        result.clock_jumps += n_back
        result.notes.append(
            "The rows are not in the order of time, which runs backwards "
            f"{count_noun(n_back, 'time')}: they were sorted."
        )
        order = np.argsort(result.seconds, kind="stable")
        result.seconds, result.rows = result.seconds[order], result.rows[order]
    return result


def is_newest_first(seconds: NDArray[np.float64]) -> bool:
    """Whether rows run from the newest to the oldest, nine of ten steps at least."""
    steps = np.diff(seconds)
    return bool((steps < 0).sum() > 0.9 * np.count_nonzero(steps))


def to_datetime(seconds: float, kind: str) -> datetime | None:
    """Return the moment that seconds since 1970 mean, aware of its zone when the stamps are; None without a date."""
    if kind == "relative":
        return None
    return datetime(1970, 1, 1, tzinfo=UTC if kind == "utc" else None) + timedelta(seconds=round(seconds, 6))


def _undo_summer_time(result: SortedRows, usual: float) -> None:
    """Undo the hour that a wall clock repeats in autumn and skips in spring, on a Sunday from midnight to three."""
    seconds = result.seconds.copy()
    excess = np.diff(seconds) - usual
    for k in np.flatnonzero(np.abs(np.abs(excess) - _HOUR) < 0.5 * usual):
        moment = datetime(1970, 1, 1) + timedelta(seconds=round(float(result.seconds[k]), 6))
        about = moment + timedelta(minutes=5)
        if about.weekday() == 6 and 60 * about.hour + about.minute <= 190 and about.month in (3, 4, 9, 10, 11):
            seconds[k + 1 :] -= np.sign(excess[k]) * _HOUR
            result.clock_jumps += 1
            result.dst_changes += 1
            way, season = ("forward", "start") if excess[k] > 0 else ("back", "end")
            result.notes.append(f"The clock goes {way} one hour at {moment}: taken as the {season} of summer time.")
    result.seconds = seconds


def _undo_set_back(result: SortedRows, usual: float, rows_differ: RowsDiffer) -> None:
    """Let the time go on where rows with other values have times that were there before.

    Not where the times begin anew, as where two exports stand one below the other, nor where rows that are late fill a
    gap.
    """
    t, rows = result.seconds, result.rows
    backwards = np.flatnonzero(np.diff(t) < 0) + 1
    if not 0 < backwards.size <= 200:  # with more the rows are out of order
        return
    bounds = [0, *backwards.tolist(), len(t)]
    shift = np.zeros(len(t))
    for begin, at, end in zip(bounds, bounds[1:], bounds[2:], strict=False):
        before, by = t[begin:at], float(t[at - 1] - t[at]) + usual
        again = t[at : at + int(np.searchsorted(t[at:end], before[-1], side="right"))]
        # Where several rows have one time, the first is compared with the first, the second with the second.
        place = np.searchsorted(before, again) + np.arange(len(again)) - np.searchsorted(again, again)
        right = np.minimum(place, len(before) - 1)
        left = np.maximum(right - 1, 0)
        near = np.where(again - before[left] < before[right] - again, left, right)
        repeated = np.flatnonzero(np.abs(again - before[near]) <= 0.75 * usual)
        if t[at] <= t[0] or len(repeated) < max(3, 0.5 * len(again)):
            continue
        if rows_differ(rows[begin + near[repeated]], rows[at + repeated]).mean() > MAX_SHARED_STAMPS:
            shift[at:] += by
            result.clock_jumps += 1
            result.notes.append(
                f"The clock was set back by {format_seconds(by)} at row {rows[at] + 1} of the data: the rows from "
                "there on are taken to follow the last."
            )
    result.seconds = t + shift
