"""Sentences of the textbook screen."""

from __future__ import annotations

import cmath
import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.duration_format import format_seconds
from stiction.display.number_format import count_noun, format_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.apps.web.textbook_settings import TextbookSettings
    from stiction.limitcycle import LimitCycle
    from stiction.models import Loop
    from stiction.simulation.swing import Swing

__all__ = ["describe_crossings", "describe_jump", "describe_ramp", "describe_sine"]

MIN_JUMP = 0.01
"""Movement in a sample from which a stem that breaks loose jumps [% of span]."""
MAX_PERIOD_CHANGE = 0.05
"""Relative change of the period up to which a loop is in the same limit cycle [-]."""


def describe_ramp(position: NDArray[np.float64]) -> str:
    """Say how a stem moves on a rising ramp, from its positions of shape (n_samples,)."""
    from stiction.paper.fig2 import find_slips

    if position[-1] == position[0]:
        return "The stem does not move: the ramp is too small to overcome the static friction."
    starts, slips = find_slips(position)
    first = position[starts[0] + 1] - position[starts[0]]
    if slips.size > 1:
        return f"The stem goes in stairs of {format_number(float(np.median(slips)), significant=2)} %."
    if starts[0] == 0:
        return "The stem follows OP."
    if first < MIN_JUMP:
        return "The stem sticks, breaks loose and follows."
    return f"The stem sticks, jumps by {format_number(float(first), significant=2)} % and follows."


def describe_sine(amplitude: float, N: complex) -> str:
    """Say what N(A) is at an amplitude [% of span]."""
    if N == 0.0:
        return f"At A = {amplitude:.3g} % the stem does not move: N = 0."
    lag = -math.degrees(cmath.phase(N))
    return (
        f"At A = {amplitude:.3g} % the fundamental of the stem has {100.0 * abs(N):.0f} % of the amplitude of OP and "
        f"lags it by {lag:.0f} degrees: N = {N.real:.3f} {'-' if N.imag < 0.0 else '+'} {abs(N.imag):.3f}j."
    )


def describe_crossings(loop: Loop, cycles: Sequence[LimitCycle]) -> str:
    """Say which limit cycles the Nyquist plot predicts."""
    from stiction.limitcycle.predict import explain_no_cycle

    if not cycles:
        return explain_no_cycle(loop)
    stable = [cycle for cycle in cycles if cycle.kind == "cycle" and cycle.stable]
    if not stable:
        return "The curves cross, but no limit cycle is stable: smaller oscillations die out, larger ones grow."
    periods = ", ".join(format_seconds((cycle.exact or cycle).period) for cycle in stable)
    return f"{count_noun(len(stable), 'stable limit cycle')}, of period {periods}."


def describe_jump(settings: TextbookSettings, swings: Sequence[Swing], levels: Sequence[int]) -> str:
    """Say whether the pulse moved the loop, from the swing of OP and the rest levels of the stem before and after."""
    before, after = swings
    pulse = f"A pulse of {settings.pulse:.3g} % for {settings.length:.3g} s"
    was = f"period {format_seconds(before.period)}, {levels[0]} rest levels"
    if not math.isfinite(after.period):
        return f"{pulse} stops the oscillation ({was})."
    now = f"period {format_seconds(after.period)}, {levels[1]} rest levels"
    if levels[0] == levels[1] and abs(after.period / before.period - 1.0) < MAX_PERIOD_CHANGE:
        return f"{pulse} does not move the loop: it returns to its limit cycle ({was})."
    return f"{pulse} moves the loop from one limit cycle ({was}) to another ({now})."
