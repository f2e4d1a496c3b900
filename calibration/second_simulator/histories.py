"""Windows of a history of the second simulator; for validation only."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from calibration.histories import REPAIRED_S, HistoryWindow
from calibration.second_simulator import historian
from calibration.second_simulator.closed_loop import SUBSTEPS, Output, run_loop
from calibration.second_simulator.disturbances import background_load, wave_load
from calibration.second_simulator.processes import draw_process
from calibration.second_simulator.sample import (
    _discrete,
    _draw_controller,
    _draw_interval,
    _draw_noise,
    _draw_valve,
    _record,
)
from calibration.second_simulator.valve import measure_ramp_loop

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from calibration.histories import HistoryPlan

__all__ = ["try_history"]

MAX_AT_LIMIT = 0.02
"""Largest share of the samples with OP at a limit [-]."""
COARSE = (0.15, 0.4)
"""Step of a coarse transmitter over the swing of its PV [-]."""
MAX_EXECUTIONS = 60_000
"""Most executions of the controller in a window [-]."""
Signals = dict[str, "NDArray[np.float64]"]


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
    dt = float(rng.choice((1.0, 2.0, 5.0) if plan.stored else (1.0, 1.0, 2.0, 3.0, 5.0, 10.0)))
    process = draw_process(rng, dt)
    controller, period = _draw_controller(rng, process, dt, tight=plan.fault.endswith("tight"))
    cause = plan.fault if plan.fault in ("deadband", "sticky", "good") else "sticky" if plan.sticky else "good"
    valve = _draw_valve(rng, cause, dt)
    ramp = measure_ramp_loop(valve)
    if plan.sticky and not (ramp.S >= 1.0 and ramp.J >= 0.1 * ramp.S):
        return
    store, every = _draw_storage(rng, plan, dt, period)
    steps = plan.samples * every + round(6.0 * period / dt) + 100
    if steps > MAX_EXECUTIONS:
        return
    span, warm = period / dt, steps - plan.samples * every
    Ad, Bd = _discrete(process, dt / SUBSTEPS)
    delay = max(round(process.dead_time / dt * SUBSTEPS), 0)
    bend, level = float(rng.choice((0.0, 0.0, rng.uniform(-0.6, 0.6)))), _draw_noise(rng)
    outside = (span * _log_uniform(rng, 0.8, 10.0), _log_uniform(rng, 1.0, 12.0))
    form = int(rng.integers(2**31))
    for size in plan.shares:
        small = float(rng.uniform(*REPAIRED_S)) / ramp.S
        factor = float(size) if size > 0.0 else small
        own = valve._replace(static=valve.static * factor, coulomb=valve.coulomb * factor)
        load = _log_uniform(rng, 0.05, 2.0) * background_load(rng, steps, span * float(rng.uniform(0.2, 3.0)))
        if plan.fault.endswith("external"):
            load += (
                outside[1] * float(rng.uniform(0.6, 1.4)) * wave_load(np.random.default_rng(form), steps, outside[0])
            )
        elif rng.random() < 0.15:
            load += _log_uniform(rng, 0.2, 3.0) * wave_load(rng, steps, span * _log_uniform(rng, 0.8, 10.0))
        sp = np.zeros(steps)
        if rng.random() < 0.2:
            sp = np.clip(np.cumsum(rng.normal(size=steps) * (rng.random(steps) < 1.0 / (20.0 * span))), -8.0, 8.0)
        noise = rng.normal(size=steps) * level * float(rng.uniform(0.7, 1.4))
        begin = float(rng.uniform(35.0, 65.0))
        op, pv, _ = run_loop(
            tuple(controller), tuple(own), Ad, Bd, process.C[0].copy(), delay, dt, sp, load, noise, bend,
            float(rng.uniform(-1.0, 1.0)) * own.coulomb, tuple(Output(begin=begin)),
        )  # fmt: skip
        op, pv, sp = op[warm:], pv[warm:], sp[warm:]
        limited = float(np.mean((op <= 0.0) | (op >= 100.0)))
        if not np.abs(pv).max() < 60.0 or float(op.std()) < 1e-3 or limited > MAX_AT_LIMIT:
            return
        if plan.fault == "sensor":
            coarse = np.random.default_rng(form).uniform(*COARSE)
            pv = historian.quantise(pv, float(coarse) * float(np.ptp(pv)))
        signals = store({"op": op, "pv": pv, "sp": sp})
        record = _record(np.random.default_rng(form), signals, 0, process, dt * every)
        in_order = size == 0.0
        yield HistoryWindow(
            record,
            0.0 if in_order else ramp.S * factor,
            0.0 if in_order or (not plan.sticky and plan.fault != "deadband") else ramp.J * factor,
        )


def _draw_storage(
    rng: np.random.Generator, plan: HistoryPlan, dt: float, period: float
) -> tuple[Callable[[Signals], Signals], int]:
    """What a historian does to each window, and the executions to one stored sample."""
    mode = str(rng.choice(historian.MODES)) if plan.stored else "raw"
    every = _draw_interval(rng, dt, period, mode)
    share, step = float(rng.uniform(0.02, 0.2)), float(rng.choice((0.01, 0.02, 0.05, 0.1)))

    def store(signals: Signals) -> Signals:
        if mode in ("average", "hold"):
            return {name: historian.store_slower(x, every, average=mode == "average") for name, x in signals.items()}
        if mode == "quantised":
            return signals | {name: historian.quantise(signals[name], step) for name in ("op", "pv")}
        if mode in ("exception", "swinging_door"):
            keep = historian.store_by_exception if mode == "exception" else historian.store_by_swinging_door
            return signals | {
                name: keep(signals[name], share * float(signals[name].std()), 60) for name in ("op", "pv")
            }
        return signals

    return store, every


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
