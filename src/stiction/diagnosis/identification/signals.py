"""The signals as the search takes them: gaps held, long records thinned, the scale of slow disturbances chosen."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.search import remove_local_mean
from stiction.errors import RecordError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["Signals", "hold_gaps", "pieces_of", "prepare"]

SAMPLES_PER_PERIOD = 50
"""Samples of an oscillation kept when a long record is thinned."""
PERIODS_PER_PIECE, MOST_PIECES = 8.0, 8
"""Periods in a stretch searched by itself, and the largest number of stretches."""
FEWEST_SAMPLES, ENOUGH_SAMPLES = 30, 3000
"""Records below the first are refused, up to the second never thinned."""


class Signals(NamedTuple):
    """What the search compares."""

    op: NDArray[np.float64]
    """Controller output without gaps [% of span], shape (n_samples,)."""
    pv: NDArray[np.float64]
    """Process variable without gaps [engineering units], shape (n_samples,)."""
    target: NDArray[np.float64]
    """PV without its local mean [engineering units], shape (n_samples,)."""
    dt: float
    """Sampling period after thinning [s]."""
    thinned: int
    """Every how many samples of the record one was kept."""
    half: int
    """Half width of the local mean [samples]; 0 for the mean of the whole record."""
    scale: float
    """Time scale on which processes are looked for [samples]."""
    first: int = 0
    """Where a stretch begins in the whole."""
    turn: tuple[int, float] = (0, 0.0)
    """First sample at which OP turns for good, and the direction it had; (0, 0.0) where none is seen."""


def hold_gaps(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fill NaN with the last value before it, leading ones with the first value after them."""
    good = np.isfinite(x)
    if good.all():
        return x
    if not good.any():
        raise RecordError("the signal has no valid sample; check the column that was read.")
    last = np.maximum.accumulate(np.where(good, np.arange(x.size), -1))
    return x[np.where(last >= 0, last, int(np.argmax(good)))]


def prepare(record: LoopRecord, period: float | None) -> Signals:
    """Fill gaps, thin where the record is long, and take the local mean off the PV.

    Parameters
    ----------
    record : LoopRecord
        A record with a PV.
    period : float or None
        Period of the oscillation [s]; None compares the whole record about its mean.

    Returns
    -------
    Signals
        What the search compares.

    Raises
    ------
    RecordError
        When the record has no PV, is too short, or OP or PV has no valid sample.
    """
    if record.pv is None:
        raise RecordError(f"{record.tag} has no PV; an identification needs OP and PV.")
    if len(record) < FEWEST_SAMPLES:
        raise RecordError(f"{record.tag} has {len(record)} samples; an identification needs at least {FEWEST_SAMPLES}.")
    op, pv, dt = hold_gaps(record.op), hold_gaps(record.pv), record.dt
    # Rounded, lest the unit of time decide how a tie on the grids of the search falls.
    span = round(period / dt, 6) if period is not None else op.size / 5.0
    thinned = 1
    if op.size > ENOUGH_SAMPLES:
        thinned = max(int(min(span / SAMPLES_PER_PERIOD, op.size / ENOUGH_SAMPLES)), 1)
        op, pv = np.ascontiguousarray(op[::thinned]), _average(pv, thinned, op[::thinned].size)
    span /= thinned
    half = 0 if period is None else min(max(round(span / 2.0), 2), max((op.size - 1) // 4, 1))
    target = np.empty_like(pv)
    remove_local_mean(pv, half, target)
    return Signals(op, pv, target, dt * thinned, thinned, half, span)


def pieces_of(signals: Signals) -> list[Signals]:
    """Cut signals that oscillate into stretches of about eight periods, at most eight, overlapping by one period.

    Parameters
    ----------
    signals : Signals
        The whole record; without a period it stays whole.

    Returns
    -------
    list of Signals
        The stretches, in order.
    """
    n = signals.op.size
    if signals.half == 0:
        return [signals]
    periods = n / signals.scale
    count = max(min(int((periods - 1.0) / (PERIODS_PER_PIECE - 1.0)), MOST_PIECES), 1)
    overlap = 2 * signals.half + 1 if count > 1 else 0
    length = (n + (count - 1) * overlap + count - 1) // count
    stretches = []
    for i in range(count):
        first = min(i * (length - overlap), n - length)
        cut = slice(first, first + length)
        target = np.empty(length)
        pv = np.ascontiguousarray(signals.pv[cut])
        remove_local_mean(pv, signals.half, target)
        op = np.ascontiguousarray(signals.op[cut])
        turn = _turn(op, round(1.25 * signals.scale))
        stretches.append(signals._replace(op=op, pv=pv, target=target, first=first, turn=turn))
    return stretches


def _turn(op: NDArray[np.float64], window: int) -> tuple[int, float]:
    """First sample at which OP turns for good, and the direction it had.

    A valve that makes its loop cycle moves until OP turns. The largest and the smallest OP of a bit more than a
    period are such turns, unless they lie at the edge of that stretch.
    """
    part = op[:window]
    turns = [(int(np.argmax(part)), 1.0), (int(np.argmin(part)), -1.0)]
    inside = [turn for turn in turns if 2 < turn[0] < part.size - 3]
    return min(inside) if inside else (0, 0.0)


def _average(x: NDArray[np.float64], width: int, n: int) -> NDArray[np.float64]:
    """Mean of `width` samples about every `width`-th one, so that thinning does not fold noise in."""
    if width == 1:
        return x
    sums = np.concatenate([[0.0], np.cumsum(x - x[0])])
    centre = np.arange(n) * width
    first = np.maximum(centre - width // 2, 0)
    last = np.minimum(first + width, x.size)
    return (sums[last] - sums[first]) / (last - first) + x[0]
