"""The signals as the search takes them: gaps held, long records thinned, the scale of slow disturbances chosen."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.search import remove_local_mean
from stiction.errors import RecordError
from stiction.records.gaps import forward_fill, interpolate_gaps

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["Signals", "bridge_gaps", "hold_gaps", "pieces_of", "prepare", "require_enough"]

SAMPLES_PER_PERIOD = 36
"""Samples of an oscillation that are kept."""
PERIODS_PER_PIECE, MOST_PERIODS, MOST_PIECES = 8.0, 12.0, 8
"""Periods in a stretch searched by itself, the most there are, and the largest number of stretches."""
FEWEST_SAMPLES, ENOUGH_SAMPLES, FINE_SAMPLES = 30, 400, 1500
"""Records below the first are refused, up to the second never thinned, up to the third not for the last searches."""


class Signals(NamedTuple):
    """What the search compares."""

    op: NDArray[np.float64]
    """Controller output without gaps, never thinned [% of span], shape (n_samples * thinned,)."""
    pv: NDArray[np.float64]
    """Process variable without gaps [engineering units], shape (n_samples,)."""
    target: NDArray[np.float64]
    """PV without its local mean [engineering units], shape (n_samples,)."""
    dt: float
    """Sampling period after thinning [s]."""
    thinned: int
    """How many samples of the record each sample of the PV is the mean of."""
    half: int
    """Half width of the local mean [samples]; 0 for the mean of the whole record."""
    scale: float
    """Time scale on which processes are looked for [samples]."""
    first: int = 0
    """Where a stretch begins in the whole."""


def hold_gaps(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fill NaN with the last value before it, leading ones with the first value after them."""
    good = np.isfinite(x)
    if good.all():
        return x
    if not good.any():
        raise RecordError("the signal has no valid sample; check the column that was read.")
    return forward_fill(x, fill_start=True)


def bridge_gaps(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fill NaN along the line between the values beside it, lest a held OP trip a valve late; hold the ends."""
    return interpolate_gaps(x) if np.isfinite(x).any() else hold_gaps(x)


def require_enough(record: LoopRecord, name: str, x: NDArray[np.float64]) -> None:
    """Refuse a record in which OP and another signal were seldom recorded together.

    Parameters
    ----------
    record : LoopRecord
        The record.
    name : str
        Name of the other signal.
    x : ndarray, shape (n_samples,)
        The other signal, in its unit.

    Raises
    ------
    RecordError
        When fewer than 30 samples hold both.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.records import LoopRecord
    >>> op = np.arange(40.0)
    >>> require_enough(LoopRecord("FIC-101", 1.0, op=op), "PV", op)
    """
    both = int(np.count_nonzero(np.isfinite(record.op) & np.isfinite(x)))
    if both < FEWEST_SAMPLES:
        raise RecordError(
            f"{record.tag} has {both} samples with both OP and {name}, of {len(record)}; an identification needs at "
            f"least {FEWEST_SAMPLES}: record more of the loop, or more of its {name}."
        )


def prepare(record: LoopRecord, period: float | None, *, fine: bool = False) -> Signals:
    """Fill gaps, thin where the record is long, and take the local mean off the PV.

    Parameters
    ----------
    record : LoopRecord
        A record with a PV.
    period : float or None
        Period of the oscillation [s]; None compares the whole record about its mean.
    fine : bool
        Thin only what is longer than 1500 samples.

    Returns
    -------
    Signals
        What the search compares.

    Raises
    ------
    RecordError
        When the record has no PV, or fewer than 30 samples with both OP and PV.
    """
    if record.pv is None:
        raise RecordError(f"{record.tag} has no PV; an identification needs OP and PV.")
    require_enough(record, "PV", record.pv)
    op, pv, dt = bridge_gaps(record.op), bridge_gaps(record.pv), record.dt
    # Rounded, lest the unit of time decide how a tie on the grids of the search falls.
    span = round(period / dt, 6) if period is not None else op.size / 5.0
    thinned = 1
    if op.size > (FINE_SAMPLES if fine else ENOUGH_SAMPLES):
        shortest = op.size / (FINE_SAMPLES if fine else ENOUGH_SAMPLES)
        thinned = max(int(min(span / SAMPLES_PER_PERIOD, shortest)), 1)
        n = op.size // thinned
        op, pv = op[: n * thinned], pv[: n * thinned].reshape(n, thinned).mean(axis=1)
    span /= thinned
    half = 0 if period is None else min(max(round(span / 2.0), 2), max((pv.size - 1) // 4, 1))
    target = np.empty_like(pv)
    remove_local_mean(pv, half, target)
    return Signals(op, pv, target, dt * thinned, thinned, half, span)


def pieces_of(signals: Signals) -> list[Signals]:
    """Cut signals that oscillate into stretches of about eight periods, at most eight, overlapping by one period.

    Of a record of more than some hundred periods the stretches are spread evenly, with gaps between them.

    Parameters
    ----------
    signals : Signals
        The whole record; without a period it stays whole.

    Returns
    -------
    list of Signals
        The stretches, in order.
    """
    n = signals.target.size
    if signals.half == 0:
        return [signals]
    periods = n / signals.scale
    count = max(min(int((periods - 1.0) / (PERIODS_PER_PIECE - 1.0)), MOST_PIECES), 1)
    overlap = 2 * signals.half + 1 if count > 1 else 0
    length = (n + (count - 1) * overlap + count - 1) // count
    firsts = [min(i * (length - overlap), n - length) for i in range(count)]
    if length > MOST_PERIODS * signals.scale:
        length = int(MOST_PERIODS * signals.scale)
        firsts = np.linspace(0, n - length, count).astype(int).tolist()
    stretches = []
    for first in firsts:
        cut = slice(first, first + length)
        target = np.empty(length)
        pv = np.ascontiguousarray(signals.pv[cut])
        remove_local_mean(pv, signals.half, target)
        op = signals.op[first * signals.thinned : (first + length) * signals.thinned]
        stretches.append(signals._replace(op=op, pv=pv, target=target, first=first))
    return stretches
