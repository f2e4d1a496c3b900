"""From the stamps as recorded to an even grid: order, repeated stamps, clock changes, gaps.

Samples are picked, never interpolated: a line between two samples of OP would invent a movement of the valve that the
controller did not ask for.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.duration_format import format_seconds
from stiction.display.number_format import count_noun
from stiction.errors import RecordError
from stiction.sources.time.rounded_stamps import spread_rounded_stamps
from stiction.sources.time.time_order import MAX_SHARED_STAMPS, is_newest_first, sort_by_time, to_datetime

if TYPE_CHECKING:
    from datetime import datetime

    from numpy.typing import NDArray

    from stiction.sources.time.stamps import Stamps
    from stiction.sources.time.time_order import RowsDiffer

__all__ = ["Grid", "regular_grid"]

HOLD_LIMIT_SAMPLES = 10
"""Sampling periods over which an unevenly recorded value is held; beyond them the time counts as missing."""


@dataclass
class Grid:
    """Which row of the source stands at each sample."""

    source_row: NDArray[np.int64]
    """Row of the source per sample, -1 where none was recorded, shape (n_samples,)."""
    dt: float
    """Sampling period [s]."""
    start: datetime | None = None
    """Time of the first sample: aware (UTC) when the stamps name a zone, naive for a wall clock, None otherwise."""
    clock_jumps: int = 0
    """Times that the clock jumped and was corrected."""
    dst_changes: int = 0
    """How many of `clock_jumps` were changes to or from summer time."""
    notes: list[str] = field(default_factory=list)
    """Assumptions, a sentence each."""


def regular_grid(
    stamps: Stamps,
    *,
    dt: float | None,
    name: str,
    first_line: int,
    max_hold: float | None = None,
    rows_differ: RowsDiffer | None = None,
) -> Grid:
    """Lay an even grid over the stamps.

    Parameters
    ----------
    stamps : Stamps
        Time of each row.
    dt : float or None
        Sampling period [s]; the median step when not given. Stamps that do not fit it are taken as wrong: the rows
        are then `dt` apart in the order they come, unless there is a `max_hold`.
    name : str
        File name, for messages.
    first_line : int
        Line of the first row, for messages.
    max_hold : float, optional
        Longest time over which a value stands [s], where rows are written when a value changes. When not given, an
        unevenly recorded one is held for `HOLD_LIMIT_SAMPLES` periods.
    rows_differ : callable, optional
        From two arrays of rows to whether these have other values, pair by pair; all do when not given.

    Returns
    -------
    Grid
        The row at each sample, with the notes of the grid; those of the stamps are not repeated.

    Raises
    ------
    RecordError
        When fewer than two stamps are understood, time stands still, more than `MAX_SHARED_STAMPS` of the rows share a
        stamp and differ, or the stamps span far more than was recorded.

    Examples
    --------
    >>> from stiction.sources.time.stamps import Stamps
    >>> grid = regular_grid(Stamps(np.array([0.0, 2.0, 4.0, 8.0]), "relative"), dt=None, name="a.csv", first_line=2)
    >>> grid.dt, grid.source_row.tolist()
    (2.0, [0, 1, 2, -1, 3])
    """
    known = np.flatnonzero(np.isfinite(stamps.seconds))
    n_lost = len(stamps.seconds) - len(known)
    if dt is not None and (len(known) < 2 or np.ptp(stamps.seconds[known]) == 0.0):
        return Grid(np.arange(len(stamps.seconds)), dt, notes=["The time stamps are of no use: dt is as given."])
    if len(known) < 2:
        row, cell = stamps.first_unread or (0, "")
        raise RecordError(
            f"{name}, line {first_line + row}: {cell!r} is no time stamp known here; "
            "give time_format='...' (--time-format) or dt= (--dt)."
        )
    result = sort_by_time(stamps.seconds[known], known, stamps.kind, rows_differ)
    grid = Grid(
        known, dt or 1.0, None, stamps.clock_jumps + result.clock_jumps, stamps.dst_changes + result.dst_changes
    )
    if n_lost:
        first = first_line + int(np.flatnonzero(~np.isfinite(stamps.seconds))[0])
        rows = count_noun(n_lost, "row")
        grid.notes.append(f"Left out: {rows} without a readable time stamp (first near line {first}).")
    grid.notes += result.notes
    t, rows = result.seconds, result.rows
    if t[0] == t[-1]:
        raise RecordError(
            f"{name}, line {first_line}: all time stamps are equal; give dt if the rows are evenly sampled."
        )
    twice = np.flatnonzero(np.diff(t) == 0.0)
    if not (rows_differ is not None and twice.size > 0 and not rows_differ(rows[twice], rows[twice + 1]).any()):
        t = spread_rounded_stamps(t, rows, stamps.resolution, grid.notes)
    if dt is not None and max_hold is None and not _fits(t, dt):
        return _grid_of_rows(stamps, t, dt)
    t, rows = _drop_repeated_stamps(t, rows, grid, name, rows_differ)
    if stamps.kind != "relative":
        grid.start = to_datetime(float(t[0]), stamps.kind)
    _place_rows(t, rows, dt, grid, name, max_hold)
    return grid


def _fits(t: NDArray, dt: float) -> bool:
    """Whether stamps are those of rows `dt` apart, with gaps."""
    steps = np.diff(t) / dt
    whole = np.round(steps)
    is_usual = bool(np.median(whole) == 1.0) and whole.sum() <= max(20 * len(t), 10_000)
    return is_usual and bool((whole >= 1.0).all() and np.abs(steps - whole).max() <= 0.3)


def _grid_of_rows(stamps: Stamps, t: NDArray, dt: float) -> Grid:
    """All rows, `dt` apart in the order they come, from the oldest on."""
    rows, reverse = np.arange(len(stamps.seconds)), is_newest_first(stamps.seconds[np.isfinite(stamps.seconds)])
    steps = np.diff(t)
    order = ", the last one first," if reverse else ""
    apart = " to ".join(dict.fromkeys(format_seconds(float(step)) for step in (steps.min(), steps.max())))
    note = (
        f"The rows are taken as {dt:g} s apart{order} in the order they come, as dt is given: the time stamps ({apart} "
        "apart) do not fit it and are not used."
    )
    start = None if stamps.kind == "relative" else to_datetime(float(t[0]), stamps.kind)
    return Grid(rows[::-1] if reverse else rows, dt, start, notes=[note])


def _drop_repeated_stamps(
    t: NDArray, rows: NDArray, grid: Grid, name: str, rows_differ: RowsDiffer | None
) -> tuple[NDArray, NDArray]:
    """Keep the last row of each stamp; refuse a record that loses many rows so."""
    is_last = np.append(np.diff(t) > 0, True)
    if n_repeated := int((~is_last).sum()):
        twice = np.flatnonzero(~is_last)
        n_other = n_repeated if rows_differ is None else int(rows_differ(rows[twice], rows[twice + 1]).sum())
        if n_other > MAX_SHARED_STAMPS * len(t):
            shared = f"{name}: {n_other} of {len(t)} rows have the time stamp of"
            limit = f"and other values (up to {MAX_SHARED_STAMPS:.0%} may)"
            if np.median(np.abs(rows[twice + 1] - rows[twice])) <= 1:
                raise RecordError(
                    f"{shared} the next {limit}, so the stamps are rounded; export finer ones, or, if the rows are "
                    "evenly sampled, give the sampling period with dt= (--dt) in seconds."
                )
            raise RecordError(
                f"{shared} one elsewhere in the file {limit}, as where two exports stand one below the other; give "
                "each as a file of its own."
            )
        values = f", {count_noun(n_other, 'row')} of them with other values" if n_other else ""
        grid.notes.append(f"Left out: {count_noun(n_repeated, 'row')} with the time stamp of the next{values}.")
    return t[is_last], rows[is_last]


def _place_rows(t: NDArray, rows: NDArray, dt: float | None, grid: Grid, name: str, max_hold: float | None) -> None:
    """Put each row at its sample: on a grid that all stamps fit, or else the last row at or before each sample."""
    steps = np.diff(t)
    grid.dt = float(dt) if dt else float(np.median(steps))
    whole = np.maximum(np.round(steps / grid.dt), 1.0)
    place = np.concatenate([[0.0], np.cumsum(whole)])
    if place[-1] > max(20 * len(t), 10_000):
        k = int(np.argmax(steps))
        raise RecordError(
            f"{name}: rows {rows[k] + 1} and {rows[k + 1] + 1} of the data are {steps[k]:.6g} s apart, the sampling "
            f"period is {grid.dt:.6g} s; cut the file there, or give dt."
        )
    if dt is None:  # the slope over all rows, so that a period of 9.999 s does not drift
        centred = place - place.mean()
        grid.dt = _short_number(float(np.sum(centred * (t - t[0])) / np.sum(centred * centred)))
    off = t - t[0] - place * grid.dt
    off -= (off.max() + off.min()) / 2
    if (dt is not None and max_hold is None) or np.abs(off).max() <= 0.3 * grid.dt:
        grid.source_row = np.full(int(place[-1]) + 1, -1, dtype=np.int64)
        grid.source_row[place.astype(np.int64)] = rows
        if max_hold is not None:
            samples = np.arange(grid.source_row.size)
            last = np.searchsorted(place, samples, side="right") - 1
            grid.source_row = np.where((samples - place[last]) * grid.dt <= max_hold, rows[last], grid.source_row)
        if n_missing := int((grid.source_row < 0).sum()):
            samples, gaps = count_noun(n_missing, "sample"), count_noun(int((whole > 1).sum()), "gap")
            grid.notes.append(f"Missing: {samples} in {gaps} of the time stamps (left as NaN).")
        return
    grid.dt = float(dt) if dt else _short_number(float(np.median(steps)))
    moments = t[0] + grid.dt * np.arange(int(np.floor((t[-1] - t[0]) / grid.dt + 1e-6)) + 1)
    last = np.searchsorted(t, moments + 1e-6 * grid.dt, side="right") - 1
    longest = max(HOLD_LIMIT_SAMPLES * grid.dt, max_hold or 0.0)
    grid.source_row = np.where(moments - t[last] <= longest, rows[last], -1)
    shortest, widest = format_seconds(steps.min()), format_seconds(steps.max())
    grid.notes.append(
        f"The stamps are uneven ({shortest} to {widest}): each value is held until the next, every {grid.dt:.6g} s, "
        f"for at most {format_seconds(longest)}."
    )


def _short_number(dt: float) -> float:
    """Round a period that is almost a short number."""
    short = float(f"{dt:.4g}")
    return short if abs(dt - short) <= 1e-5 * dt else dt
