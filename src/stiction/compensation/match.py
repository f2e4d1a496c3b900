"""A twin brought nearer to its record, where the point identified does not cycle as the loop does.

A Kano valve scales: (S, J) -> (c S, c J) leaves the period of its cycle and takes every amplitude times c. The period
therefore asks for another J / S, dead time or gain, and then the amplitudes for S.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from stiction.compensation.cycle import cycle_of, distance
from stiction.compensation.exchange import exchange
from stiction.models import Kano, TransferFunction

if TYPE_CHECKING:
    from stiction.compensation.cycle import Cycle
    from stiction.compensation.surroundings import Surroundings
    from stiction.models import Loop

__all__ = ["bring_nearer"]

DEAD_TIMES, RATIOS, GAINS = (1.0, 0.85, 1.15, 0.7, 1.3), (1.0, 0.75, 1.25), (1.0, 0.9, 1.1)
"""Factors tried on the dead time, on J / S and on the gain [-]."""
PERIOD_OFF, SCALES = 0.15, (0.75, 1.35)
"""Relative error of the period up to which the amplitudes are scaled, and how far S may be scaled [-]."""
SEEDS, PRICE = 2, 0.2
"""Runs for each trial, and what a change costs against a better match, per unit of logarithm [-]."""


def bring_nearer(
    loop: Loop, sp: float, op: float, around: Surroundings | None, measured: Cycle
) -> tuple[Loop, list[str]] | None:
    """Change dead time, J / S and gain until the period matches, and S until the amplitudes do.

    Parameters
    ----------
    loop : Loop
        The twin as identified, a Kano valve before a transfer function.
    sp, op : float
        Operating point [PV units, % of span].
    around : Surroundings, optional
        What moves the loop from outside.
    measured : Cycle
        The record's.

    Returns
    -------
    tuple or None
        The nearest loop and what was changed, in words; None where no change brings the period near.
    """
    valve, process = loop.valve, loop.process
    assert isinstance(valve, Kano)
    assert isinstance(process, TransferFunction)
    best, least = None, float("inf")
    for longer, ratio, gain in product(DEAD_TIMES, RATIOS, GAINS):
        J = min(valve.J * ratio, valve.S)
        trial = replace(
            loop,
            process=replace(process, num=process.num * gain, dead_time=process.dead_time * longer),
            valve=Kano(valve.S, J),
        )
        seen, _, _ = cycle_of(trial, sp, op, measured.period, around, SEEDS)
        if not abs(seen.period / measured.period - 1.0) < PERIOD_OFF:
            continue
        by_op, by_pv = measured.amplitude_op / seen.amplitude_op, measured.amplitude_pv / seen.amplitude_pv
        scale = float(np.sqrt(by_op * by_pv))
        if not SCALES[0] <= scale <= SCALES[1]:
            continue
        trial = exchange(trial, valve=Kano(valve.S * scale, J * scale))
        seen, _, _ = cycle_of(trial, sp, op, measured.period, around, SEEDS)
        off = distance(measured, seen) + PRICE * float(np.abs(np.log([longer, ratio, gain, scale])).sum())
        if off < least:
            changed = {"dead time": longer, "J / S": J / valve.J if valve.J else 1.0, "gain": gain, "S": scale}
            told = [f"{name} times {factor:.2f}" for name, factor in changed.items() if abs(factor - 1.0) > 0.005]
            best, least = (trial, told), off
    return best
