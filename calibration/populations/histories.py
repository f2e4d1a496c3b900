"""Windows of a history of the first simulator."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from calibration.historian import apply_effect
from calibration.histories import REPAIRED_S, HistoryWindow
from calibration.loop_sets import MAX_EFFECT, STORED_EFFECTS
from calibration.populations.causes import DT, add_sensor_fault, sample_any_loop
from calibration.populations.draw import SHAKEN
from calibration.populations.loads import SHAPES, lagged_noise, steps, wave
from calibration.populations.processes import gain_margin, log_uniform, scale_gain
from calibration.populations.scenario import Scenario
from calibration.populations.valves import deadband_valve, sticky_valve
from stiction.models import Kano, PhysicalValve
from stiction.records.quality.quantisation import robust_range

if TYPE_CHECKING:
    from collections.abc import Iterator

    from calibration.histories import HistoryPlan
    from stiction.models import Loop, Valve
    from stiction.records import LoopRecord

__all__ = ["try_history"]

MAX_AT_LIMIT = 0.02
"""Largest share of the samples with OP at a limit [-]."""
MOVED = 0.35
"""Share of the windows of a valve with friction in which a random load moves it [-]."""
LONGEST_PERIOD = 200.0
"""Longest period at the limit of stability [samples]."""


def try_history(plan: HistoryPlan, rng: np.random.Generator) -> Iterator[HistoryWindow]:
    """Draw a loop and its windows, until one of them does not move or comes to a limit of OP.

    Parameters
    ----------
    plan : HistoryPlan
        What is wrong with the loop, and how it runs.
    rng : numpy.random.Generator
        What is drawn from.

    Yields
    ------
    HistoryWindow
        One window after the other.
    """
    dt = float(rng.choice(DT))
    S, J, valve = 0.0, 0.0, None
    if plan.sticky:
        valve, S, J = sticky_valve(rng, dt, "Kano" if plan.course != "constant" else None)
    elif plan.fault == "deadband":
        valve, S, J = deadband_valve(rng)
    loop = sample_any_loop(rng, min(dt, 2.0) if isinstance(valve, PhysicalValve) else dt)
    margin = gain_margin(loop)
    if margin is None or margin[1] / loop.dt > LONGEST_PERIOD:
        return
    if plan.fault.endswith("tight"):
        loop = scale_gain(loop, margin[0] * float(rng.uniform(0.8, 0.97)))
    period = margin[1] / loop.dt
    outside = _draw_wave(rng, plan, period)
    effect = str(rng.choice(STORED_EFFECTS)) if plan.stored else ""
    strength = MAX_EFFECT * float(rng.uniform(0.1, 1.0))
    kinds = ("level", "level", "pressure") if loop.process.den[-1] == 0.0 else ("flow", "pressure", "temperature")  # type: ignore[union-attr]
    loop_type, has_sp = str(rng.choice(kinds)), rng.random() > 0.15
    colour, share = float(rng.choice([0.0, 0.0, rng.uniform(1.0, 5.0)])), 0.2 * float(rng.random()) ** 2
    fault_kind, noise = str(rng.choice(["coarse", "sticking", "spikes"])), None
    for size in plan.shares:
        own = replace(loop, valve=_valve_of(rng, valve, S, J, float(size)))
        scenario = _draw_window(rng, own, plan, period, S, outside)
        clean = scenario.run()
        if not _sound(clean):
            return
        noise = _noise_level(clean, loop, share) if noise is None else noise
        if plan.fault == "sensor":
            scenario = add_sensor_fault(rng, scenario, fault_kind, hit=(0.003, 0.02), high=(1.0, 4.0), step=(0.15, 0.5))
        record = scenario.run(noise * float(rng.uniform(0.7, 1.4)) * lagged_noise(rng, scenario.n, colour))
        if not _sound(record):
            return
        record = replace(
            record, mv=None, loop_type=loop_type, integrating=bool(loop.process.den[-1] == 0.0),  # type: ignore[union-attr]
            sp=record.sp if has_sp else None,
        )  # fmt: skip
        if effect:
            stored = apply_effect(record, effect, strength, int(rng.integers(2**31)))
            record = stored if len(stored) >= 300 else record
        in_order = size == 0.0
        yield HistoryWindow(record, 0.0 if in_order else S * float(size), 0.0 if in_order else J * float(size))


def _valve_of(rng: np.random.Generator, valve: Valve | None, S: float, J: float, size: float) -> Valve:
    from stiction.models import Ideal

    if valve is None:
        return Ideal()
    if size == 1.0:
        return valve
    small = float(rng.uniform(*REPAIRED_S))
    return Kano(S * size, J * size) if size > 0.0 else Kano(small, small * float(rng.uniform(0.0, 0.5)))


def _noise_level(clean: LoopRecord, loop: Loop, share: float) -> float:
    """Standard deviation of the noise by the swings of a record without any [PV units]."""
    assert clean.pv is not None
    controller = loop.controller
    amplified = abs(controller.Kc) * (1.0 + (controller.N if controller.Td else 0.0))
    return min(share * robust_range(clean.pv), SHAKEN * robust_range(clean.op) / amplified)


def _draw_wave(rng: np.random.Generator, plan: HistoryPlan, period: float) -> tuple[str, float, float] | None:
    """Shape, size [% of span] and period [samples] of a wave from outside that never ends; None without one."""
    if not plan.fault.endswith("external"):
        return None
    return (
        str(rng.choice(list(SHAPES), p=list(SHAPES.values()))),
        log_uniform(rng, 1.0, 5.0),
        period * log_uniform(rng, 0.7, 8.0),
    )


def _draw_window(
    rng: np.random.Generator,
    loop: Loop,
    plan: HistoryPlan,
    period: float,
    S: float,
    outside: tuple[str, float, float] | None,
) -> Scenario:
    """Load, set point and operating point of one window: what moves the loops of `causes`, drawn anew."""
    burn = round(max(400.0, 5.0 * period))
    n = plan.samples + burn
    load, sp = np.zeros(n), np.zeros(n)
    gain = abs(complex(loop.process.at(2j * np.pi / (8.0 * period * loop.dt))))  # type: ignore[union-attr]
    size = S if S > 0.0 else float(rng.uniform(1.0, 4.0))
    moved = S == 0.0 or rng.random() < MOVED
    load[: max(int(period / 3.0), 5)] = 0.7 * S
    if moved:
        lag = period * float(rng.uniform(0.1, 2.0)) if S > 0.0 else log_uniform(rng, 2.0, 60.0)
        load = load + float(rng.uniform(0.3, 1.0)) * size * lagged_noise(rng, n, lag)
    elif rng.random() < 0.5:
        load = load + 0.15 * size * float(rng.random()) * lagged_noise(rng, n, period * float(rng.uniform(0.05, 0.5)))
    if rng.random() < 0.2:
        load = load + size * float(rng.uniform(0.2, 1.0)) * steps(rng, n, period * float(rng.uniform(5.0, 20.0)))
    if rng.random() < 0.3:
        load = load + np.linspace(0.0, 2.0 * size * float(rng.uniform(-1.0, 1.0)), n)
    if rng.random() < 0.2:
        sp = size * gain * float(rng.uniform(0.2, 1.0)) * steps(rng, n, period * float(rng.uniform(5.0, 20.0)))
    if outside is not None:
        shape, amplitude, every = outside
        load = load + amplitude * float(rng.uniform(0.6, 1.4)) * wave(
            rng, shape, n, every, float(rng.choice([0.0, 0.02]))
        )
    elif rng.random() < 0.15:
        shape = str(rng.choice(list(SHAPES), p=list(SHAPES.values())))
        load = load + size * float(rng.uniform(0.1, 0.4)) * wave(rng, shape, n, period * log_uniform(rng, 0.5, 8.0))
    return Scenario(
        loop, sp=sp, load=load, pv_load=np.zeros(n), kind="history", burn=burn, period=period,
        op_start=float(rng.uniform(35.0, 65.0)),
    )  # fmt: skip


def _sound(record: LoopRecord) -> bool:
    """Whether the loop moves and keeps off the limits of OP."""
    assert record.pv is not None
    if not (np.isfinite(record.pv).all() and np.ptp(record.pv) > 0.0 and np.ptp(record.op) > 0.01):
        return False
    return float(np.mean((record.op <= 0.1) | (record.op >= 99.9))) < MAX_AT_LIMIT
