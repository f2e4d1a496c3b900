"""OP at its limits: at 0 and 100 %, or clipped at its own largest or smallest value."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.records.rests import bridged, hardly_rests, lengths_of, moves_in, repeats, runs

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["at_limits", "clipped", "saturated", "shut"]

FLAT, CLIPPED, OFTEN = 10, 3, 3
"""Samples for which OP must rest at a limit to count as saturated, and where it hardly ever rests elsewhere, or comes
back to an extreme so often and to no other value, as it does not where values are rounded."""
SHUT, SHUT_OF_ALL = 0.1, 0.9
"""Share of a record, and of all the time that OP is at 0 or 100 %, that one rest there takes in a loop shut down [-].
Of 4 000 loops of `simulation.population` (seeds 10 and 12) seven have one, none of them sticky."""
LIMIT_TOLERANCE = 0.001
"""Distance from a limit within which OP counts as there, as a share of span [-]."""
SCALES = ((0.0, 100.0), (0.0, 1.0), (4.0, 20.0))
"""OP at its limits in %, as a fraction and in mA: OP that lies within one of them and rests at its end is there."""
LIVELY = 12
"""Values that OP must take off its extremes for these to be limits, and not two of the few values it was stored in."""


def saturated(record: LoopRecord) -> NDArray[np.bool_]:
    """Mark where OP rests at a limit, shape (n_samples,).

    That is 0 or 100 % (also as a fraction or in mA), or its own largest or smallest value while PV moves.
    """
    flat = _flat(record)
    mask = _clipped(record, flat)
    for at in _span_ends(bridged(record.op)):
        mask |= _resting(record, at, flat)
    return mask


def clipped(record: LoopRecord) -> NDArray[np.bool_]:
    """Mark where OP rests at its own largest or smallest value, off 0 and 100 %, while PV moves, shape (n_samples,).

    There the OP that was stored need not be the one the valve was sent; at 0 and 100 % it is.
    """
    return _clipped(record, _flat(record))


def at_limits(record: LoopRecord, running: int = 2) -> NDArray[np.bool_]:
    """Mark where OP is at 0 or 100 % of span for `running` samples or more, also as a fraction or in mA.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> op = np.array([40.0, 100.0, 100.0, 70.0, 100.0])
    >>> at_limits(LoopRecord("FIC-101", 1.0, op=op)).tolist()
    [False, True, True, False, False]
    """
    mask = np.zeros(len(record.op), dtype=bool)
    for at in _span_ends(record.op):
        for first, last in runs(at):
            mask[first:last] |= last - first >= running
    return mask


def shut(record: LoopRecord) -> NDArray[np.bool_]:
    """Mark the one long stretch in which OP rests at 0 or 100 %, shape (n_samples,): the loop is shut down, or held.

    Where OP comes to its limits again and again the loop is in operation, and none is marked.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> op = np.concatenate([40.0 + np.arange(80.0) % 7, np.zeros(20)])
    >>> int(shut(LoopRecord("FIC-101", 1.0, op=op)).sum())
    20
    """
    mask, at = np.zeros(len(record), dtype=bool), at_limits(record, FLAT)
    first, last = max(runs(at), key=lambda run: run[1] - run[0], default=(0, 0))
    if last - first > max(SHUT * at.size, SHUT_OF_ALL * at.sum()):
        mask[first:last] = True
    return mask


def _clipped(record: LoopRecord, flat: int) -> NDArray[np.bool_]:
    """What `clipped` marks, with the samples for which OP must rest (see `_flat`), which `saturated` knows already."""
    op = bridged(record.op)
    mask = np.zeros(len(op), dtype=bool)
    finite = op[np.isfinite(op)]
    if finite.size == 0 or np.unique(finite).size < LIVELY + 2:
        return mask
    spans = [end for end in _span_ends(op) if end.any()]
    for at in (op == finite.min(), op == finite.max()):
        if not any(end[at].all() for end in spans):
            mask |= _resting(record, at, flat, while_moving=True)
    return mask


def _flat(record: LoopRecord) -> int:
    """Samples for which OP must rest to be at a limit: few where it hardly ever rests elsewhere."""
    op, finite = record.op, record.op[np.isfinite(record.op)]
    if finite.size == 0:
        return FLAT
    inside = np.isfinite(op) & (op != finite.min()) & (op != finite.max())
    rests = runs(repeats(op) & inside)
    if hardly_rests(lengths_of(rests), int(np.count_nonzero(inside))):
        return CLIPPED
    once = len({float(op[first]) for first, _ in rests}) == len(rests)
    at_ends = (np.count_nonzero(lengths_of(runs(op == end)) >= CLIPPED) for end in (finite.min(), finite.max()))
    return CLIPPED if once and max(at_ends) >= OFTEN else FLAT


def _resting(record: LoopRecord, at: NDArray[np.bool_], flat: int, *, while_moving: bool = False) -> NDArray[np.bool_]:
    """Mark the runs of `at` in which `flat` samples or more were recorded, where asked only those in which PV moves."""
    mask = np.zeros(at.size, dtype=bool)
    for first, last in runs(at):
        recorded = int(np.isfinite(record.op[first:last]).sum())
        mask[first:last] = recorded >= flat and (not while_moving or moves_in(record.pv, first, last))
    return mask


def _span_ends(op: NDArray[np.float64]) -> Iterator[NDArray[np.bool_]]:
    """Where OP is at an end of each span that it could be in, shape (n_samples,) each."""
    finite = op[np.isfinite(op)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    for zero, full in SCALES:
        near = LIMIT_TOLERANCE * (full - zero)
        if low >= zero - near and zero + 50.0 * near < high <= full + near and low < high:
            yield (op <= zero + near) | (op >= full - near)
