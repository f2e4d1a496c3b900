r"""Stairs too small to see singly in the noise, detected together by their regularity.

Stairs with the jump sj occur every sj of OP. Without its straight line such a stem is a saw-tooth, whose first harmonic
has the frequency rate / sj and the amplitude sj / pi (smaller after the lag of a sensor). If the largest peak of the
periodogram is clearly above the noise and its amplitude fits its frequency, it is a staircase.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.straight_line import fit_line

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.valvetests.ramp_split import OpRamp

__all__ = ["HiddenStairs", "find_hidden_stairs"]

MAX_FALSE_ALARM = 1e-3
"""Probability that noise alone gives such a peak in a ramp [-]."""
AMPLITUDE_RATIO_RANGE = (0.3, 1.6)
"""Smallest and largest amplitude of the peak over the amplitude of a saw-tooth with its period [-]."""
MIN_STAIRS = 3.0
"""Smallest number of stairs in a ramp [-]."""


@dataclass(frozen=True, slots=True)
class HiddenStairs:
    """A staircase detected by its regularity, and its mean line at two points."""

    jump: float
    """Jump sj [% of span of the OP]."""
    op: tuple[float, float]
    """OP at the two points [% of span]."""
    stem: tuple[float, float]
    """Mean line of the stem at these points [unit of the stem signal]."""


def find_hidden_stairs(
    ramp: OpRamp, time: NDArray[np.float64], stem: NDArray[np.float64], sigma: float, gain: float
) -> tuple[HiddenStairs | None, float]:
    """Search the part of a ramp after its first slip.

    `ramp`: the ramp of the OP. `time`, `stem`: times [s] and the stem signal after the first slip. `sigma`: noise of
    the stem signal [its unit]. `gain`: stem travel per OP [unit of the stem signal per % of span]. Returns the
    staircase, if there is one; smallest detectable jump [unit of the stem signal]; infinite for a short ramp.
    """
    n = time.size
    if n < 24:
        return None, math.inf
    dt = float(np.median(np.diff(time)))
    line = fit_line(time, stem)
    left = stem - line.at(time)
    size = 1 << (4 * n - 1).bit_length()
    power = np.abs(np.fft.rfft(left, size)) ** 2 / n
    frequency = np.fft.rfftfreq(size, dt)
    band = (frequency * n * dt >= MIN_STAIRS) & (frequency <= 0.25 / dt)
    needed = math.log(max(0.25 * n, 1.0) / MAX_FALSE_ALARM)
    smallest = math.pi * sigma * math.sqrt(4.0 * needed / n)
    k = int(np.flatnonzero(band)[np.argmax(power[band])])
    jump = abs(ramp.rate) / float(frequency[k])
    amplitude = 2.0 * math.sqrt(float(power[k]) / n)
    ratio = amplitude * math.pi / (jump * abs(gain))
    if power[k] < needed * sigma * sigma or not AMPLITUDE_RATIO_RANGE[0] <= ratio <= AMPLITUDE_RATIO_RANGE[1]:
        return None, smallest
    ends = time[n // 8], time[n - 1 - n // 8]
    reached = float(line.at(ends[0])), float(line.at(ends[1]))
    return HiddenStairs(jump, (ramp.line.at(ends[0]), ramp.line.at(ends[1])), reached), smallest
