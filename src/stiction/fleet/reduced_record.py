"""Shorter records for a fleet: block means where the oscillation allows it, else a part of the record."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError

if TYPE_CHECKING:
    from datetime import datetime

    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["average_blocks", "cut_time", "reduce_record"]

MIN_KNOWN_SHARE = 0.5
"""Share of the samples of a block that must be known [-]; else its mean is missing."""


def average_blocks(record: LoopRecord, width: int) -> LoopRecord:
    """Average each `width` samples of a record; the last samples that fill no block are left out.

    Parameters
    ----------
    record : LoopRecord
        The record.
    width : int
        Samples to a block [-].

    Returns
    -------
    LoopRecord
        Block means; a block is in automatic when all of its samples are.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> average_blocks(LoopRecord("FIC-101", 1.0, op=np.arange(7.0)), 3).op.tolist()
    [1.0, 4.0]
    """
    if width < 2:
        return record
    count = len(record) // width
    signals = {}
    for name in ("op", "pv", "sp", "mv", "valve_signal"):
        x = getattr(record, name)
        signals[name] = None if x is None else _block_means(x[: count * width].reshape(count, width))
    auto = None if record.auto is None else record.auto[: count * width].reshape(count, width).all(axis=1)
    origin = record.provenance
    origin = replace(
        origin, missing_samples=origin.missing_samples // width, held_samples=origin.held_samples // width,
        outliers=origin.outliers // width,
    )  # fmt: skip
    return replace(record, **signals, auto=auto, dt=record.dt * width, provenance=origin)


def reduce_record(
    record: LoopRecord, period: float, *, min_per_period: float = 30.0, max_samples: int = 3000, max_width: int = 8
) -> LoopRecord:
    """Shorten a record for the diagnosis.

    Parameters
    ----------
    record : LoopRecord
        The record.
    period : float
        Period of its oscillation [s]; NaN when there is none.
    min_per_period : float
        Block means to a period, at least [-].
    max_samples : int
        Samples of the result, at most, unless blocks are already `max_width` wide and the period is long [-].
    max_width : int
        Largest number of samples to a block [-].

    Returns
    -------
    LoopRecord
        Block means of the whole record; and of those, where the oscillation is too fast for wide blocks, the
        `max_samples` long part in which OP moves most, among those with the fewest missing values and the most time in
        automatic.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> record = LoopRecord("FIC-101", 5.0, op=np.arange(17280.0))
    >>> [(one.dt, len(one)) for one in (reduce_record(record, period) for period in (60.0, 1500.0))]
    [(5.0, 3000), (30.0, 2880)]
    """
    widest = max(1, min(max_width, -(-len(record) // max_samples)))
    width = widest if not np.isfinite(period) else max(1, min(widest, int(period / (min_per_period * record.dt))))
    means = average_blocks(record, width)
    if len(means) <= 1.25 * max_samples:
        return means
    first = _busiest_part(means, max_samples)
    return means.window(first, first + max_samples)


def cut_time(record: LoopRecord, since: datetime | None, until: datetime | None) -> LoopRecord:
    """Cut the samples from `since` on and before `until`; a time without a zone is in the zone of the record.

    Raises
    ------
    RecordError
        When the record has no times.
    """
    if since is None and until is None:
        return record
    if record.start is None:
        raise RecordError(f"{record.tag} has no times, so since and until cannot be used; leave them out.")
    ends = [0, len(record)]
    for k, moment in enumerate((since, until)):
        if moment is not None:
            start = record.start
            if start.tzinfo is not None and moment.tzinfo is None:
                moment = moment.replace(tzinfo=start.tzinfo)
            elif start.tzinfo is None and moment.tzinfo is not None:
                start = start.replace(tzinfo=moment.tzinfo)
            ends[k] = max(0, min(len(record), int(np.ceil((moment - start).total_seconds() / record.dt - 1e-9))))
    return record.window(ends[0], max(ends))


def _block_means(blocks: NDArray[np.float64]) -> NDArray[np.float64]:
    means = blocks.mean(axis=1)
    if np.isfinite(means).all():
        return means
    known = np.isfinite(blocks)
    count = known.sum(axis=1)
    total = np.where(known, blocks, 0.0).sum(axis=1)
    return np.divide(total, count, out=np.full(len(blocks), np.nan), where=count >= MIN_KNOWN_SHARE * blocks.shape[1])


def _busiest_part(record: LoopRecord, size: int) -> int:
    """First sample of the part with the fewest unusable samples, and of those the one in which OP moves most."""
    usable = np.isfinite(record.op)
    if record.pv is not None:
        usable &= np.isfinite(record.pv)
    if record.auto is not None:
        usable &= record.auto
    moves = np.abs(np.diff(np.nan_to_num(record.op), prepend=np.nan_to_num(record.op[:1])))
    firsts = np.unique(np.linspace(0, len(record) - size, 9).astype(int))
    shares = [round(float(usable[k : k + size].mean()), 2) for k in firsts]
    travel = [float(moves[k : k + size].sum()) for k in firsts]
    return int(firsts[max(range(len(firsts)), key=lambda k: (shares[k], travel[k]))])
