"""Judge each window of the records of a loop by itself, and pool them."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from typing import TYPE_CHECKING

from stiction.diagnosis.detection import detect_all
from stiction.diagnosis.evidence.pool_diagnoses import PooledWindows
from stiction.diagnosis.evidence.windows import cut, is_one_window, settle_target, window_target
from stiction.diagnosis.segment import judge_segment

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from stiction.diagnosis.segment import JudgedSegment
    from stiction.diagnosis.verdict.diagnosis import Diagnosis
    from stiction.records.record import LoopRecord

    Judge = Callable[[JudgedSegment, bool], Diagnosis]

__all__ = ["Judge", "diagnose_windows"]


def diagnose_windows(records: Sequence[LoopRecord], judge: Judge, *, methods: bool) -> Diagnosis:
    """Judge each window of the records by itself, and pool them.

    Parameters
    ----------
    records : sequence of LoopRecord
        Records of one loop in the order of time, none twice; see `order_records`.
    judge : callable
        Returns the diagnosis of a judged segment, with the published methods or without.
    methods : bool
        Whether the published methods are applied: to the window that stands for all.

    Returns
    -------
    Diagnosis
        That of the only window as it is, or the pooled one.
    """
    target, judged = window_target(records[0].dt), {}
    if not is_one_window(records[0]):
        target, judged = settle_target(records[0])
    pooled, elapsed_s = PooledWindows(), 0.0
    for number, record in enumerate(records):
        cuts = cut(record, target)
        single = len(records) == 1 and len(cuts) == 1
        if number:
            judged, elapsed_s = {}, _offset(records[0], record, elapsed_s)
        for one in cuts:
            segment = judged.pop(one.samples, None) or judge_segment(record, samples=one.samples)
            pooled.add(judge(segment, methods and single), elapsed_s + one.first * record.dt)
        elapsed_s += record.duration
    found = pooled.diagnose()
    if not methods or found.evidence or not found.loop_state.in_control:
        return found
    return replace(found, evidence=detect_all(found.segment.part, found.oscillation))


def _offset(first: LoopRecord, record: LoopRecord, elapsed_s: float) -> float:
    """Start of a record, from the first sample of the first one [s]; records without times follow one another."""
    if first.start is None or record.start is None:
        return elapsed_s
    return (record.start - first.start) / timedelta(seconds=1.0)
