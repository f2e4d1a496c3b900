"""Cut records of one loop into windows, each judged by itself."""

from __future__ import annotations

import math
from datetime import datetime, timedelta
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.segment import judge_segment
from stiction.records.gaps import MAX_BRIDGED_GAP, missing_mask
from stiction.records.runs import runs

if TYPE_CHECKING:
    from stiction.diagnosis.result import Oscillation
    from stiction.diagnosis.segment import JudgedSegment
    from stiction.records.record import LoopRecord

__all__ = [
    "Cut", "cut", "cut_grid", "cut_record", "grid_begin", "grid_length", "is_one_window", "settle_target",
    "slowest_period", "window_target",
]  # fmt: skip

PERIODS = 15.0
"""Fewest periods of the slowest oscillation in a window [-]."""
SAMPLES = 5000
"""Samples of a window [-]."""
FEWEST_SAMPLES = 1000
"""Samples that are enough where more take longer than a shift [-]."""
SHIFT = 8.0 * 3600.0
"""Length of a shift [s]."""
GRID = tuple(86400.0 / k for k in range(1440, 0, -1) if 1440 % k == 0)
"""Lengths of windows that divide a day, whole minutes [s]; longer ones are whole days."""
DAY = 86400.0
"""Length of a day [s]."""
MAX_TRIED = 4
"""Windows among which one in control is looked for, to find the slowest oscillation [-]."""
LEAST_SHARE = 0.5
"""Share of its length that a stretch or a window on the grid must have to be judged [-]."""


class Cut(NamedTuple):
    """Samples of a record that make a window."""

    first: int
    """First sample."""
    last: int
    """One past the last sample."""
    start: datetime | None = None
    """Begin of the window on the grid of an audit; None without a grid."""
    complete: bool = True
    """Whether the record holds all of it, so that more data will not change it."""

    @property
    def samples(self) -> tuple[int, int]:
        """First sample, and one past the last."""
        return self.first, self.last


def slowest_period(oscillation: Oscillation) -> float:
    """Longest period of a loop [s]; 0 where nothing oscillates."""
    own = oscillation.period if oscillation.oscillating else 0.0
    return max([own, *(other.period for other in oscillation.others)])


def window_target(dt: float, period: float = 0.0) -> float:
    """Length of the windows of a loop [s].

    Parameters
    ----------
    dt : float
        Sampling period [s].
    period : float
        Period of the slowest oscillation [s]; 0 where nothing oscillates.

    Returns
    -------
    float
        5000 samples, or a shift where that is shorter and holds 1000 samples; at least 15 periods [s].

    Examples
    --------
    >>> window_target(1.0), window_target(10.0), window_target(60.0), window_target(1.0, period=600.0)
    (5000.0, 28800.0, 60000.0, 9000.0)
    """
    return max(PERIODS * period, min(SAMPLES * dt, max(SHIFT, FEWEST_SAMPLES * dt)))


def is_one_window(record: LoopRecord) -> bool:
    """Whether a record is too short for two windows of any loop."""
    return len(record) * record.dt < 2.0 * window_target(record.dt)


def grid_length(target: float) -> float:
    """Shortest length of the grid of an audit that holds a window of a length [s].

    Examples
    --------
    >>> grid_length(4000.0), grid_length(100_000.0)
    (4320.0, 172800.0)
    """
    return float(next((length for length in GRID if length >= target), 86400.0 * math.ceil(target / 86400.0)))


def grid_begin(moment: datetime, length: float) -> datetime:
    """Begin of the window of a length [s] that holds a moment, counted from midnight of 1970-01-01 in its zone.

    Examples
    --------
    >>> grid_begin(datetime(2026, 3, 2, 9, 30), 28800.0)
    datetime.datetime(2026, 3, 2, 8, 0)
    """
    midnight, step = datetime(1970, 1, 1, tzinfo=moment.tzinfo), timedelta(seconds=length)
    return midnight + (moment - midnight) // step * step


def cut_record(record: LoopRecord, target: float) -> list[Cut]:
    """Cut a record into windows of a length, apart at long gaps and where the controller is in manual.

    Parameters
    ----------
    record : LoopRecord
        The record.
    target : float
        Length of a window [s].

    Returns
    -------
    list of Cut
        Windows of equal length in each stretch, none overlapping; the whole record where it is shorter than two
        windows.
    """
    size = max(round(target / record.dt), 1)
    if len(record) < 2 * size:
        return [Cut(0, len(record))]
    blocked = np.zeros(len(record), dtype=bool)
    for first, last in runs(missing_mask(record.op, record.pv)):
        blocked[first:last] = last - first > MAX_BRIDGED_GAP
    if record.auto is not None:
        blocked |= ~record.auto
    cuts = []
    for first, last in runs(~blocked):
        count = int((last - first) / size + 1e-9)
        if count == 0 and last - first < LEAST_SHARE * size:
            continue
        ends = np.linspace(first, last, max(count, 1) + 1).round().astype(int).tolist()
        cuts += [Cut(*pair) for pair in pairwise(ends)]
    return cuts or [Cut(0, len(record))]


def cut(record: LoopRecord, target: float) -> list[Cut]:
    """Cut a record into windows of about a length [s]: on the grid of its days where it has times, else evenly.

    A record shorter than two windows is one window.
    """
    if len(record) * record.dt < 2.0 * target:
        return [Cut(0, len(record))]
    if record.start is None:
        return cut_record(record, target)
    return cut_grid(record, grid_length(target)) or [Cut(0, len(record))]


def settle_target(record: LoopRecord) -> tuple[float, dict[tuple[int, int], JudgedSegment]]:
    """Find the length of windows that suits the slowest oscillation of a loop.

    Parameters
    ----------
    record : LoopRecord
        The record.

    Returns
    -------
    tuple
        The length [s], and the segments that were judged on the way, by first and last sample.

    Notes
    -----
    The oscillation is that of the first window in control of the first day, or of the first window.
    """
    day, target = max(round(DAY / record.dt), 1), window_target(record.dt)
    while True:
        judged: dict[tuple[int, int], JudgedSegment] = {}
        period = 0.0
        for k, one in enumerate(cut(record, target)):
            if k and (k >= MAX_TRIED or one.last > day):
                break
            segment = judged[one.samples] = judge_segment(record, samples=one.samples)
            if segment.loop_state.in_control:
                period = slowest_period(segment.oscillation)
                break
        needed = window_target(record.dt, period)
        if needed <= target:
            return target, judged
        target = needed


def cut_grid(record: LoopRecord, length: float) -> list[Cut]:
    """Cut a record at the multiples of a length, counted from midnight of 1970-01-01 in the zone of the record.

    Parameters
    ----------
    record : LoopRecord
        A record with times.
    length : float
        Length of a window [s].

    Returns
    -------
    list of Cut
        The windows, but those of which the record holds less than half.
    """
    assert record.start is not None
    midnight = datetime(1970, 1, 1, tzinfo=record.start.tzinfo)
    begin = (record.start - midnight).total_seconds()
    end = begin + len(record) * record.dt
    cuts = []
    for k in range(math.floor(begin / length), math.ceil(end / length - 1e-9)):
        first, last = (
            max(0, min(len(record), math.ceil((edge * length - begin) / record.dt - 1e-6))) for edge in (k, k + 1)
        )
        if (last - first) * record.dt < LEAST_SHARE * length:
            continue
        complete = begin <= k * length + record.dt and end >= (k + 1) * length - record.dt
        cuts.append(Cut(first, last, midnight + timedelta(seconds=k * length), complete))
    return cuts
