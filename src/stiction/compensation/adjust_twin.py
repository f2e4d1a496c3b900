"""Adjust a twin that does not oscillate like its record.

With a Kano valve, (S, J) -> (c S, c J) keeps the period of the limit cycle and multiplies every amplitude by c. So J
/ S, dead time and gain are changed until the period matches, then S until the amplitudes match.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from stiction.compensation.cycle_measurement import cycle_distance, simulate_cycle
from stiction.compensation.replace_parts import replace_parts
from stiction.models import Kano, TransferFunction

if TYPE_CHECKING:
    from stiction.compensation.cycle_measurement import Cycle
    from stiction.compensation.external_inputs import ExternalInputs
    from stiction.models import Loop

__all__ = ["adjust_twin"]

DEAD_TIME_FACTORS, JUMP_RATIO_FACTORS, GAIN_FACTORS = (1.0, 0.85, 1.15, 0.7, 1.3), (1.0, 0.75, 1.25), (1.0, 0.9, 1.1)
"""Factors on dead time, J / S and gain that are tried [-]."""
MAX_PERIOD_ERROR, S_FACTOR_RANGE = 0.15, (0.75, 1.35)
"""Largest relative error of the period, and smallest and largest factor on S [-]."""
ADJUSTMENT_SEEDS, CHANGE_PENALTY = 2, 0.2
"""Runs for each combination, and penalty on the logarithm of a factor [-]."""


def adjust_twin(
    loop: Loop, sp: float, op: float, inputs: ExternalInputs | None, measured: Cycle
) -> tuple[Loop, list[str]] | None:
    """Change dead time, J / S and gain until the period matches, and S until the amplitudes do.

    `loop`: the twin as identified: a Kano valve and a transfer function. `sp`, `op`: operating point [PV units, % of
    span]. `inputs`: disturbances and set point changes. `measured`: oscillation of the record. Returns the loop closest
    to the record and the list of changes as text; None when no change makes the period match.
    """
    valve, process = loop.valve, loop.process
    assert isinstance(valve, Kano)
    assert isinstance(process, TransferFunction)
    best, least = None, float("inf")
    for longer, ratio, gain in product(DEAD_TIME_FACTORS, JUMP_RATIO_FACTORS, GAIN_FACTORS):
        J = min(valve.J * ratio, valve.S)
        trial = replace(
            loop,
            process=replace(process, num=process.num * gain, dead_time=process.dead_time * longer),
            valve=Kano(valve.S, J),
        )
        seen, _, _ = simulate_cycle(trial, sp, op, measured.period, inputs, ADJUSTMENT_SEEDS)
        if not abs(seen.period / measured.period - 1.0) < MAX_PERIOD_ERROR:
            continue
        by_op, by_pv = measured.amplitude_op / seen.amplitude_op, measured.amplitude_pv / seen.amplitude_pv
        scale = float(np.sqrt(by_op * by_pv))
        if not S_FACTOR_RANGE[0] <= scale <= S_FACTOR_RANGE[1]:
            continue
        trial = replace_parts(trial, valve=Kano(valve.S * scale, J * scale))
        seen, _, _ = simulate_cycle(trial, sp, op, measured.period, inputs, ADJUSTMENT_SEEDS)
        off = cycle_distance(measured, seen) + CHANGE_PENALTY * float(
            np.abs(np.log([longer, ratio, gain, scale])).sum()
        )
        if off < least:
            changed = {"dead time": longer, "J / S": J / valve.J if valve.J else 1.0, "gain": gain, "S": scale}
            changes = [f"{name} times {factor:.2f}" for name, factor in changed.items() if abs(factor - 1.0) > 0.005]
            best, least = (trial, changes), off
    return best
