"""One sample of a closed loop as an exported model: the order of work is that of `simulation.drivers.closed_loop`."""

from __future__ import annotations

import math
from typing import NamedTuple

from stiction.models.compensators.component import CompensatorState, compensator_at_rest
from stiction.models.component import ValveState  # noqa: TC001 - read by the translator
from stiction.models.controllers.pid import PIDState, pid_at_rest, pid_step
from stiction.models.dispatch import NO_COMPENSATOR, compensator_step, stem_position, valve_at_rest, valve_step
from stiction.simulation.drivers import process_output, process_step

__all__ = ["LoopState", "loop_start", "loop_step"]


class LoopState(NamedTuple):
    """State of a loop between two samples."""

    controller: PIDState
    """State of the controller."""
    compensator: CompensatorState
    """State of the compensator; not used without one."""
    valve: ValveState
    """State of the valve."""
    signal: float
    """Signal to the valve in the last sample [% of span]."""
    pv: float
    """Process variable [PV units]."""
    position: float
    """Stem position [% of span]."""
    older: float
    """Input of the process in the last sample, after its dead time [% of span]."""
    at: float
    """Place of the newest entry in the delay line [-]."""
    pv_start: float
    """Process variable at rest before the first sample [PV units]."""
    position_start: float
    """Stem position at rest before the first sample [% of span]."""


def loop_start(model, sp, pv, op, position, pid, p) -> LoopState:
    """A loop at rest before its first sample."""
    controller = pid_at_rest(op, pv, pid)
    compensator = compensator_at_rest(op, sp)
    valve = valve_at_rest(model, op, position, p)
    return LoopState(controller, compensator, valve, op, pv, position, 0.0, 0.0, pv, position)


def loop_step(
    kind, model, delay, direct, sp, load, pv_load, s: LoopState, pid, h, p, A, b_new, b_old, c, d, x, work, line
) -> LoopState:
    """One sample of a loop in automatic; `x` are the states of the process, `line` its inputs, the newest at `at`."""
    length = line.shape[0]
    at = int(s.at) + 1
    if at >= length:
        at = 0
    y = s.pv_start + process_output(c, x) + pv_load
    if d != 0.0:
        late = at - direct
        if late < 0:
            late = late + length
        y = y + d * line[late]
    compensator = s.compensator
    if kind == NO_COMPENSATOR:
        controller = pid_step(sp, y, s.controller, math.nan, pid)
        signal = controller.op
    else:
        holding = (pid[0], 0.0, pid[2], pid[3], pid[4], pid[5], pid[6], pid[7], pid[8], pid[9])
        tracked = s.signal if compensator.track != 0.0 else math.nan
        controller = pid_step(sp, y, s.controller, tracked, pid)
        if compensator.hold != 0.0:
            controller = pid_step(sp, y, s.controller, tracked, holding)
        compensator = compensator_step(kind, controller.op, sp, y, compensator, h)
        signal = min(max(compensator.valve_signal, pid[6]), pid[7])
    valve = valve_step(model, signal, s.valve, p)
    position = stem_position(valve, p)
    line[at] = position - s.position_start + load
    place = at - delay
    if place < 0:
        place = place + length
    newer = line[place]
    process_step(A, b_new, b_old, newer, s.older, x, work)
    return LoopState(
        controller, compensator, valve, signal, y, position, newer, float(at), s.pv_start, s.position_start
    )
