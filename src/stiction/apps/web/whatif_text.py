"""Sentences of the what-if screen."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.display.duration_format import format_seconds
from stiction.display.number_format import format_number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from stiction.apps.web.whatif_settings import WhatIfSettings
    from stiction.models import Loop
    from stiction.simulation.swing import Swing

__all__ = ["describe_cycles", "describe_trend"]

RUNAWAY = 1e6
"""OP above which an unlimited loop has run away [% of span]."""
REST_AMPLITUDE = 0.01
"""Amplitude of OP up to which the loop is said to rest [% of span]."""


def describe_trend(
    settings: WhatIfSettings, op_swing: Swing, pv_swing: Swing, op: NDArray[np.float64], pv: NDArray[np.float64]
) -> str:
    """Say what the simulated loop does.

    `op_swing`, `pv_swing`: how OP [% of span] and PV [PV units] swing. `op`, `pv`: the part that is shown. Returns one
    to three sentences.
    """
    if not np.isfinite(op).all() or float(np.abs(op).max()) > RUNAWAY:
        return "The simulated loop is unstable: OP and PV grow without end. Lower the controller gain."
    at_limit = np.mean((op <= settings.op_low) | (op >= settings.op_high))
    if at_limit > 0.999:
        end = settings.op_high if op[-1] >= settings.op_high else settings.op_low
        return (
            f"OP stays at its limit of {end:g} %, so PV is not controlled. Check the sign of the controller "
            "gain against that of the process."
        )
    if op_swing.amplitude <= REST_AMPLITUDE + 4.0 * settings.noise * abs(settings.Kc):
        error = float(np.mean(pv)) - settings.sp
        away = format_number(abs(error), significant=3)
        where = (
            "at the set point" if abs(error) < 1e-3 * max(abs(settings.gain), 1e-12) else f"{away} from the set point"
        )
        return f"The simulated loop comes to rest: OP stays at {op_swing.middle:.4g} %, PV {where}."
    every = f" with a period of {format_seconds(op_swing.period)}" if math.isfinite(op_swing.period) else ""
    text = (
        f"The simulated loop oscillates{every}: OP amplitude {format_number(op_swing.amplitude, '%', 3)}, "
        f"PV amplitude {format_number(pv_swing.amplitude, significant=3)}."
    )
    if not every:
        text += " Less than two periods are shown: lengthen the time shown."
    if at_limit > 0.0:
        text += f" OP is at a limit during {100.0 * at_limit:.0f} % of the time."
    return text


def describe_cycles(settings: WhatIfSettings, loop: Loop, cycles: Sequence[Mapping[str, Any]]) -> str:
    """Say which limit cycles are predicted.

    `settings`: what the screen shows. `loop`: the loop without its compensator. `cycles`: the cycles, as
    `predict_cycles` returns them. Returns one to three sentences.
    """
    from stiction.limitcycle.predict import explain_no_cycle

    stable = [row for row in cycles if row["kind"] == "cycle" and row["stable"]]
    without = "Without the compensator: " if settings.compensator != "none" else ""
    if not cycles:
        return without + explain_no_cycle(loop)
    if not stable:
        count = sum(row["kind"] == "cycle" for row in cycles)
        text = f"no stable limit cycle is predicted, and {count} unstable: smaller oscillations die out."
    elif len(stable) == 1:
        text = f"one stable limit cycle is predicted: {_numbers(stable[0])}."
    else:
        largest = max(stable, key=lambda row: row["amplitude_op"])
        text = f"{len(stable)} stable limit cycles are predicted; the largest: {_numbers(largest)}. "
        text += "A disturbance can move the loop from one to another."
    if settings.op_low > -1e3 and any(row["amplitude_op"] > _room(settings) for row in stable):
        text += " The prediction leaves out the limits of OP, which the largest cycle exceeds."
    if settings.noise > 0.0:
        text += " The prediction is for the loop without noise."
    return without + text if without else text[0].upper() + text[1:]


def _numbers(row: Mapping[str, Any]) -> str:
    """Period and amplitudes of a cycle in words."""
    op, pv = (format_number(row[name], significant=3) for name in ("amplitude_op", "amplitude_pv"))
    return f"period {format_seconds(row['period_s'])}, OP amplitude {op} %, PV amplitude {pv}"


def _room(settings: WhatIfSettings) -> float:
    """Distance from the mean OP to its nearer limit [% of span]."""
    return min(settings.op - settings.op_low, settings.op_high - settings.op)
