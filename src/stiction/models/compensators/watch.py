"""Watch a cycle, open the loop, move, settle, rest; and close the loop again: what two-move and four-move share."""

from __future__ import annotations

from stiction.models.compensators.component import CompensatorState
from stiction.models.compiled import inlined

__all__ = ["sent", "watch_and_move"]


@inlined
def watch_and_move(
    op: float,
    sp: float,
    pv: float,
    position: float,
    s: CompensatorState,
    moves: float,
    band: float,
    cycles: float,
    move: float,
) -> CompensatorState:
    """Advance the phase by a sample and pass `op` on; the page says what is sent in the phases above 0.

    0 watch: a cycle begins where the error rises above the band after it lay below it. After `cycles` cycles of
    lengths that differ by less than half, 1, 2, ... `moves`: each holds for `move` samples, the last for one cycle,
    while the process settles. Then rest, until the error leaves the band. A change of set point ends every phase.
    """
    error = sp - pv
    count = s.count + 1.0
    phase = s.phase
    side = s.side
    begun = s.begun
    samples = s.samples
    total = s.total
    low = s.low
    high = s.high
    if sp != s.sp or (phase > moves and abs(error) > band):
        phase = 0.0
        side = 0.0
        begun = 0.0
    elif phase > 0.0:
        wait = move
        if phase == moves:
            wait = samples / cycles
        if phase <= moves and count >= wait:
            phase += 1.0
            count = 0.0
    elif error > band:
        if side < 0.0:
            if begun > 1.0:
                usual = (samples - count) / (begun - 1.0)
                if count > 1.5 * usual or usual > 1.5 * count:
                    begun = 0.0
            begun += 1.0
            count = 0.0
        side = 1.0
    elif error < -band:
        side = -1.0
    if phase == 0.0:
        if begun > cycles:
            phase = 1.0
        elif begun == 1.0 and count == 0.0:
            samples, total, low, high = 0.0, 0.0, op, op
        if begun > 0.0 and phase == 0.0:
            samples += 1.0
            total += position
            low = min(low, op)
            high = max(high, op)
    track = 0.0
    if phase > 0.0:
        track = 1.0
    return CompensatorState(
        op, 0.0, track, op, sp, op, op, count, phase, side, position, begun, samples, total, low, high
    )


@inlined
def sent(signal: float, position: float, s: CompensatorState) -> CompensatorState:
    """State `s` with the `signal` that is sent instead of the controller's, and where the stem is thought to go."""
    return CompensatorState(
        signal, 0.0, 1.0, s.op, s.sp, s.reference, s.latest, s.count, s.phase, s.side, position, s.begun, s.samples,
        s.total, s.low, s.high,
    )  # fmt: skip
