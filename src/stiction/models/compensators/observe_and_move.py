"""Common phases of two-move and four-move: observe a cycle, open the loop, move, settle, rest, close the loop."""

from __future__ import annotations

from stiction.models.compensators.component import CompensatorState
from stiction.models.numba_compile import inline_kernel

__all__ = ["observe_and_move", "signal_to_valve"]


@inline_kernel
def observe_and_move(
    op: float,
    sp: float,
    pv: float,
    position: float,
    s: CompensatorState,
    moves: float,
    band: float,
    move: float,
    cycles: float,
    tries: float,
) -> CompensatorState:
    """Advance the phase by a sample and pass `op` on; in phases above 0 the caller sets the signal.

    Phase 0, observation: a cycle begins when the error rises above the band after it was below it. The first cycle
    gives the swing of the OP. The next `cycles`, with lengths that differ by less than half, give the mean position.
    Phases 1, 2, ... `moves`: each lasts `move` samples, the last one cycle, while the process settles. Then the signal
    rests until the error leaves the band. A change of set point ends every phase. After `tries` successive moves that
    did not bring the error into the band, only a change of set point starts new moves.
    """
    error = sp - pv
    elapsed = s.elapsed + 1.0
    phase = s.phase
    side = s.side
    cycle_count = s.cycle_count
    samples = s.samples
    total = s.total
    low = s.low
    high = s.high
    failed_moves = s.failed_moves
    if sp != s.sp:
        phase, side, cycle_count, failed_moves = 0.0, 0.0, 0.0, 0.0
    elif phase > moves:
        if abs(error) > band:
            phase, side, cycle_count = 0.0, 0.0, 0.0
    elif phase == moves:
        if elapsed >= samples / cycles:
            phase = moves + 1.0
            failed_moves = failed_moves + 1.0 if abs(error) > band else 0.0
    elif phase > 0.0:
        if elapsed >= move:
            phase += 1.0
            elapsed = 0.0
    elif error > band:
        if side < 0.0:
            if cycle_count > 2.0:
                usual = (samples - elapsed) / (cycle_count - 2.0)
                if elapsed > 1.5 * usual or usual > 1.5 * elapsed:
                    cycle_count = 0.0
            cycle_count += 1.0
            elapsed = 0.0
        side = 1.0
    elif error < -band:
        side = -1.0
    if phase == 0.0:
        if cycle_count > cycles + 1.0 and failed_moves < tries:
            phase = 1.0
        else:
            if cycle_count <= 1.0 and elapsed == 0.0:
                low, high = op, op
            if cycle_count <= 2.0 and elapsed == 0.0:
                samples, total = 0.0, 0.0
            samples += 1.0
            total += position
            low = min(low, op)
            high = max(high, op)
    track = 0.0
    if phase > 0.0:
        track = 1.0
    return CompensatorState(
        op,
        0.0,
        track,
        op,
        sp,
        op,
        op,
        elapsed,
        phase,
        side,
        position,
        cycle_count,
        samples,
        total,
        low,
        high,
        failed_moves,
    )


@inline_kernel
def signal_to_valve(signal: float, position: float, s: CompensatorState) -> CompensatorState:
    """State `s` with `signal` to the valve in place of the controller output, and the expected stem `position`."""
    return CompensatorState(
        signal, 0.0, 1.0, s.op, s.sp, s.reference, s.latest, s.elapsed, s.phase, s.side, position, s.cycle_count,
        s.samples, s.total, s.low, s.high, s.failed_moves,
    )  # fmt: skip
