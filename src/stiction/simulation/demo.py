"""A small simulated plant with known faults: nine loops, four of them with sticky valves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.models import FOPDT, PID, SOPDT, Ideal, Integrating, Kano, Loop
from stiction.simulation.closed_loop import simulate
from stiction.simulation.input_signals import random_walk

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.models import TransferFunction, Valve
    from stiction.records.record import LoopRecord

__all__ = ["DemoLoop", "demo_plant"]

_START = datetime(2026, 3, 2, 6, 0)
_BURN_IN_SHARE = 0.25
"""Simulated time before the record over the length of the record [-]."""

LoadFunction = Callable[["NDArray[Any]"], "NDArray[Any]"]


@dataclass(frozen=True)
class DemoLoop:
    """A loop of the demo plant: its record and its true fault."""

    record: LoopRecord
    """SP, PV and OP; the stem position stays hidden."""
    cause: str
    """Cause of the fault: stiction, deadband, tight tuning, external disturbance, sensor, none."""
    story: str
    """Description of the fault in a few words."""
    S: float
    """Deadband plus stickband of the valve [% of span]."""
    J: float
    """Slip jump of the valve [% of span]."""


@dataclass(frozen=True)
class _Loop:
    """One loop of the plant: engineering units, seconds, % of span."""

    tag: str
    loop_type: str
    cause: str
    story: str
    process: TransferFunction
    controller: PID
    sp: float
    valve: Valve = field(default_factory=Ideal)
    dt: float = 1.0
    hours: float = 1.0
    noise: float = 0.0
    """Measurement noise [PV units]."""
    drift: float = 0.0
    """Standard deviation of the change of the random load over one second [% of span]."""
    external_load: LoadFunction | None = None
    """External load over time [% of span]."""
    resolution: float = 0.0
    """Resolution of the transmitter [PV units]."""
    sp_step: float = 0.0
    """Step of the set point over the second third of the record [PV units]."""


def demo_plant(seed: int = 1) -> tuple[DemoLoop, ...]:
    """Simulate the demo plant.

    `seed`: seed of noise and load. Returns nine loops: sticky valves of three strengths and one on a level, a loop
    tuned too tightly, one with an external disturbance, one with a coarse transmitter, a healthy one, and a level loop
    whose valve has deadband only.

    Every controller is a PI controller with a usual tuning (lambda or SIMC), except the one that is tuned too tightly.
    Every load varies randomly. Noise is 0.1 to 0.5 % of the reading, and OP is recorded to 0.01 %.

    Examples
    --------
    >>> plant = demo_plant()
    >>> len(plant), plant[0].record.tag, plant[0].cause
    (9, 'FIC-101', 'stiction')
    """
    return tuple(_run(row, 1000 * seed + k) for k, row in enumerate(_plant()))


def _plant() -> tuple[_Loop, ...]:
    return (
        _Loop(
            "FIC-101", "flow", "stiction", "valve sticks badly",
            FOPDT(1.2, 4.0, 2.0), PID(0.42, 6.0), 62.0, Kano(6.0, 3.0), noise=0.15, drift=0.02,
        ),
        _Loop(
            "PIC-102", "pressure", "stiction", "valve sticks",
            FOPDT(0.12, 25.0, 5.0), PID(7.0, 25.0), 7.4, Kano(3.0, 1.5), dt=2.0, hours=2.0, noise=0.008, drift=0.01,
        ),
        _Loop(
            "FIC-103", "flow", "stiction", "valve sticks slightly",
            FOPDT(2.4, 3.0, 1.5), PID(0.21, 5.0), 118.0, Kano(1.2, 0.7), noise=0.12, drift=0.004,
        ),
        _Loop(
            "LIC-104", "level", "stiction", "valve of a level loop sticks",
            Integrating(0.004, 8.0), PID(3.0, 240.0), 55.0, Kano(4.0, 2.0), dt=10.0, hours=12.0,
            noise=0.06, drift=0.006,
        ),
        _Loop(
            "TIC-105", "temperature", "tight tuning", "gain too high, valve good",
            SOPDT(0.9, 150.0, 40.0, 25.0), PID(6.3, 150.0), 184.0, dt=5.0, hours=6.0, noise=0.1, drift=0.06,
        ),
        _Loop(
            "FIC-106", "flow", "external disturbance", "supply pressure swings, valve good",
            FOPDT(1.5, 4.0, 2.0), PID(0.33, 6.0), 75.0, noise=0.12, drift=0.01, sp_step=0.7,
            external_load=lambda t: 3.0 * np.sin(2.0 * np.pi * t / 95.0),
        ),
        _Loop(
            "TIC-107", "temperature", "sensor", "transmitter reports in steps of 0.5, valve good",
            FOPDT(0.8, 90.0, 15.0), PID(3.75, 90.0), 92.0, dt=5.0, hours=6.0, noise=0.05, drift=0.08, resolution=0.5,
        ),
        _Loop(
            "FIC-108", "flow", "none", "healthy",
            FOPDT(1.8, 5.0, 2.0), PID(0.35, 6.0), 88.0, noise=0.2, drift=0.08,
        ),
        _Loop(
            "LIC-109", "level", "deadband", "linkage has play, valve does not stick",
            Integrating(0.005, 6.0), PID(3.0, 200.0), 48.0, Kano(3.0, 0.0), dt=10.0, hours=12.0,
            noise=0.05, drift=0.006,
        ),
    )  # fmt: skip


def _run(row: _Loop, seed: int) -> DemoLoop:
    duration = row.hours * 3600.0
    before = round(_BURN_IN_SHARE * duration / row.dt)
    n = before + round(duration / row.dt)
    whole = n * row.dt
    load = random_walk(0.0, row.drift, whole, row.dt, seed=seed)
    load = load - float(load.mean())
    if row.external_load is not None:
        load = load + row.external_load(np.arange(n) * row.dt)
    controller = replace(row.controller, op_limits=(0.0, 100.0))
    loop = Loop(controller, row.valve, row.process, row.dt, noise=row.noise)
    sp = np.full(n, row.sp)
    sp[before + (n - before) // 3 : before + 2 * (n - before) // 3] += row.sp_step
    run = simulate(loop, sp, whole, load, seed, pv_start=row.sp, op_start=50.0, tag=row.tag, loop_type=row.loop_type)
    recorded = run.window(before, n)
    assert recorded.pv is not None
    pv = row.resolution * np.round(recorded.pv / row.resolution) if row.resolution else recorded.pv
    record = replace(recorded, pv=pv, op=np.round(recorded.op, 2), mv=None, start=_START)
    S, J = (row.valve.S, row.valve.J) if isinstance(row.valve, Kano) else (0.0, 0.0)
    return DemoLoop(record, row.cause, row.story, S, J)
