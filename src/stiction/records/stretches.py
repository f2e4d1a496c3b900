"""Stretches of a record: missing, saturated, in manual, and the longest one that can be analysed."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["BRIDGE", "analysis_window", "in_manual", "missing", "runs", "saturated", "usable_part"]

BRIDGE = 5
"""Missing samples in a row over which the last value may be held."""
FLAT = 10
"""Samples for which OP must rest at a limit to count as saturated."""
LIMIT_TOLERANCE = 0.1
"""Distance from 0 or 100 % within which OP counts as at its limit [% of span]."""
MANUAL = 60
"""Samples for which OP must rest, PV moving, to count as in manual when the mode was not recorded."""


def runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and one past the last sample of every stretch of True.

    Examples
    --------
    >>> runs(np.array([True, False, True, True]))
    [(0, 1), (2, 4)]
    """
    edges = np.diff(np.concatenate([[0], mask.astype(np.int8), [0]]))
    return list(zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True))


def missing(record: LoopRecord) -> NDArray[np.bool_]:
    """Mark where OP or PV is missing, shape (n_samples,)."""
    gone = ~np.isfinite(record.op)
    return gone if record.pv is None else gone | ~np.isfinite(record.pv)


def _moves(x: NDArray[np.float64] | None, first: int, last: int) -> bool:
    """Whether a signal takes more than a few values within a stretch and moves by a visible part of its swing."""
    if x is None:
        return False
    part = x[first:last]
    part = part[np.isfinite(part)]
    swing = float(np.nanmax(x) - np.nanmin(x)) if part.size else 0.0
    return part.size > 0 and len(np.unique(part)) > 2 and float(part.max() - part.min()) > 0.05 * swing


def saturated(record: LoopRecord) -> NDArray[np.bool_]:
    """Mark where OP rests at 0 or 100 %, or at its own largest or smallest value while PV moves, shape (n_samples,)."""
    op = record.op
    mask = np.zeros(len(op), dtype=bool)
    finite = op[np.isfinite(op)]
    if finite.size == 0 or finite.min() == finite.max():
        return mask
    low, high = float(finite.min()), float(finite.max())
    in_percent = high > 5.0 and low >= -LIMIT_TOLERANCE and high <= 100.0 + LIMIT_TOLERANCE
    for limit, at in (
        ("span", (op <= LIMIT_TOLERANCE) | (op >= 100.0 - LIMIT_TOLERANCE) if in_percent else mask),
        ("own", op == low),
        ("own", op == high),
    ):
        for first, last in runs(at):
            if last - first >= FLAT and (limit == "span" or _moves(record.pv, first, last)):
                mask[first:last] = True
    return mask


def in_manual(record: LoopRecord) -> NDArray[np.bool_]:
    """Mark where the mode says so or OP rests for long while PV moves, shape (n_samples,)."""
    mask = np.zeros(len(record), dtype=bool) if record.auto is None else ~record.auto
    still = np.concatenate([[False], np.diff(record.op) == 0.0])
    at_limit = saturated(record)
    for start, last in runs(still):
        first = start - 1
        enough = last - first >= max(MANUAL, len(record) // 20)
        if enough and not at_limit[first:last].all() and _moves(record.pv, first, last):
            mask[first:last] = True
    return mask


def analysis_window(record: LoopRecord) -> tuple[int, int]:
    """Find the longest stretch in automatic, not saturated and without a gap above `BRIDGE` samples.

    Returns
    -------
    first, last : int
        The samples ``first <= k < last``; equal when there is none.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> op = [50.0, 51.0, float("nan"), 52.0] + 9 * [float("nan")] + [50.0, 51.0]
    >>> analysis_window(LoopRecord("FIC-101", 1.0, op=op, pv=op))
    (0, 4)
    """
    gone = missing(record)
    blocked = saturated(record) | in_manual(record)
    good = ~(gone | blocked)
    for first, last in runs(gone):
        inside = first > 0 and last < len(gone) and good[first - 1] and good[last]
        if inside and last - first <= BRIDGE and not blocked[first:last].any():
            good[first:last] = True
    return max(runs(good), key=lambda run: run[1] - run[0], default=(0, 0))


def usable_part(record: LoopRecord) -> LoopRecord:
    """Cut the analysis window as a record of its own, its small gaps bridged by holding the last value, and said so."""
    part = record.window(*analysis_window(record))
    signals = {name: getattr(part, name) for name in ("op", "pv", "sp", "mv", "valve_signal")}
    held = {name: _hold(x) for name, x in signals.items() if x is not None and len(x)}
    count = int(missing(part).sum())
    if not count:
        return replace(part, **held)
    told = f"{count} missing samples were bridged by holding the last value."
    origin = replace(part.provenance, guesses=(*part.provenance.guesses, told))
    return replace(part, **held, provenance=origin)


def _hold(x: NDArray[np.float64]) -> NDArray[np.float64]:
    last = np.maximum.accumulate(np.where(np.isfinite(x), np.arange(len(x)), 0))
    return x[last]
