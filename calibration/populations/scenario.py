"""What a loop is put through for its record, and the run itself."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import nan
from typing import TYPE_CHECKING

import numpy as np

from calibration.populations.time_varying_loop import changing_loop
from stiction.models import Kano, PhysicalValve
from stiction.records.record import LoopRecord, Provenance
from stiction.simulation.closed_loop import simulate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.models import Loop

__all__ = ["PV_START", "Scenario", "settle_limit_cycle"]

PV_START = 50.0
"""PV and SP at the start [PV units]."""
SETTLING = 4000
"""Samples in which a limit cycle must settle."""


@dataclass(frozen=True)
class Scenario:
    """A loop and all that moves it; series are deviations, shape (n_samples,)."""

    loop: Loop
    """The loop, without measurement noise."""
    sp: NDArray[np.float64]
    """Set point from its start [PV units]."""
    load: NDArray[np.float64]
    """Load at the process inlet [% of span]."""
    pv_load: NDArray[np.float64]
    """Disturbance at the process output [PV units]."""
    kind: str
    """How the cause shows."""
    burn: int = 0
    """Samples before the record starts."""
    every: int = 1
    """Samples of the controller to one of the record."""
    period: float = nan
    """Period of the oscillation [samples of the controller]."""
    S: float = 0.0
    """Deadband plus stickband [% of span]."""
    J: float = 0.0
    """Slip jump [% of span]."""
    random_load: float = 0.0
    """Standard deviation of the random part of the load [% of span]."""
    op_start: float = 50.0
    """OP at the start [% of span]."""
    sensor: tuple[float, float] = (0.0, 0.0)
    """Resolution and dead band of the transmitter [PV units]."""
    sticks: NDArray[np.bool_] | None = None
    """Where the valve sticks, when it does not always."""

    @property
    def n(self) -> int:
        """Samples of the controller, those before the record included."""
        return self.load.size

    def run(self, noise: NDArray[np.float64] | float = 0.0) -> LoopRecord:
        """Simulate at the controller's sampling, `noise` added to the PV; those samples before the record left out."""
        sp, pv_load = PV_START + self.sp, self.pv_load + noise
        if self.sticks is None and self.sensor == (0.0, 0.0):
            record = simulate(
                self.loop, sp, self.n * self.loop.dt, self.load, pv_disturbance=pv_load,
                pv_start=PV_START, op_start=self.op_start, mv_start=_rest(self.loop, self.op_start),
            )  # fmt: skip
            return record.window(self.burn, self.n)
        found = self.loop.discrete
        valve = self.loop.valve
        S, J = (valve.S, valve.J) if isinstance(valve, Kano) else (0.0, 0.0)
        sticks = S * (np.ones(self.n) if self.sticks is None else self.sticks)
        pv, op, mv = np.empty((3, self.n))
        changing_loop(
            self.loop.controller.pack(self.loop.dt), sticks, J / S if S else 0.0, found.A, found.b_new, found.b_old,
            found.c, found.delay, self.sensor, sp, self.load, pv_load, (PV_START, self.op_start), pv, op, mv,
        )  # fmt: skip
        origin = Provenance(source="simulation", rows=self.n)
        record = LoopRecord("simulated", self.loop.dt, op=op, pv=pv, sp=sp, mv=mv, provenance=origin)
        return record.window(self.burn, self.n)


def settle_limit_cycle(loop: Loop, rng: np.random.Generator, kick: float) -> tuple[float, float] | None:
    """Period [samples] and PV swing [PV units] of the limit cycle that a load of `kick` [% of span] starts, if any."""
    load = np.zeros(SETTLING)
    load[: int(rng.integers(10, 60))] = kick
    record = simulate(
        loop, PV_START, SETTLING * loop.dt, load, pv_start=PV_START, op_start=50.0, mv_start=_rest(loop, 50.0)
    )
    assert record.pv is not None
    op, pv = record.op[SETTLING // 2 :], record.pv[SETTLING // 2 :]
    centred = op - op.mean()
    rises = np.flatnonzero((centred[:-1] < 0.0) & (centred[1:] >= 0.0))
    if rises.size < 4 or op.max() >= 99.0 or op.min() <= 1.0 or np.ptp(op) < 0.02:
        return None
    last = np.array_split(op, 3)
    if np.ptp(last[2]) < 0.9 * np.ptp(last[0]):
        return None
    return float(np.diff(rises).mean()), float(np.ptp(pv))


def _rest(loop: Loop, op: float) -> float:
    """Where the stem rests, friction aside [% of span]."""
    valve = loop.valve
    return valve.gain * (op - valve.offset) if isinstance(valve, PhysicalValve) else op


def with_series(plan: Scenario, **changes: NDArray[np.float64]) -> Scenario:
    """The plan with series added to those it has."""
    return replace(plan, **{name: getattr(plan, name) + x for name, x in changes.items()})
