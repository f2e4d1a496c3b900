"""One function for each cause: a loop and what moves it, or None where the loop drawn does not show the cause."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from calibration.populations.loads import SHAPES, lagged_noise, steps, wave
from calibration.populations.processes import draw_loop, gain_margin, scale_gain
from calibration.populations.scenario import Scenario, settle_limit_cycle, with_series
from calibration.populations.valves import deadband_valve, sticky_valve
from stiction.models import Kano, PhysicalValve
from stiction.records.quality.quantisation import robust_range

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from stiction.models import Loop, Valve

__all__ = [
    "DT",
    "PER_PERIOD",
    "SAMPLES",
    "SCENARIOS",
    "add_background",
    "add_sensor_fault",
    "sample_any_loop",
    "sample_recording",
    "share_at_limit",
    "start_near_limit",
]

DT = (0.5, 1.0, 1.0, 2.0, 5.0, 10.0, 30.0)
"""Sampling periods of the controllers [s]."""
PER_PERIOD = (8.0, 200.0)
"""Fewest and most samples of the record to a period [-]."""
SAMPLES = (500, 4000)
"""Shortest and longest record [samples]."""
MOVED = 0.25
"""Share of the sticky loops that a load or the set point moves, whether or not they cycle by themselves [-]."""
CYCLES = (6.0, 60.0)
"""Fewest and most periods of a record [-]."""


def stiction(rng: np.random.Generator) -> Scenario | None:
    """A valve that sticks: always or at times only, alone, with an oscillation from outside, or moved by a load."""
    moved = bool(rng.random() < MOVED)
    while True:  # not every loop drawn cycles, and giving up there would leave more of the moved ones
        dt = float(rng.choice(DT))
        valve, S, J = sticky_valve(rng, dt)
        if isinstance(valve, PhysicalValve):
            dt = min(dt, 2.0)
        if moved:
            return _moved(rng, sample_any_loop(rng, dt), valve, S, J)
        plan = _limit_cycle(rng, dt, valve, S, J)
        if plan is not None:
            break
    chance = rng.random()
    if chance < 0.15:
        ratio = float(rng.choice([rng.uniform(0.2, 0.45), rng.uniform(2.5, 8.0)]))
        outside = wave(rng, "sine", plan.n, plan.period * ratio) * S * float(rng.uniform(0.1, 0.4))
        return replace(with_series(plan, load=outside), kind=f"{plan.kind} and sine")
    if chance < 0.4 and isinstance(valve, Kano):
        share = float(rng.uniform(0.4, 0.7))
        first = plan.burn + int((plan.n - plan.burn) * (1.0 - share) * rng.random())
        sticks = np.zeros(plan.n, dtype=bool)
        sticks[first : first + int(share * (plan.n - plan.burn))] = True
        return replace(plan, kind="intermittent", sticks=sticks)
    return _set_point_moves(rng, plan) if chance < 0.5 else plan


def _moved(rng: np.random.Generator, loop: Loop, valve: Valve, S: float, J: float) -> Scenario:
    """A sticky valve whose loop a random load or set point moves, OP asked for little more than S; no cycle needed."""
    plan = _random_load(rng, loop)
    if rng.random() < 0.5:
        slow = lagged_noise(rng, plan.n, float(rng.uniform(20.0, 100.0)) * plan.every)
        gain = abs(complex(loop.process.at(2j * np.pi / (100.0 * loop.dt))))
        plan = replace(plan, load=0.1 * plan.load, random_load=0.1 * plan.random_load, sp=10.0 * gain * slow)
    asked = robust_range(plan.run().op)
    size = S / float(rng.uniform(0.3, 0.95)) / asked
    loads = {name: size * getattr(plan, name) for name in ("load", "sp")}
    return replace(
        plan, loop=replace(loop, valve=valve), kind=f"{type(valve).__name__}, moved by a load", S=S, J=J,
        random_load=size * plan.random_load, **loads,
    )  # fmt: skip


def deadband(rng: np.random.Generator) -> Scenario | None:
    """Play in the valve of an integrating process: the one place where it makes a cycle of its own."""
    dt = float(rng.choice(DT))
    return _limit_cycle(rng, dt, *deadband_valve(rng), kind="integrating")


def tight_tuning(rng: np.random.Generator) -> Scenario | None:
    """A gain just below the stability limit: rings for long after a kick, or is kept ringing by a random load."""
    loop = sample_any_loop(rng)
    found = gain_margin(loop)
    if found is None:
        return None
    kicked = bool(rng.random() < 0.5)
    loop = scale_gain(loop, found[0] * float(rng.uniform(0.97, 0.995) if kicked else rng.uniform(0.9, 0.98)))
    period = found[1] / loop.dt
    size = sample_recording(rng, period)
    if size is None:
        return None
    every, n = size
    plan = _plan(loop, n, "ringing" if kicked else "excited", every=every, period=period)
    if not kicked:
        load = float(rng.uniform(0.3, 1.5))
        return replace(plan, load=load * lagged_noise(rng, n, period / 4.0), random_load=load)
    plan.load[: max(int(period / 3.0), 5)] = float(rng.uniform(1.0, 4.0))
    pv = plan.run().pv
    assert pv is not None
    return plan if np.ptp(pv[-n // 3 :]) < np.ptp(pv[: n // 3]) else None


def external_disturbance(rng: np.random.Generator) -> Scenario | None:
    """An oscillation from outside: a load, a disturbance of the PV, or the set point of a cascade."""
    loop = sample_any_loop(rng)
    period = float(np.exp(rng.uniform(np.log(10.0), np.log(150.0))))
    every, n = sample_recording(rng, period) or (1, SAMPLES[0])
    shape = str(rng.choice(list(SHAPES), p=list(SHAPES.values())))
    series = wave(rng, shape, n, period, jitter=float(rng.choice([0.0, rng.uniform(0.0, 0.03)])))
    size = float(rng.uniform(1.0, 5.0))
    plan = _plan(loop, n, shape, every=every, period=period)
    where = rng.random()
    if where < 0.7:
        return add_background(rng, with_series(plan, load=size * series))
    size *= abs(complex(loop.process.at(2j * np.pi / (period * loop.dt))))
    if where < 0.85:
        return with_series(plan, pv_load=size * series)
    return replace(with_series(plan, sp=size * series), kind=f"{shape} of the set point")


def sensor(rng: np.random.Generator) -> Scenario | None:
    """A transmitter that is coarse, sticks, or has spikes, in a loop that a random load moves."""
    plan = _random_load(rng)
    kind = str(rng.choice(["coarse", "sticking", "spikes"], p=[0.45, 0.3, 0.25]))
    return replace(add_sensor_fault(rng, plan, kind, hit=(0.003, 0.02), high=(1.0, 4.0), step=(0.15, 0.5)), kind=kind)


def add_sensor_fault(
    rng: np.random.Generator,
    plan: Scenario,
    fault: str,
    *,
    hit: tuple[float, float],
    high: tuple[float, float],
    step: tuple[float, float],
) -> Scenario:
    """Give a loop a faulty transmitter.

    Parameters
    ----------
    rng : numpy.random.Generator
        What is drawn from.
    plan : Scenario
        The loop and what moves it.
    fault : str
        `spikes`; `coarse`, of few steps; or `sticking`, which hangs.
    hit, high : tuple of float
        Least and largest share of the samples with a spike, and size of spikes over the PV's swing [-].
    step : tuple of float
        Least and largest step of a coarse PV, or band in which one hangs, over the PV's swing [-].

    Returns
    -------
    Scenario
        The plan with it.
    """
    pv = plan.run().pv
    assert pv is not None
    swing = robust_range(pv)
    if fault == "spikes":
        there = rng.random(plan.n) < rng.uniform(*hit)
        size = swing * rng.uniform(*high) * rng.uniform(0.5, 1.0, plan.n) * rng.choice([-1.0, 1.0])
        return with_series(plan, pv_load=np.where(there, size, 0.0))
    width = swing * float(rng.uniform(*step))
    return replace(plan, sensor=(width, 0.0) if fault == "coarse" else (0.0, width))


def saturation(rng: np.random.Generator) -> Scenario | None:
    """A valve at a limit for part of the time, under an oscillating or a random load, with or without windup."""
    loop = sample_any_loop(rng)
    loop = replace(loop, controller=replace(loop.controller, anti_windup=bool(rng.random() < 0.5)))
    if rng.random() < 0.7:
        period = float(np.exp(rng.uniform(np.log(20.0), np.log(150.0))))
        every, n = sample_recording(rng, period) or (1, SAMPLES[0])
        shape = str(rng.choice(["sine", "triangle", "sawtooth"]))
        size = float(rng.uniform(5.0, 25.0))
        plan = _plan(loop, n, "undersized", every=every, period=period, load=size * wave(rng, shape, n, period, 0.02))
    else:
        plan = replace(_random_load(rng, loop, largest=12.0), kind="at the limit")
    plan = start_near_limit(rng, plan, (0.15, 0.45))
    op = plan.run().op
    fits = 2.0 < plan.op_start < 98.0 and 0.08 < share_at_limit(op) < 0.7 and np.ptp(op) > 2.0
    return replace(plan, kind=plan.kind if loop.controller.anti_windup else f"{plan.kind}, windup") if fits else None


def start_near_limit(rng: np.random.Generator, plan: Scenario, shares: tuple[float, float]) -> Scenario:
    """Begin a loop so near to a limit of OP that it comes there.

    Parameters
    ----------
    rng : numpy.random.Generator
        What is drawn from.
    plan : Scenario
        The loop and what moves it.
    shares : tuple of float
        Least and largest share of the samples in which OP would be beyond the limit, were there none [-].

    Returns
    -------
    Scenario
        The plan with another OP at the start, which may lie beyond a limit itself.
    """
    unlimited = replace(plan.loop.controller, op_limits=(-np.inf, np.inf))
    op = replace(plan, loop=replace(plan.loop, controller=unlimited)).run().op
    share = float(rng.uniform(*shares))
    high = bool(rng.random() < 0.5)
    limit = float(np.quantile(op, 1.0 - share if high else share))
    return replace(plan, op_start=plan.op_start - limit + (100.0 if high else 0.0))


def share_at_limit(op: NDArray[np.float64]) -> float:
    """Share of the samples with OP at 0 or 100 % [-]."""
    return float(np.mean((op >= 99.95) | (op <= 0.05)))


def none(rng: np.random.Generator) -> Scenario | None:
    """Nothing wrong: a random load, steps, a slow controller, a quiet loop, the slave of a cascade, one event."""
    kinds = {"load": 0.3, "steps": 0.15, "sluggish": 0.2, "quiet": 0.1, "cascade": 0.15, "event": 0.1}
    kind = str(rng.choice(list(kinds), p=list(kinds.values())))
    if kind == "load":
        return _random_load(rng)
    if kind == "quiet":
        return replace(_random_load(rng, largest=0.3), kind=kind)
    loop = sample_any_loop(rng)
    if kind == "event":
        return _event(rng, loop)
    if kind == "sluggish":
        loop = scale_gain(loop, float(rng.uniform(0.05, 0.3)))
        return replace(_random_load(rng, loop), kind=kind)
    plan = _random_load(rng, loop, largest=1.0)
    size = float(rng.uniform(2.0, 8.0)) * abs(complex(loop.process.at(2j * np.pi / (100.0 * loop.dt))))
    if kind == "steps":
        series = steps(rng, plan.n, float(rng.uniform(100.0, 400.0)) * plan.every)
    else:
        series = lagged_noise(rng, plan.n, float(rng.uniform(20.0, 100.0)) * plan.every) / 2.0
    return replace(with_series(plan, sp=size * series), kind=kind)


def _event(rng: np.random.Generator, loop: Loop) -> Scenario:
    """A quiet loop that one pulse or one step moves, of the load or of the set point."""
    plan = replace(_random_load(rng, loop, largest=0.1), kind="event")
    series = np.zeros(plan.n)
    first = int(plan.n * rng.uniform(0.0, 0.9))
    last = plan.n if rng.random() < 0.5 else first + plan.every * int(np.exp(rng.uniform(np.log(5.0), np.log(200.0))))
    series[first:last] = float(rng.choice([-1.0, 1.0])) * float(rng.uniform(2.0, 8.0))
    if rng.random() < 0.5:
        return with_series(plan, load=series)
    gain = abs(complex(loop.process.at(2j * np.pi / (100.0 * loop.dt))))
    return replace(with_series(plan, sp=gain * series), kind="event of the set point")


SCENARIOS: dict[str, Callable[[np.random.Generator], Scenario | None]] = {
    "stiction": stiction,
    "deadband": deadband,
    "tight tuning": tight_tuning,
    "external disturbance": external_disturbance,
    "sensor": sensor,
    "saturation": saturation,
    "none": none,
}
"""Cause -> how it is drawn."""


def sample_any_loop(rng: np.random.Generator, dt: float | None = None, kind: str | None = None) -> Loop:
    """Draw until there is a loop with a gain margin.

    Parameters
    ----------
    rng : numpy.random.Generator
        What is drawn from.
    dt : float, optional
        Sampling period of the controller [s]; by default one of `DT`.
    kind : str, optional
        Kind of process; by default any.

    Returns
    -------
    Loop
        With a good valve.
    """
    dt = float(rng.choice(DT)) if dt is None else dt
    while True:
        if (drawn := draw_loop(rng, dt, kind)) is not None:
            return drawn[0]


def _plan(loop: Loop, n: int, kind: str, **more: object) -> Scenario:
    return Scenario(loop, **{"sp": np.zeros(n), "load": np.zeros(n), "pv_load": np.zeros(n), "kind": kind, **more})  # type: ignore[arg-type]


def _limit_cycle(
    rng: np.random.Generator, dt: float, valve: Valve, S: float, J: float, kind: str | None = None
) -> Scenario | None:
    """A loop that the valve keeps oscillating; a load pulse starts it, and a background may move it."""
    loop = replace(sample_any_loop(rng, dt, kind), valve=valve)
    found = settle_limit_cycle(loop, rng, 0.7 * S)
    size = None if found is None else sample_recording(rng, found[0])
    if found is None or size is None:
        return None
    every, n = size
    burn = int(rng.choice([0, 1]) * 5 * found[0])
    plan = _plan(loop, n + burn, type(valve).__name__, every=every, period=found[0], burn=burn, S=S, J=J)
    plan.load[: max(int(found[0] / 3.0), 5)] = 0.7 * S
    return replace(add_background(rng, plan, 0.15 * S, 2.0 * S), op_start=float(rng.uniform(35.0, 65.0)))


def sample_recording(rng: np.random.Generator, period: float) -> tuple[int, int] | None:
    """Draw how often a loop is recorded and for how long.

    Parameters
    ----------
    rng : numpy.random.Generator
        What is drawn from.
    period : float
        Period of the oscillation [samples of the controller].

    Returns
    -------
    tuple of int or None
        Controller samples to one of the record, and in all of it; None where no record can show the period well.
    """
    few, many = PER_PERIOD
    fits = [m for m in range(1, 11) if few <= period / m <= many]
    if not fits:
        return None
    every = 1 if 1 in fits and rng.random() < 0.75 else int(rng.choice(fits))
    shortest, longest = (np.clip(cycles * period / every, *SAMPLES) for cycles in CYCLES)
    return every, every * int(np.exp(rng.uniform(np.log(shortest), np.log(longest))))


def _random_load(rng: np.random.Generator, loop: Loop | None = None, largest: float = 4.0) -> Scenario:
    """A loop that only a random load of up to `largest` [% of span] moves, at times with steps or a ramp."""
    loop = sample_any_loop(rng) if loop is None else loop
    every = int(rng.choice([1, 1, 1, 2, 5]))
    n = every * int(np.exp(rng.uniform(*np.log(SAMPLES))))
    load = largest * float(rng.uniform(0.3, 1.0))
    lag = float(np.exp(rng.uniform(np.log(2.0), np.log(60.0)))) * every
    plan = _plan(loop, n, "load", every=every, load=load * lagged_noise(rng, n, lag), random_load=load)
    if rng.random() < 0.3:
        return with_series(plan, load=load * steps(rng, n, 200.0 * every))
    return with_series(plan, load=load * np.linspace(0.0, rng.normal(), n)) if rng.random() < 0.3 else plan


def add_background(rng: np.random.Generator, plan: Scenario, largest: float = 0.5, drift: float = 2.0) -> Scenario:
    """Let what wanders move a loop too: a random load, in one of two, and a ramp, in one of three.

    Parameters
    ----------
    rng : numpy.random.Generator
        What is drawn from.
    plan : Scenario
        The loop and what moves it.
    largest : float
        Largest standard deviation of the load [% of span].
    drift : float
        Largest size of the ramp [% of span].

    Returns
    -------
    Scenario
        The plan with these.
    """
    if rng.random() < 0.5:
        load = largest * float(rng.random())
        lag = plan.period * float(rng.uniform(0.05, 0.5))
        plan = replace(with_series(plan, load=load * lagged_noise(rng, plan.n, lag)), random_load=load)
    if rng.random() < 0.33:
        plan = with_series(plan, load=np.linspace(0.0, drift * float(rng.uniform(-1.0, 1.0)), plan.n))
    return plan


def _set_point_moves(rng: np.random.Generator, plan: Scenario) -> Scenario:
    """The plan as slave of a slow cascade: the set point asks for OP moves of up to S."""
    slow = 2j * np.pi / (8.0 * plan.period * plan.loop.dt)
    size = plan.S * float(rng.uniform(0.2, 1.0)) * abs(complex(plan.loop.process.at(slow)))
    series = lagged_noise(rng, plan.n, 2.0 * plan.period)
    return replace(with_series(plan, sp=size / 2.0 * series), kind=f"{plan.kind}, moving set point")
