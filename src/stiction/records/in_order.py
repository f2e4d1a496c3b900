"""Rows in the order of time: newest-first files turned round, a clock that was set back undone, the rest sorted."""

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

__all__ = ["MOST_SHARED", "Ordered", "in_order", "moment_of", "newest_first"]

MOST_SHARED = 0.1
"""Share of the rows that may have the stamp of another one and other values [-]."""
_TURNED = 0.9
"""Share of the steps in time that go back from which on a file runs from its newest row to its oldest [-]."""
_AGAIN, _COVERED, _NEAR = 3, 0.5, 0.75
"""Rows and share of the rows behind a step back whose time other rows had before it, for a clock that was set back,
and how near one must come [steps]: rows that are only out of order fill a gap."""
_HOUR = 3600.0


@dataclass
class Ordered:
    """Rows in the order of time."""

    t: NDArray[np.float64]
    """Their times, changes of the clock undone [s], shape (n_rows,)."""
    rows: NDArray[np.int64]
    """Which rows of the source they are, shape (n_rows,)."""
    clock_jumps: int = 0
    """Steps back that were undone or sorted, and changes of summer time."""
    summer_time: int = 0
    """How many of these were changes to or from summer time."""
    guesses: list[str] = field(default_factory=list)
    """What was taken for granted on the way, in sentences."""


def in_order(
    t: NDArray[np.float64],
    rows: NDArray[np.int64],
    kind: str,
    differ: Callable[[NDArray[np.int64], NDArray[np.int64]], NDArray[np.bool_]] | None = None,
) -> Ordered:
    """Bring rows into the order of time.

    Parameters
    ----------
    t : ndarray, shape (n_rows,)
        Time of each row [s], at least two, in the order of the file.
    rows : ndarray of int, shape (n_rows,)
        Which rows of the source they are.
    kind : str
        Kind of the stamps (see `stiction.records.timestamps.Stamps`): only a "local" clock has summer time.
    differ : callable, optional
        From two arrays of rows to whether these hold other values, pair by pair. Without it no clock is taken to have
        been set back: rows with times that were there before may be copies.

    Returns
    -------
    Ordered
        The rows, and what was done.

    Examples
    --------
    >>> back = in_order(np.r_[0.0:8.0, 4.0:12.0], np.arange(16), "relative", np.not_equal)
    >>> float(np.diff(back.t).max()), back.guesses[0]
    (1.0, 'The clock was set back by 4 s at row 9 of the data: the rows from there on are taken to follow the last.')
    """
    ordered, steps = Ordered(t, rows), np.diff(t)
    if newest_first(t):
        ordered.t, ordered.rows, steps = t[::-1], rows[::-1], -steps[::-1]
        ordered.guesses.append("The file runs from the newest row to the oldest and was turned round.")
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    if kind == "local" and 0.0 < usual < _HOUR / 2:
        _undo_summer_time(ordered, usual)
    if differ is not None:
        _undo_set_back(ordered, usual, differ)
    if back := int((np.diff(ordered.t) < 0).sum()):
        ordered.clock_jumps += back
        ordered.guesses.append(
            f"The rows are not in the order of time, which runs backwards {count_noun(back, 'time')}: they were sorted."
        )
        order = np.argsort(ordered.t, kind="stable")
        ordered.t, ordered.rows = ordered.t[order], ordered.rows[order]
    return ordered


def newest_first(t: NDArray[np.float64]) -> bool:
    """Whether rows run from the newest to the oldest, by their times in the order of the file.

    Examples
    --------
    >>> newest_first(np.array([3.0, 2.0, 2.0, 1.0])), newest_first(np.array([3.0, 1.0, 2.0, 0.0]))
    (True, False)
    """
    steps = np.diff(t)
    return bool((steps < 0).sum() > _TURNED * np.count_nonzero(steps))


def moment_of(seconds: float, kind: str) -> datetime:
    """Return the moment that seconds since 1970 are, in the zone that the kind of the stamps has.

    Examples
    --------
    >>> str(moment_of(86400.0, "local"))
    '1970-01-02 00:00:00'
    """
    zone = UTC if kind == "utc" else None
    return datetime(1970, 1, 1, tzinfo=zone) + timedelta(seconds=round(seconds, 6))


def _undo_summer_time(ordered: Ordered, usual: float) -> None:
    """Undo the hour that a wall clock repeats in autumn and leaves out in spring."""
    t, shift = ordered.t, np.zeros(len(ordered.t))
    steps = np.diff(t)
    near = 0.5 * usual
    for sign, way, season in ((1.0, "back", "end"), (-1.0, "forward", "start")):
        for k in np.flatnonzero(np.abs(steps + sign * _HOUR - usual) < near):
            moment = moment_of(float(t[k]), "local")
            if _clocks_change(moment):
                shift[k + 1 :] += sign * _HOUR
                ordered.clock_jumps += 1
                ordered.summer_time += 1
                told = f"The clock goes {way} one hour at {moment}: taken as the {season} of summer time."
                ordered.guesses.append(told)
    ordered.t = t + shift


def _clocks_change(moment: datetime) -> bool:
    """Whether clocks are changed about then: from midnight to three on a Sunday in spring or autumn."""
    about = moment + timedelta(minutes=5)
    return about.weekday() == 6 and 60 * about.hour + about.minute <= 190 and about.month in (3, 4, 9, 10, 11)


def _undo_set_back(ordered: Ordered, usual: float, differ: Callable[..., NDArray[np.bool_]]) -> None:
    """Let the time go on where the clock was set back: where rows with other values have times that were there before.

    Not where the times begin anew, as where two exports stand one below the other.
    """
    t, rows = ordered.t, ordered.rows
    ends = [0, *(np.flatnonzero(np.diff(t) < 0) + 1).tolist(), len(t)]
    shift = np.zeros(len(t))
    for begin, at, end in zip(ends, ends[1:], ends[2:], strict=False):
        before, by = t[begin:at], float(t[at - 1] - t[at]) + usual
        again = t[at : at + int(np.searchsorted(t[at:end], before[-1], side="right"))]
        # Where several rows have one time, the first is compared with the first, the second with the second.
        place = np.searchsorted(before, again) + np.arange(len(again)) - np.searchsorted(again, again)
        right = np.minimum(place, len(before) - 1)
        left = np.maximum(right - 1, 0)
        near = np.where(again - before[left] < before[right] - again, left, right)
        covered = np.flatnonzero(np.abs(again - before[near]) <= _NEAR * usual)
        if t[at] <= t[0] or len(covered) < max(_AGAIN, _COVERED * len(again)):
            continue
        if differ(rows[begin + near[covered]], rows[at + covered]).mean() > MOST_SHARED:
            shift[at:] += by
            ordered.clock_jumps += 1
            ordered.guesses.append(
                f"The clock was set back by {format_seconds(by)} at row {rows[at] + 1} of the data: the rows "
                "from there on "
                "are taken to follow the last."
            )
    ordered.t = t + shift
