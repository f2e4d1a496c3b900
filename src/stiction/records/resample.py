"""From the stamps as recorded to an even grid: order, repeats, clock changes, gaps.

Samples are picked, never interpolated: a line drawn between two samples of OP would invent a movement of the
valve that the controller did not ask for.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.duration_format import format_seconds
from stiction.display.number_format import count_noun
from stiction.errors import RecordError
from stiction.records.in_order import MOST_SHARED, in_order, moment_of, newest_first
from stiction.records.runs import runs

if TYPE_CHECKING:
    from collections.abc import Callable
    from datetime import datetime

    from numpy.typing import NDArray

    from stiction.records.timestamps import Stamps

__all__ = ["Grid", "regular_grid", "untangled"]

HOLD_LIMIT = 10
"""Sampling periods over which an unevenly recorded value is held; beyond it the time counts as missing."""
FEW_TICKS = 100
"""Ticks of the stamps per period above which their rounding does not matter [-]: a row moves by half a hundredth."""
EVEN_ROWS = 30
"""Rows without a gap that tell the period of rounded stamps."""


@dataclass
class Grid:
    """Which row of the source stands at each sample."""

    pick: NDArray[np.int64]
    """Row of the source per sample, -1 where none was recorded, shape (n_samples,)."""
    dt: float
    """Sampling period [s]."""
    start: datetime | None = None
    clock_jumps: int = 0
    summer_time: int = 0
    """How many of these were changes to or from summer time."""
    guesses: list[str] = field(default_factory=list)


def regular_grid(
    stamps: Stamps,
    dt: float | None,
    name: str,
    line: int,
    hold: float | None = None,
    differ: Callable[[NDArray[np.int64], NDArray[np.int64]], NDArray[np.bool_]] | None = None,
) -> Grid:
    """Lay an even grid over the stamps.

    Parameters
    ----------
    stamps : Stamps
        Time of each row.
    dt : float, optional
        Sampling period [s]; the median step when not given. Stamps that do not fit it are taken as wrong: the rows
        are then `dt` apart in the order they come, unless there is a `hold`.
    name : str
        File name, for messages.
    line : int
        Line of the first row, for messages.
    hold : float, optional
        Longest time over which a value stands [s], where rows are written when a value changes. When not given, an
        unevenly recorded one is held for `HOLD_LIMIT` periods.
    differ : callable, optional
        From two arrays of rows to whether these hold other values, pair by pair; all do when not given.

    Raises
    ------
    RecordError
        When fewer than two stamps are understood, time stands still, more than `MOST_SHARED` of the rows share a stamp
        and differ, or the stamps span far more than was recorded.
    """
    grid = Grid(np.empty(0, dtype=np.int64), dt or 1.0, clock_jumps=stamps.clock_jumps, summer_time=stamps.summer_time)
    known = np.flatnonzero(np.isfinite(stamps.seconds))
    lost = len(stamps.seconds) - len(known)
    if dt is not None and (len(known) < 2 or np.ptp(stamps.seconds[known]) == 0.0):
        return Grid(np.arange(len(stamps.seconds)), dt, guesses=["The time stamps are of no use: dt is as given."])
    if len(known) < 2:
        row, cell = stamps.unread or (0, "")
        raise RecordError(
            f"{name}, line {line + row}: {cell!r} is no time stamp known here; "
            "give time_format='...' (--time-format) or dt= (--dt)."
        )
    if lost:
        first = line + int(np.flatnonzero(~np.isfinite(stamps.seconds))[0])
        grid.guesses.append(
            f"Left out: {count_noun(lost, 'row')} without a readable time stamp (first near line {first})."
        )
    ordered = in_order(stamps.seconds[known], known, stamps.kind, differ)
    t, rows = ordered.t, ordered.rows
    grid.clock_jumps += ordered.clock_jumps
    grid.summer_time += ordered.summer_time
    grid.guesses += ordered.guesses
    if t[0] == t[-1]:
        raise RecordError(f"{name}, line {line}: all time stamps are equal; give dt if the rows are evenly sampled.")
    twice = np.flatnonzero(np.diff(t) == 0.0)
    copied = differ is not None and twice.size > 0 and not differ(rows[twice], rows[twice + 1]).any()
    t = t if copied else _spread_rounded(t, rows, grid, stamps.tick)
    if dt is not None and hold is None and not _fits(t, dt):
        return _row_by_row(stamps, t, dt)
    t, rows = _without_repeats(t, rows, grid, name, differ)
    if stamps.kind != "relative":
        grid.start = moment_of(float(t[0]), stamps.kind)
    _lay(t, rows, dt, grid, name, hold)
    return grid


def untangled(stamps: Stamps) -> Stamps:
    """Stamps of a column of its own, clock changes undone and those rounded spread, row by row.

    Parameters
    ----------
    stamps : Stamps
        Time of each row, in the order of the file.

    Returns
    -------
    Stamps
        The same rows, with what was guessed.
    """
    known = np.flatnonzero(np.isfinite(stamps.seconds))
    if known.size < 2:
        return stamps
    grid, ordered = Grid(np.empty(0, dtype=np.int64), 1.0), in_order(stamps.seconds[known], known, stamps.kind)
    seconds = np.full(stamps.seconds.size, np.nan)
    seconds[ordered.rows] = _spread_rounded(ordered.t, ordered.rows, grid, stamps.tick)
    return replace(
        stamps, seconds=seconds, guesses=[*stamps.guesses, *ordered.guesses, *grid.guesses],
        clock_jumps=ordered.clock_jumps, summer_time=ordered.summer_time,
    )  # fmt: skip


def _fits(t: NDArray, dt: float) -> bool:
    """Whether stamps are those of rows `dt` apart, with gaps, as far as each step tells."""
    steps = np.diff(t) / dt
    whole = np.round(steps)
    usual = bool(np.median(whole) == 1.0) and whole.sum() <= max(20 * len(t), 10_000)
    return usual and bool((whole >= 1.0).all() and np.abs(steps - whole).max() <= 0.3)


def _row_by_row(stamps: Stamps, t: NDArray, dt: float) -> Grid:
    """All rows, `dt` apart in the order they come, from the oldest on."""
    steps = np.diff(t)
    n, turned = len(stamps.seconds), newest_first(stamps.seconds[np.isfinite(stamps.seconds)])
    pick = np.arange(n)[::-1] if turned else np.arange(n)
    order = ", the last one first," if turned else ""
    apart = " to ".join(dict.fromkeys(format_seconds(float(step)) for step in (steps.min(), steps.max())))
    told = (
        f"The rows are taken as {dt:g} s apart{order} in the order they come, as dt is given: the time stamps ({apart} "
        "apart)"
    )
    start = None if stamps.kind == "relative" else moment_of(float(t[0]), stamps.kind)
    return Grid(pick, dt, start, guesses=[f"{told} do not fit it and are not used."])


def _spread_rounded(t: NDArray, rows: NDArray, grid: Grid, tick: float) -> NDArray:
    """Stamps rounded to the minute (or second) that several rows share, row after row: spread the rows evenly.

    Where hardly any rows share one, stamps rounded to a tick that is no part of the period are spread too.
    """
    values, first, counts = np.unique(t, return_index=True, return_counts=True)
    k = float(np.mean(counts[1:-1])) if len(values) >= 4 else 1.0
    if k < 1.2:
        return _off_the_ticks(t, tick, grid) if tick > 0.0 else t
    apart = np.maximum.reduceat(rows, first) - np.minimum.reduceat(rows, first)
    if np.mean(apart == counts - 1) < 0.9:  # the same time twice in a file is no rounding
        return t
    step, usual = float(np.median(np.diff(values))), int(np.median(counts[1:-1]))
    if usual >= 2 and np.mean(counts[1:-1] == usual) >= 0.9:
        place = np.concatenate([np.arange(c) + (max(0, usual - c) if i == 0 else 0) for i, c in enumerate(counts)])
        even = t + place * step / np.maximum(usual, np.repeat(counts, counts))
        dt = step / usual
    else:
        even, dt = _even_behind(t, step, (values[-1] - values[1]) / (first[-1] - first[1]))
    if dt > 0.0:
        shared = f"{usual}" if dt * usual == step else f"About {step / dt:.3g}"
        grid.guesses.append(f"{shared} rows share each stamp (rounded to {step:g} s): taken as {dt:g} s apart.")
    return even


def _even_behind(t: NDArray, step: float, dt: float) -> tuple[NDArray, float]:
    """Even times of about `dt` that are the stamps when rounded down to `step`; the stamps and 0 if there are none."""
    place = np.arange(len(t))

    def spread(period: float) -> float:
        return float(np.ptp(t - period * place))

    low, high = 0.8 * dt, 1.2 * dt
    for _ in range(40):  # the spread is convex in the period
        third = (high - low) / 3.0
        low, high = (low, high - third) if spread(low + third) < spread(high - third) else (low + third, high)
    for near in (*(float(f"{low:.{digits}g}") for digits in range(1, 6)), low):
        if spread(near) < step:
            return float((t - near * place).max()) + near * place, near
    return t, 0.0


def _off_the_ticks(t: NDArray, tick: float, grid: Grid) -> NDArray:
    """Stamps that go by one of two neighbouring numbers of ticks: the even times behind them, with their gaps.

    The period is that of the longest stretch without a gap, or else a short number; the stamps must lie on it.
    """
    ticks = np.round(np.diff(t) / tick).astype(np.int64)
    counts = np.bincount(np.minimum(ticks, FEW_TICKS + 1), minlength=FEW_TICKS + 2)
    fewer = int(np.argmax(counts[:FEW_TICKS] + counts[1 : FEW_TICKS + 1]))
    if len(t) < EVEN_ROWS or not (counts[fewer] and counts[fewer + 1]):
        return t
    first, last = max(runs((ticks == fewer) | (ticks == fewer + 1)), key=lambda run: run[1] - run[0])
    part = t[first : last + 1]
    _, dt = _even_behind(part, 1.001 * tick, float(part[-1] - part[0]) / (part.size - 1))
    plain = 10.0 ** np.floor(np.log10(tick)) * np.arange(1.0, 100.0)
    near = plain[(plain > max(fewer * tick, 1.01 * tick)) & (plain < (fewer + 1) * tick)]
    of_stretch = (dt,) if dt > 0.0 and part.size >= EVEN_ROWS else ()
    for period in (*of_stretch, *near[::-1]):  # of several short numbers the one that leaves the fewest gaps
        even = _placed(t, tick, float(period))
        if even is not None:
            grid.guesses.append(f"The stamps are rounded to {tick:g} s: taken as {period:g} s apart.")
            return even
    return t


def _placed(t: NDArray, tick: float, dt: float) -> NDArray | None:
    """Times `dt` apart, with gaps, that are the stamps when rounded to a tick; None where there are none."""
    place = np.arange(len(t))
    off = t - t[0] - dt * place
    if np.ptp(off) > 1.001 * tick:
        phase = np.sort((t - t[0]) % dt)
        open_ = np.diff(phase, append=phase[0] + dt)  # from each phase to the next, round the circle
        begin = phase[(int(np.argmax(open_)) + 1) % len(phase)]
        if open_.max() < dt - 1.001 * tick:
            return None
        # All phases lie within a tick from there on.
        place = np.floor((t - t[0] - begin) / dt + 1e-6)
        off = t - t[0] - dt * place
        if np.diff(place).min() < 1.0:
            return None
    low, high = t[0] + off.max() - 0.5 * tick, t[0] + off.min() + 0.5 * tick
    middle = 0.5 * (low + high)
    whole = round(middle)
    return (float(whole) if low <= whole <= high else middle) + dt * place


def _without_repeats(
    t: NDArray, rows: NDArray, grid: Grid, name: str, differ: Callable[..., NDArray[np.bool_]] | None
) -> tuple[NDArray, NDArray]:
    """The last row of each stamp; a record that loses many rows so is none."""
    keep = np.append(np.diff(t) > 0, True)
    if repeated := int((~keep).sum()):
        twice = np.flatnonzero(~keep)
        other = repeated if differ is None else int(differ(rows[twice], rows[twice + 1]).sum())
        if other > MOST_SHARED * len(t):
            shared = f"{name}: {other} of {len(t)} rows have the time stamp of"
            beside = np.median(np.abs(rows[twice + 1] - rows[twice])) <= 1
            raise RecordError(
                f"{shared} the next and other values (up to {MOST_SHARED:.0%} may), so the stamps are rounded; export "
                "finer ones, or, if the rows are evenly sampled, give the sampling period with dt= (--dt) in seconds."
                if beside
                else f"{shared} one elsewhere in the file and other values (up to {MOST_SHARED:.0%} may), as where two "
                "exports stand one below the other; give each as a file of its own."
            )
        values = f", {count_noun(other, 'row')} of them with other values" if other else ""
        grid.guesses.append(f"Left out: {count_noun(repeated, 'row')} with the time stamp of the next{values}.")
    return t[keep], rows[keep]


def _lay(t: NDArray, rows: NDArray, dt: float | None, grid: Grid, name: str, hold: float | None) -> None:
    steps = np.diff(t)
    grid.dt = float(dt) if dt else float(np.median(steps))
    whole = np.maximum(np.round(steps / grid.dt), 1.0)
    counted = dt is not None and hold is None
    place = np.concatenate([[0.0], np.cumsum(whole)])
    if place[-1] > max(20 * len(t), 10_000):
        k = int(np.argmax(steps))
        raise RecordError(
            f"{name}: rows {rows[k] + 1} and {rows[k + 1] + 1} of the data are {steps[k]:.6g} s apart, the sampling "
            f"period is {grid.dt:.6g} s; cut the file there, or give dt."
        )
    if dt is None:  # the slope over all rows, so that a period of 9.999 s does not drift
        grid.dt = _plain(float(np.polyfit(place, t - t[0], 1)[0]))
    off = t - t[0] - place * grid.dt
    off -= (off.max() + off.min()) / 2
    if counted or np.abs(off).max() <= 0.3 * grid.dt:
        grid.pick = np.full(int(place[-1]) + 1, -1, dtype=np.int64)
        grid.pick[place.astype(np.int64)] = rows
        if hold is not None:
            last = np.searchsorted(place, np.arange(grid.pick.size), side="right") - 1
            stands = (np.arange(grid.pick.size) - place[last]) * grid.dt <= hold
            grid.pick = np.where(stands, rows[last], grid.pick)
        if missing := int((grid.pick < 0).sum()):
            gaps = int((whole > 1).sum())
            grid.guesses.append(
                f"Missing: {count_noun(missing, 'sample')} in {count_noun(gaps, 'gap')} of the time stamps "
                "(left as NaN)."
            )
        return
    grid.dt = float(dt) if dt else _plain(float(np.median(steps)))
    moments = t[0] + grid.dt * np.arange(int(np.floor((t[-1] - t[0]) / grid.dt + 1e-6)) + 1)
    last = np.searchsorted(t, moments + 1e-6 * grid.dt, side="right") - 1
    longest = max(HOLD_LIMIT * grid.dt, hold or 0.0)
    grid.pick = np.where(moments - t[last] <= longest, rows[last], -1)
    grid.guesses.append(
        f"The stamps are uneven ({format_seconds(steps.min())} to {format_seconds(steps.max())}): each value is held "
        f"until the next, every {grid.dt:.6g} s, for at most {format_seconds(longest)}."
    )


def _plain(dt: float) -> float:
    """Round a period that is almost a short number."""
    short = float(f"{dt:.4g}")
    return short if abs(dt - short) <= 1e-5 * dt else dt
