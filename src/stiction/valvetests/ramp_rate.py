"""Behaviour of the stem in each ramp, and the range of the rate r."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.number_format import count_noun
from stiction.valvetests.result import Behaviour, Ramp

if TYPE_CHECKING:
    from stiction.valvetests.friction_fit import FrictionFit
    from stiction.valvetests.ramp_split import OpRamp
    from stiction.valvetests.stem_moves import StemMoves

__all__ = ["bracket_rate", "classify_ramps"]

MIN_MAJORITY_SHARE = 0.65
"""Share of the OP travel after the first slip above which a behaviour is assigned [-]."""


def classify_ramps(
    ramps: tuple[OpRamp, ...], moves: tuple[StemMoves, ...], fit: FrictionFit | None
) -> tuple[Ramp, ...]:
    """Classify the motion of the stem in each ramp."""
    slope = abs(fit.slope) if fit else 1.0
    jump = abs(fit.sj.value) if fit else 0.0
    table: list[Ramp] = []
    n = 0
    for ramp, moved in zip(ramps, moves, strict=True):
        behaviour, reason = _behaviour(moved, slope, jump)
        sb = sj = math.nan
        count = len(moved.slips)
        if fit is not None and count:
            here = slice(n, n + count)
            sb, sj = float(np.mean(fit.stick_bands[here])), float(np.mean(fit.jumps[here]))
        n += count
        smallest = slope * moved.smallest_stair
        line = ramp.line
        table.append(
            Ramp(
                line.start,
                line.end,
                ramp.rate,
                ramp.op_start,
                ramp.op_end,
                behaviour,
                count,
                sb=sb,
                sj=sj,
                smallest_stair=smallest,
                reason=reason,
            )
        )
    return tuple(table)


def _behaviour(moved: StemMoves, slope: float, jump: float) -> tuple[Behaviour, str]:
    if not moved.slips and not moved.follows:
        return "did not slip", f"the stem rested over {moved.lead:.3g} % of OP travel"
    if moved.hidden:
        return "staircase", f"stairs of {moved.hidden.jump:.2g} %, detected by their regularity"
    followed = sum(abs(follow.op_end - follow.op_start) for follow in moved.follows)
    rested = moved.rest_travel
    smallest = slope * moved.smallest_stair
    if followed + rested < smallest:
        return "cannot tell", "the stem broke loose only at the end of the ramp"
    share = followed / (followed + rested)
    if share >= MIN_MAJORITY_SHARE:
        if smallest > jump > 0.5 * smallest:
            return "cannot tell", f"stairs of {jump:.2g} % would be too small to see (smallest {smallest:.2g} %)"
        if followed < 0.5 * jump:
            return "cannot tell", "the stem broke loose only at the end of the ramp"
        return "follow", f"it moved with the OP over {share:.0%} of the travel after its first slip"
    if share <= 1.0 - MIN_MAJORITY_SHARE:
        slips = count_noun(len(moved.slips), "slip")
        return "staircase", f"{slips} with rests over {1 - share:.0%} of the travel between"
    return "mixed", f"it followed over {share:.0%} of the travel after its first slip and rested over the remainder"


def bracket_rate(ramps: tuple[Ramp, ...]) -> tuple[float, float, bool]:
    """(fastest staircase rate, slowest followed rate, whether they contradict each other) [% of span / s]."""
    stairs = [abs(ramp.rate) for ramp in ramps if ramp.behaviour == "staircase"]
    follows = [abs(ramp.rate) for ramp in ramps if ramp.behaviour == "follow"]
    low = max(stairs, default=math.nan)
    high = min(follows, default=math.nan)
    if low >= high:
        return high, low, True
    return low, high, False
