"""Motion of the stem in one ramp: rests, slips and following, from its segmentation."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.valvetests.hidden_stairs import HiddenStairs, find_hidden_stairs
from stiction.valvetests.segmentation import Segment, segment_penalty, segment_signal

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.valvetests.ramp_split import OpRamp

__all__ = ["Following", "Slip", "StemMoves", "classify_segments"]

MAX_REST_SLOPE = 0.25
"""Slope over the expected slope below which a line is a rest [-]."""
MIN_REST_SHARE = 0.4
"""Input travel of a rest over the jump before it, below which it is not a rest [-]."""
MIN_CLEAR_RATIO = 3.0
"""Jump over the smallest visible stair below which stairs are also detected by their regularity [-]."""
RISE_SHARE = 0.865
"""Share of a slip after two time constants of a lag, 1 - exp(-2) [-]."""
MIN_SLIP_SLOPE = 3.0
"""Slope over the expected slope above which a line is part of a slip [-]."""


@dataclass(frozen=True, slots=True)
class Slip:
    """The stem broke loose."""

    time: float
    """Time of the slip [s]."""
    op: float
    """OP at the slip [% of span]."""
    before: float
    """Stem at rest before [unit of the stem signal]."""
    after: float
    """Stem right after the jump [unit of the stem signal]."""
    stuck: float
    """Time of the next rest [s]; NaN when the stem followed."""
    rise: float
    """Time from the last sample at rest to the first that shows `PASSED` of the slip [s]."""


@dataclass(frozen=True, slots=True)
class Following:
    """The stem moved with its input."""

    start: float
    """Start [s]."""
    end: float
    """End [s]."""
    op_start: float
    """OP at the start [% of span]."""
    op_end: float
    """OP at the end [% of span]."""
    stem_start: float
    """Stem at the start [unit of the stem signal]."""
    stem_end: float
    """Stem at the end [unit of the stem signal]."""
    then_rest: bool
    """Whether it came to rest within the ramp."""


@dataclass(frozen=True, slots=True)
class StemMoves:
    """Slips and following in one ramp."""

    slips: tuple[Slip, ...]
    """Every slip, in order."""
    follows: tuple[Following, ...]
    """Every period of following, in order."""
    rest_travel: float
    """OP travel while the stem rested after its first slip [% of span]."""
    smallest_stair: float
    """Smallest visible stair [unit of the stem signal]."""
    lead: float
    """Largest OP travel while the stem rested before any slip [% of span]."""
    hidden: HiddenStairs | None
    """Stairs detected by their regularity; then `slips` has the first slip only and `follows` is empty."""


@dataclass(slots=True)
class _Run:
    rest: bool
    piece: Segment


def classify_segments(
    ramp: OpRamp, time: NDArray[np.float64], stem: NDArray[np.float64], sigma: float, rounding: float, gain: float
) -> StemMoves:
    """Slips and following of the stem in one ramp.

    Parameters
    ----------
    ramp : OpRamp
        The ramp of the OP.
    time, stem : ndarray, shape (n_ramp,)
        Times [s] and the stem signal within the ramp.
    sigma : float
        Noise of the stem signal [its unit].
    rounding : float
        Step to which the stem signal is rounded [its unit].
    gain : float
        Expected stem travel per OP [unit of the stem signal per % of span].

    Returns
    -------
    Moves
    """
    expected = gain * ramp.rate
    least = max(1.6 * rounding, 0.02 * abs(gain))
    dt = float(np.median(np.diff(time)))
    runs = _drop_transients(
        _join_segments(segment_signal(time, stem, sigma), expected, least, sigma), abs(expected), dt
    )
    heading = math.copysign(1.0, expected)
    slips: list[Slip] = []
    follows: list[Following] = []
    rest_travel = 0.0
    for k, run in enumerate(runs):
        start, end = run.piece.start, run.piece.end
        before = runs[k - 1] if k else None
        if before is not None and before.rest:
            when = before.piece.end + 0.5 * dt
            after = run.piece.level if run.rest else run.piece.at(when)
            stuck = start if run.rest else math.nan
            if heading * (after - before.piece.level) > (0.0 if run.rest else -math.inf):
                rise = _rise(time, stem, before.piece, run.piece)
                slips.append(Slip(when, ramp.line.at(when), before.piece.level, after, stuck, rise))
        if run.rest and slips:
            rest_travel += abs(ramp.rate) * (end - start + dt)
        if not run.rest:
            stops = k + 1 < len(runs)
            op = ramp.line.at(start), ramp.line.at(end)
            follows.append(Following(start, end, *op, run.piece.at(start), run.piece.at(end), stops))
    visible_stair = (12.0 * segment_penalty(time.size) * sigma * sigma * abs(expected) * dt) ** (1.0 / 3.0)
    lead = abs(ramp.rate) * (runs[0].piece.end - runs[0].piece.start) if runs and runs[0].rest else 0.0
    followed = sum(abs(follow.op_end - follow.op_start) for follow in follows)
    typical = float(np.median([abs(slip.after - slip.before) for slip in slips])) if slips else 0.0
    if slips and (followed > 0.4 * (followed + rest_travel) or typical < MIN_CLEAR_RATIO * visible_stair):
        later = time > slips[0].time
        hidden, regular = find_hidden_stairs(ramp, time[later], stem[later], sigma, gain)
        visible_stair = min(visible_stair, regular)
        travel = abs(ramp.rate) * float(time[-1] - slips[0].time)
        all_visible = hidden is not None and abs(travel / hidden.jump + 0.5 - len(slips)) < 1.0 and not follows
        if hidden is not None and not all_visible:
            first = replace(slips[0], after=slips[0].before + gain * hidden.jump, stuck=math.nan)
            return StemMoves((first,), (), travel, max(visible_stair, least), lead, hidden)
    return StemMoves(tuple(slips), tuple(follows), rest_travel, max(visible_stair, least), lead, None)


def _rise(time: NDArray[np.float64], stem: NDArray[np.float64], left: Segment, reached: Segment) -> float:
    """Time [s] from the rest `left` until the stem has moved `RISE_SHARE` of the way to the segment `reached`."""
    later = slice(left.last, reached.last)
    goal = reached.level + reached.slope * (time[later] - 0.5 * (reached.start + reached.end)) - left.level
    there = (stem[later] - left.level) * np.sign(goal) >= RISE_SHARE * np.abs(goal)
    when = float(time[later][np.argmax(there)]) if there.any() else reached.start
    return when - left.end


def _join_segments(pieces: list[Segment], expected: float, least: float, sigma: float) -> list[_Run]:
    """Rests and periods of following; parts of slips are dropped, and equal neighbours are joined."""
    runs: list[_Run] = []
    for k, piece in enumerate(pieces):
        ratio = piece.slope / expected
        rest = abs(ratio) < MAX_REST_SLOPE
        if not rest and (ratio > MIN_SLIP_SLOPE or ratio < 0.0 or (piece.n <= 4 and 0 < k < len(pieces) - 1)):
            continue
        before = runs[-1] if runs else None
        if before is not None and before.rest == rest:
            jump = piece.at(piece.start) - before.piece.at(before.piece.end)
            doubt = 3.0 * sigma * math.sqrt(1.0 / piece.n + 1.0 / before.piece.n)
            if not rest or jump * math.copysign(1.0, expected) < max(least, doubt):
                runs[-1] = _Run(rest, _join(before.piece, piece, rest))
                continue
        runs.append(_Run(rest, piece))
    return runs


def _drop_transients(runs: list[_Run], speed: float, dt: float) -> list[_Run]:
    """Drop segments between two rests that are too short for a rest or for following: a slip after a lag.

    After a slip the input has to travel as far as the stem jumped before it slips again.
    """
    settled: list[_Run] = []
    for k, run in enumerate(runs):
        before = settled[-1] if settled else None
        if before is not None and before.rest and k + 1 < len(runs) and (run.rest or runs[k + 1].rest):
            reached = run if run.rest else runs[k + 1]
            left = runs[k - 1].piece
            jump = abs(reached.piece.level - left.at(left.end))
            if speed * (run.piece.end - run.piece.start + dt) < MIN_REST_SHARE * jump:
                continue
        settled.append(run)
    return settled


def _join(a: Segment, b: Segment, rest: bool) -> Segment:
    if rest:
        level = (a.level * a.n + b.level * b.n) / (a.n + b.n)
        return Segment(a.first, b.last, a.start, b.end, level, 0.0)
    slope = (b.at(b.end) - a.at(a.start)) / (b.end - a.start)
    return Segment(a.first, b.last, a.start, b.end, 0.5 * (a.at(a.start) + b.at(b.end)), slope)
