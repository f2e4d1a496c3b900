"""S, deadband, resolution and the travel on a reversal, from the steps with a response."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.valvetests.result import Estimate
from stiction.valvetests.step_result import BandReading, Step

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = [
    "NoResponse",
    "band_readings",
    "deadband_only",
    "find_no_response",
    "median_estimate",
    "step_rounded_estimate",
]


class NoResponse(NamedTuple):
    """OP travel without a response."""

    travel: float
    """The travel [% of span]."""
    sure: float
    """Lower bound of S from this travel, with allowance for noise [% of span]."""
    hidden: float
    """OP travel of the smallest response visible above the noise [% of span]."""


def band_readings(steps: Sequence[Step]) -> tuple[BandReading, ...]:
    """Read the travel on a reversal or the resolution wherever a response followed an earlier one."""
    table: list[BandReading] = []
    last: Step | None = None
    turn = math.nan
    for k, step in enumerate(steps):
        size = step.op_after - step.op_before
        before = steps[k - 1] if k else None
        if before is not None and (before.op_after - before.op_before) * size < 0.0:
            turn = step.op_before
        if not step.responded:
            continue
        if last is not None:
            onwards = (last.op_after - last.op_before) * size > 0.0
            turned = not math.isnan(turn)
            whole = abs(step.op_after - last.op_after)
            if onwards != turned:
                kind = "resolution" if onwards else "reversal"
                reading = whole if onwards else abs(step.op_after - turn)
                heading = 1 if size > 0.0 else -1
                table.append(BandReading(kind, step.stem_before, heading, reading, whole, abs(size)))
        last, turn = step, math.nan
    return tuple(table)


def step_rounded_estimate(values: Sequence[float], readings: Sequence[BandReading]) -> Estimate:
    """Average the readings made with the finest steps; the interval is the rounding up to a step."""
    if not readings:
        return Estimate()
    finest = min(reading.step for reading in readings)
    chosen = np.array([v for v, r in zip(values, readings, strict=True) if r.step <= 1.001 * finest])
    spread = float(chosen.std(ddof=1)) if chosen.size > 1 else math.nan
    low = max(float(chosen.min()) - finest, 0.0)
    return Estimate(float(chosen.mean()), low, float(chosen.max()), spread, int(chosen.size))


def median_estimate(values: Sequence[float]) -> Estimate:
    """Median of the finite values, and the range that holds 95 % of them."""
    finite = np.array([value for value in values if math.isfinite(value)])
    if finite.size == 0:
        return Estimate()
    low, high = np.quantile(finite, (0.025, 0.975)) if finite.size > 2 else (math.nan, math.nan)
    spread = float(finite.std(ddof=1)) if finite.size > 1 else math.nan
    return Estimate(float(np.median(finite)), float(low), float(high), spread, int(finite.size))


def deadband_only(steps: Sequence[Step], is_position: bool, S: Estimate, resolution: Estimate) -> Estimate:
    """Deadband without stickband, S - J [% of span].

    OP that a reversing step loses, against steps onwards that each moved the stem; where no step tells, the difference
    of `S` and the `resolution`, both rounded up to a step.
    """
    lost = _lost_motion(steps, is_position)
    if lost.known or not (S.known and resolution.known):
        return lost
    value = max(S.value - resolution.value, 0.0)
    low, high = max(S.low - resolution.high, 0.0), max(S.high - resolution.low, 0.0)
    return Estimate(value, low, high, n=min(S.n, resolution.n))


def _lost_motion(steps: Sequence[Step], is_position: bool) -> Estimate:
    moved = [(a, b) for a, b in pairwise(steps) if a.responded and b.responded]
    gains = [(b.stem_after - b.stem_before) / (b.op_after - b.op_before) for _, b in moved if not b.reversal]
    if not gains and not is_position:
        return Estimate()
    gain = float(np.median(gains)) if gains else 1.0
    turned = [b for _, b in moved if b.reversal]
    lost = [abs(b.op_after - b.op_before) - abs(b.stem_after - b.stem_before) / abs(gain) for b in turned]
    return median_estimate(lost)


def find_no_response(steps: Sequence[Step], smallest: float, is_position: bool) -> NoResponse:
    """Find the OP travel without an answer that needs the largest S.

    A stem that answered rests until OP has gone S back or J, which is no more, onwards. Before any answer it is not
    known where in its band of S + J it rests, and half of the travel is sure. `smallest` is the smallest response that
    is visible [unit of the stem]; a flow's gain is at least that of the whole test.
    """
    op_range = float(np.ptp([steps[0].op_before, *(step.op_after for step in steps)]))
    stem_range = float(np.ptp([steps[0].stem_before, *(step.stem_after for step in steps)]))
    per_stem = 1.0 if is_position else op_range / (stem_range or 1.0)
    hidden = per_stem * smallest
    longest = NoResponse(0.0, 0.0, hidden)
    op, stem, answered = [steps[0].op_before], [steps[0].stem_before], False
    for step in steps:
        if step.responded:
            op, stem, answered = [], [], True
        op.append(step.op_after)
        stem.append(step.stem_after)
        travel = float(np.abs(np.subtract(op, op[0])).max() if answered else np.ptp(op))
        sure = (1.0 if answered else 0.5) * (travel - per_stem * float(np.ptp(stem)) - hidden)
        if sure > longest.sure:
            longest = NoResponse(travel, sure, hidden)
    return longest
