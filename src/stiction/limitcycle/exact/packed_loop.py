"""Packing and unpacking for `simulate_events`: one loop in continuous time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from stiction.errors import ParameterError
from stiction.limitcycle.continuous_form import ContinuousValve, require_continuous_form
from stiction.limitcycle.exact.event_simulation import TERMS, ContinuousLoop, RunLimits, RunSpace, simulate_events
from stiction.limitcycle.linear import LinearPart, linear_part
from stiction.models.loop import require_loop

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.models import Loop

__all__ = ["EventRun", "PackedLoop", "pack_loop"]


@dataclass(frozen=True)
class EventRun:
    """Result of one run of the loop; times in seconds, all signals in deviations."""

    status: int
    """Reason of the end: one of the codes of `simulate_events`."""
    time: NDArray[np.float64]
    """Time of each rest at the top [s], shape (n_turns,)."""
    level: NDArray[np.float64]
    """Stem position there [% of span], shape (n_turns,)."""
    states: NDArray[np.float64]
    """States of the linear part there, shape (n_turns, n)."""
    swing: NDArray[np.float64]
    """OP high, OP low, PV high, PV low, times followed, slips of the swing before, wait of the turn [s]."""
    events: NDArray[np.float64]
    """Time [s] and level [% of span] of every rest, shape (n_events, 2)."""
    turns: int
    """Oscillations after which the motion repeated; 0 when it did not settle."""


@dataclass(frozen=True, eq=False)
class PackedLoop:
    """A loop packed for the simulation in continuous time."""

    linear: LinearPart
    """Linear part of the loop."""
    valve: ContinuousValve
    """Valve of the loop."""
    unit: float
    """Longest step of the series [s]."""
    packed: ContinuousLoop
    """The loop as `simulate_events` takes it."""
    scale: NDArray[np.float64]
    """States over balanced states, shape (n,)."""

    @property
    def has_lattice(self) -> bool:
        """Whether the stem can only rest and jump, so that cycles form families over the offset of its levels.

        This also holds for a valve that follows when every slip reverses its input immediately: the OP has no dead
        time, and its slope changes with a jump of the stem.
        """
        if self.valve.jump <= 0.0:
            return False
        B, C = self.linear.B, self.linear.C
        answers = abs(float(C @ B)) > 1e-12 * float(np.abs(C) @ np.abs(B))
        return self.valve.rate > 0.0 or (self.linear.dead_time == 0.0 and answers)

    def without_following(self) -> PackedLoop:
        """The same loop with a stem that never follows and keeps its rest levels while it settles."""
        valve = self.valve._replace(rate=math.inf)
        return PackedLoop(self.linear, valve, self.unit, self.packed._replace(rate=math.inf), self.scale)

    @property
    def memory(self) -> int:
        """Number of series stored for the dead time."""
        return 64 + 8 * math.ceil(self.linear.dead_time / self.unit)

    def run(
        self, z, x: float, *, up: float = 1.0, most_turns: int = 200, most_steps: int = 200_000,
        tolerance: float = 1e-11, loads=((0.0, 0.0),), n_events: int = 0, grid=None,
    ) -> tuple[EventRun, NDArray[np.float64]]:  # fmt: skip
        """Run from rest at `x` [% of span] with states `z` (n,); `grid` asks for stem, OP and PV at these times [s].

        Returns the run and the signals, shape (3, n_grid); OP and PV are those before the dead time.
        """
        n = self.linear.order
        turns, states = np.empty((most_turns + 1, 9)), np.empty((most_turns + 1, n))
        events = np.empty((n_events, 2))
        wanted = np.empty(0) if grid is None else np.asarray(grid, dtype=float) / self.unit
        signals = np.full((3, wanted.size), np.nan)
        times = np.array([time for time, _ in loads]) / self.unit
        size = self.memory
        status, k, n_ev, _, period = cast("Any", simulate_events)(
            self.packed, times, np.array([float(value) for _, value in loads]), np.asarray(z) / self.scale, float(x),
            up, RunLimits(most_turns, most_steps, tolerance),
            RunSpace(np.empty(size), np.empty((size, TERMS)), turns, states, events, wanted, *signals),
        )  # fmt: skip
        turns, states = turns[:k], states[:k] * self.scale
        swing = turns[:, 2:].copy()
        swing[:, 6] *= self.unit
        events = events[:n_ev] * [self.unit, 1.0]
        return EventRun(status, turns[:, 0] * self.unit, turns[:, 1], states, swing, events, period), signals


def pack_loop(loop: Loop, *, sp: float = 0.0, disturbance: float = 0.0) -> PackedLoop:
    """Pack a loop for the simulation in continuous time.

    Raises ParameterError when the valve has no continuous-time form, its band is zero, or controller and process make
    an algebraic loop.
    """
    require_loop(loop)
    valve = require_continuous_form(loop.valve)
    linear = linear_part(loop, sp=sp, disturbance=disturbance)
    if valve.sb <= 0.0:
        raise ParameterError(
            f"{loop.valve!r} has no stiction: the loop is linear and has no limit cycle of its own. Give a valve that "
            "sticks."
        )
    return _pack(linear, valve)


def _pack(linear: LinearPart, valve: ContinuousValve) -> PackedLoop:
    if linear.D != 0.0 and linear.dead_time == 0.0:
        raise ParameterError(
            "the OP would jump together with the stem (an algebraic loop of derivative or proportional action "
            "and a process of too low an order); give the derivative a filter, or the process a lag or a dead time."
        )
    A, B, C, C_pv, scale = linear.A, linear.B, linear.C, linear.C_pv, np.ones(linear.order)
    if linear.order:
        from scipy.linalg import matrix_balance

        A, (scale, _) = matrix_balance(A, permute=False, separate=True)
        B, C, C_pv = B / scale, C * scale, C_pv * scale
    speed = min(np.linalg.norm(A, 2), np.linalg.norm(A, 1)) if linear.order else 0.0
    if linear.dead_time == 0.0 and not valve.staircase:
        closed = A + np.outer(B, C)
        speed = max(speed, min(np.linalg.norm(closed, 2), np.linalg.norm(closed, 1)))
    if speed == 0.0:
        speed = 1.0 / linear.dead_time if linear.dead_time else 1.0
    unit = 0.5 / float(speed)
    packed = ContinuousLoop(
        A=np.ascontiguousarray(A * unit), B=B * unit, C=np.ascontiguousarray(C), D=linear.D,
        C_pv=np.ascontiguousarray(C_pv), D_pv=linear.D_pv, delay=linear.dead_time / unit, sb=valve.sb, lag=valve.lag,
        rate=valve.rate * unit,
    )  # fmt: skip
    return PackedLoop(linear, valve, unit, packed, scale)
