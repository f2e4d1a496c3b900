"""OP moved by hand: where the mode says so, and where it goes from one rest straight to the next, as in a step test."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.records.rests import FROZEN, MOST_RESTS, SELDOM, lengths_of, repeats, runs

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["by_hand", "stepped"]

BETWEEN = 1
"""Samples that OP may take from one rest to the next: a historian may draw a line between them."""
LIVELY_SHARE = 0.2
"""Share of the record in which OP must move at every sample for its rests to be no habit [-]: that of a controller
slower than the record goes from rest to rest all the time."""


def by_hand(record: LoopRecord) -> NDArray[np.bool_]:
    """Mark where the mode is not automatic, and where OP is `stepped`, shape (n_samples,)."""
    mask = stepped(record)
    return mask if record.auto is None else mask | ~record.auto


def stepped(record: LoopRecord) -> NDArray[np.bool_]:
    """Mark where OP rests at levels one straight after the other, as it never does otherwise, shape (n_samples,).

    One of them is neither its largest nor its smallest value: a controller at its limits leaps from one to the other at
    most.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> op = np.concatenate([50.0 + np.arange(40.0) % 3, np.repeat([51.0, 53.0, 47.0], 20)])
    >>> np.flatnonzero(stepped(LoopRecord("FIC-101", 1.0, op=op)))[[0, -1]].tolist()
    [40, 99]
    """
    mask = np.zeros(len(record), dtype=bool)
    rests = [(start - 1, last) for start, last in runs(repeats(record.op))]
    lengths = lengths_of(rests)
    long = lengths >= FROZEN
    lively = len(record) - lengths.sum()
    if long.sum() < 2 or lengths[~long].sum() >= SELDOM * len(record) or lively < LIVELY_SHARE * len(record):
        return mask
    chains: list[list[tuple[int, int]]] = []
    for rest, is_long in zip(rests, long, strict=True):
        if not is_long:
            continue
        if chains and rest[0] - chains[-1][-1][1] <= BETWEEN:
            chains[-1].append(rest)
        else:
            chains.append([rest])
    ends = float(np.nanmin(record.op)), float(np.nanmax(record.op))
    levels = [{float(record.op[first]) for first, _ in chain} for chain in chains]
    steps = [chain for chain, at in zip(chains, levels, strict=True) if len(at) > 1 and at.difference(ends)]
    if len(steps) <= MOST_RESTS:
        for chain in steps:
            mask[chain[0][0] : chain[-1][1]] = True
    return mask
