"""Block means: the signals of each loop on a clock that all loops share, short enough to store for a whole plant."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError, require_count
from stiction.records.record import require_record

if TYPE_CHECKING:
    from collections.abc import Sequence
    from datetime import datetime

    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["BlockMeans", "Clock", "common_clock", "make_block_means"]


@dataclass(frozen=True)
class Clock:
    """The blocks that all loops share."""

    start: datetime | None
    """Time of the first block; None where the records have no times and all start together."""
    dt: float
    """Length of a block over the whole time [s]."""
    count: int
    """Blocks over the whole time [-]."""
    fast_dt: float
    """Length of a block in the fast part, which shows short periods [s]."""
    fast_first: float
    """Where the fast part begins, after `start` [s]."""
    fast_count: int
    """Blocks of the fast part; 0 where the blocks over the whole time are as short [-]."""


@dataclass(frozen=True)
class BlockMeans:
    """Block means of one loop. Each array is empty where the signal is missing or does not move."""

    tag: str
    """Tag of the loop."""
    clock: Clock
    """The blocks."""
    error: NDArray[np.float32] = field(repr=False)
    """Control error SP - PV, or -PV where no set point is known, shape (n_blocks,) [engineering units]."""
    op: NDArray[np.float32] = field(repr=False)
    """Controller output, shape (n_blocks,) [% of span]."""
    fast_error: NDArray[np.float32] = field(repr=False)
    """Control error in the fast part, shape (n_fast_blocks,) [engineering units]."""
    fast_op: NDArray[np.float32] = field(repr=False)
    """Controller output in the fast part, shape (n_fast_blocks,) [% of span]."""
    secondary_tag: str = ""
    """Tag of the secondary loop where this loop is the primary of a cascade."""


def common_clock(records: Sequence[LoopRecord], *, max_blocks: int = 4096) -> Clock:
    """Find blocks for a set of records: from the first start to the last end, and a fast part in the middle.

    `records`: records of one time span. Either all of them have a start time or none. `max_blocks`: largest number of
    blocks, over the whole time and in the fast part [-]. Returns blocks of a whole number of the shortest sampling
    period. Raises RecordError when there is no record, or only some of them have a start time or a time zone.

    The fast part has blocks of one sampling period. It is there because a mean over a block longer than a tenth of
    the period changes an oscillation.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> clock = common_clock([LoopRecord("FIC-101", 5.0, op=np.zeros(17280))])
    >>> clock.dt, clock.count, clock.fast_dt, clock.fast_count
    (25.0, 3456, 5.0, 4096)
    """
    max_blocks = require_count("max_blocks", max_blocks)
    if not records:
        raise RecordError("There is no record, so there is no common clock; give at least one.")
    for record in records:
        require_record(record)
    dated = [record.start for record in records if record.start is not None]
    if dated and len(dated) < len(records):
        missing = next(record.tag for record in records if record.start is None)
        raise RecordError(
            f"{missing} has no start time, but other records have one; give all of them a start time, or none."
        )
    if len({moment.tzinfo is None for moment in dated}) > 1:
        raise RecordError(
            "Some records have a start time with a time zone and some without; give all of them a time zone, or none."
        )
    start = min(dated) if dated else None
    ends = [_offset(record, start) + record.duration for record in records]
    fast_dt, duration = min(record.dt for record in records), max(ends)
    width = max(1, math.ceil(duration / (fast_dt * max_blocks)))
    count = math.ceil(duration / (fast_dt * width) - 1e-9)
    if width == 1:
        return Clock(start, fast_dt, count, fast_dt, 0.0, 0)
    first = fast_dt * round((duration / fast_dt - max_blocks) / 2.0)
    return Clock(start, fast_dt * width, count, fast_dt, first, max_blocks)


def make_block_means(record: LoopRecord, clock: Clock) -> BlockMeans:
    """Average the control error and the OP of a record over the blocks of a clock.

    `record`: the record of one loop. `clock`: the blocks, as `common_clock` finds them. Returns gaps shorter than half
    of the record are bridged by straight lines. A sample of a record whose sampling period is longer than the block is
    held.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> record = LoopRecord("FIC-101", 1.0, op=np.arange(16.0), pv=np.arange(16.0))
    >>> make_block_means(record, common_clock([record], max_blocks=8)).op.tolist()
    [0.5, 2.5, 4.5, 6.5, 8.5, 10.5, 12.5, 14.5]
    """
    from stiction.diagnosis.oscillation.signals import control_error, filled

    require_record(record)
    first = _offset(record, clock.start)
    error, op = control_error(record), filled(record.op)
    whole = (0.0, clock.dt, clock.count)
    fast = (clock.fast_first, clock.fast_dt, clock.fast_count)
    means = [_average(x, first, record.dt, *blocks) for blocks in (whole, fast) for x in (error, op)]
    return BlockMeans(record.tag, clock, *means, secondary_tag=record.provenance.secondary_tag)


def _offset(record: LoopRecord, start: datetime | None) -> float:
    """Time of the first sample after the start of the clock [s]."""
    if start is None or record.start is None:
        return 0.0
    return (record.start - start).total_seconds()


def _average(
    x: NDArray[np.float64] | None, first: float, dt: float, block_start: float, block: float, count: int
) -> NDArray[np.float32]:
    """Means over `count` blocks from `block_start` on; blocks outside the record repeat its mean."""
    if x is None or count == 0:
        return np.empty(0, dtype=np.float32)
    edges = (block_start + block * np.arange(count + 1) - first) / dt
    total = np.concatenate([(0.0,), np.cumsum(x - x.mean())])
    inside = np.clip(edges, 0.0, x.size)
    integral = np.interp(inside, np.arange(x.size + 1.0), total)
    length = np.diff(inside)
    means = np.divide(np.diff(integral), length, out=np.zeros(count), where=length > 0.0)
    return (means + x.mean()).astype(np.float32) if np.ptp(means) > 0.0 else np.empty(0, dtype=np.float32)
