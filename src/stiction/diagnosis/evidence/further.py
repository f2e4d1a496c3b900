"""Judge what is new of a loop, and pool it with the windows that a ledger holds."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta
from hashlib import blake2b
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.evidence.diagnose_windows import diagnose_windows
from stiction.diagnosis.evidence.pool_diagnoses import PooledWindows
from stiction.diagnosis.evidence.windows import DAY, Cut, cut, cut_grid, grid_begin, grid_length, settle_target
from stiction.diagnosis.segment import judge_segment

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.diagnosis.evidence.diagnose_windows import Judge
    from stiction.diagnosis.verdict.diagnosis import Diagnosis
    from stiction.diagnosis.verdict.history import Window
    from stiction.records.record import LoopRecord

__all__ = ["StoredWindow", "diagnose_further"]


class StoredWindow(NamedTuple):
    """A window of a loop as a ledger keeps it."""

    begin: datetime
    """Begin of its place on the grid of the loop."""
    length: float
    """Length of all windows of the loop [s]."""
    complete: bool
    """Whether more data will not change it."""
    digest: str
    """Digest of its OP and PV."""
    window: Window
    """What was found in it."""


def diagnose_further(
    record: LoopRecord, stored: Sequence[StoredWindow], length: float | None, judge: Judge
) -> tuple[Diagnosis, list[StoredWindow]]:
    """Judge the windows of a record that are new or changed, and pool them with all others of the loop.

    Parameters
    ----------
    record : LoopRecord
        What the source holds of the loop; windows of it that are known are not judged again.
    stored : sequence of StoredWindow
        The windows that are known.
    length : float or None
        Length of the windows of the loop [s]; None where it is not known, so that it is found from the first day.
    judge : callable
        Returns the diagnosis of a judged segment, with the published methods or without.

    Returns
    -------
    tuple
        The diagnosis of all windows, and the windows that are new or changed.

    Notes
    -----
    The length of the windows comes from the first day of the loop, and their bounds are its multiples, so that nothing
    depends on how the data are spread over several runs. A record that fills no half of such a window is a window of
    its own.
    """
    if record.start is None:
        return diagnose_windows([record], judge, methods=False), []
    target = 0.0
    if length is None:
        target, _ = settle_target(record.window(0, max(round(DAY / record.dt), 1)))
        length = grid_length(target)
    cuts = {one.start: one for one in cut_grid(record, length) if one.start is not None}
    cuts = cuts or {record.start: Cut(0, len(record), record.start, complete=False)}
    places = cuts.keys() | {one.begin for one in stored}
    # what a short record gave goes when there is a window at its place
    known = {
        one.begin: one for one in stored
        if (place := grid_begin(one.begin, length)) == one.begin or place not in places
    }  # fmt: skip
    pooled, new = PooledWindows(), list[StoredWindow]()
    begins = sorted(known.keys() | cuts.keys())
    for begin in begins:
        one, old = cuts.get(begin), known.get(begin)
        if one is None or (old is not None and old.complete and not one.complete):
            assert old is not None
            pooled.add_known(old.window)
            continue
        start_s, digest = (begin - begins[0]) / timedelta(seconds=1.0), _digest(record, one)
        if old is not None and old.digest == digest:
            pooled.add_known(old.window)
        else:
            window = pooled.add(judge(judge_segment(record, samples=one.samples), False), start_s)
            new.append(StoredWindow(begin, length, one.complete, digest, replace(window, contributions=())))
    if target and len(cut(record, target)) == 1:
        whole = len(new) == 1 and new[0].window.end_s - new[0].window.start_s == record.duration
        return (pooled.diagnose() if whole else diagnose_windows([record], judge, methods=False)), new
    if not new:
        last = max(cuts.values(), key=lambda one: one.first, default=None)
        pooled.stand_for(judge(judge_segment(record, samples=last and last.samples), False))
    return pooled.diagnose(), new


def _digest(record: LoopRecord, window: Cut) -> str:
    """Digest of the signals of a window."""
    hashed = blake2b(digest_size=8)
    for signal in (record.op, record.pv, record.sp):
        hashed.update(b"-" if signal is None else np.ascontiguousarray(signal[window.first : window.last]).tobytes())
    return hashed.hexdigest()
