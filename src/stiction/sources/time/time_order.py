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

    RowsDiffer = Callable[[NDArray[np.int64], NDArray[np.int64]], NDArray[np.bool_]]

__all__ = ["MAX_SHARED_STAMPS", "SortedRows", "is_newest_first", "sort_by_time", "to_datetime"]

MAX_SHARED_STAMPS = 0.1
"""Share of the rows that may have the stamp of another one and other values [-]."""
_MIN_SHARE_BACKWARDS = 0.9
"""Share of the steps that go back in time from which on a file runs from its newest row to its oldest [-]."""
_MIN_REPEATED_ROWS = 3
"""Rows whose time other rows had before, for a clock that was set back [-]."""
_MIN_REPEATED_SHARE = 0.5
"""Share of the rows after a step back whose time other rows had before; rows that are only late fill a gap [-]."""
_MAX_DISTANCE_STEPS = 0.75
"""Distance up to which two rows have the same time [steps]."""
_MAX_SET_BACKS = 200
"""Steps back above which the rows are out of order and no clock was set back [-]."""
_HOUR = 3600.0


@dataclass
class SortedRows:
    """Rows in the order of time."""

    seconds: NDArray[np.float64]
    """Time of each row, clock changes undone [s], shape (n_rows,)."""
    rows: NDArray[np.int64]
    """Row of the source, shape (n_rows,)."""
    clock_jumps: int = 0
    """Steps back that were undone or sorted, and changes to or from summer time."""
    dst_changes: int = 0
    """How many of `clock_jumps` were changes to or from summer time."""
    notes: list[str] = field(default_factory=list)
    """Assumptions, a sentence each."""


def sort_by_time(
    seconds: NDArray[np.float64], rows: NDArray[np.int64], kind: str, rows_differ: RowsDiffer | None = None
) -> SortedRows:
    """Bring rows, at least two, into the order of time.

    Without `rows_differ`, which tells pairs of rows with other values, no clock counts as set back, since rows with
    earlier times may be copies. Only a clock of kind "local" has summer time.

    Examples
    --------
    >>> result = sort_by_time(np.r_[0.0:8.0, 4.0:12.0], np.arange(16), "relative", np.not_equal)
    >>> float(np.diff(result.seconds).max()), result.notes[0]
    (1.0, 'The clock was set back by 4 s at row 9 of the data: the rows from there on are taken to follow the last.')
    """
    result, steps = SortedRows(seconds, rows), np.diff(seconds)
    if is_newest_first(seconds):
        result.seconds, result.rows, steps = seconds[::-1], rows[::-1], -steps[::-1]
        result.notes.append("The file runs from the newest row to the oldest and was turned round.")
    forward = steps[steps > 0]
    usual = float(np.median(forward)) if forward.size else 0.0
    if kind == "local" and 0.0 < usual < _HOUR / 2:
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
    """Whether rows run from the newest to the oldest.

    Examples
    --------
    >>> is_newest_first(np.array([3.0, 2.0, 2.0, 1.0])), is_newest_first(np.array([3.0, 1.0, 2.0, 0.0]))
    (True, False)
    """
    steps = np.diff(seconds)
    return bool((steps < 0).sum() > _MIN_SHARE_BACKWARDS * np.count_nonzero(steps))


def to_datetime(seconds: float, kind: str) -> datetime:
    """Return the moment that seconds since 1970 mean, aware of its zone when the stamps are.

    Examples
    --------
    >>> str(to_datetime(86400.0, "local"))
    '1970-01-02 00:00:00'
    """
    zone = UTC if kind == "utc" else None
    return datetime(1970, 1, 1, tzinfo=zone) + timedelta(seconds=round(seconds, 6))


def _undo_summer_time(result: SortedRows, usual: float) -> None:
    """Undo the hour that a wall clock repeats in autumn and leaves out in spring."""
    seconds, shift = result.seconds, 0.0
    steps = np.diff(seconds)
    near = 0.5 * usual
    for sign, way, season in ((1.0, "back", "end"), (-1.0, "forward", "start")):
        for k in np.flatnonzero(np.abs(steps + sign * _HOUR - usual) < near):
            moment = to_datetime(float(seconds[k]), "local")
            if _is_change_of_clocks(moment):
                shift = shift + sign * _HOUR * (np.arange(len(seconds)) > k)
                result.clock_jumps += 1
                result.dst_changes += 1
                note = f"The clock goes {way} one hour at {moment}: taken as the {season} of summer time."
                result.notes.append(note)
    result.seconds = seconds + shift


def _is_change_of_clocks(moment: datetime) -> bool:
    """Whether clocks are changed about then: from midnight to three on a Sunday in spring or autumn."""
    about = moment + timedelta(minutes=5)
    return about.weekday() == 6 and 60 * about.hour + about.minute <= 190 and about.month in (3, 4, 9, 10, 11)


def _undo_set_back(result: SortedRows, usual: float, rows_differ: RowsDiffer) -> None:
    """Let the time go on where rows with other values have times that were there before.

    Not where the times begin anew, as where two exports stand one below the other.
    """
    t, rows = result.seconds, result.rows
    backwards = np.flatnonzero(np.diff(t) < 0) + 1
    if not 0 < backwards.size <= _MAX_SET_BACKS:
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
        repeated = np.flatnonzero(np.abs(again - before[near]) <= _MAX_DISTANCE_STEPS * usual)
        if t[at] <= t[0] or len(repeated) < max(_MIN_REPEATED_ROWS, _MIN_REPEATED_SHARE * len(again)):
            continue
        if rows_differ(rows[begin + near[repeated]], rows[at + repeated]).mean() > MAX_SHARED_STAMPS:
            shift[at:] += by
            result.clock_jumps += 1
            result.notes.append(
                f"The clock was set back by {format_seconds(by)} at row {rows[at] + 1} of the data: the rows from "
                "there on are taken to follow the last."
            )
    result.seconds = t + shift
