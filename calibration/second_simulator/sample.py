"""Draw one loop from a seed: what stands in it, its record, and the truth about its valve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from calibration.second_simulator import historian
from calibration.second_simulator.closed_loop import SUBSTEPS, Output, run_loop
from calibration.second_simulator.controllers import ERROR_SQUARED, FORMS, GAP, ISA_PID, Controller
from calibration.second_simulator.disturbances import background_load, wave_load
from calibration.second_simulator.processes import Process, draw_process, ultimate_point
from calibration.second_simulator.valve import ValveParameters, measure_ramp_loop
from stiction.records import LoopRecord

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["CAUSES", "SimulatedLoop", "Truth", "sample_loop"]

CAUSES = {
    "good": 0.19, "tight": 0.14, "external": 0.20, "deadband": 0.12,
    "sticky": 0.21, "sticky_external": 0.08, "sticky_tight": 0.06,
}  # fmt: skip
"""Share of each cause [-]."""
WARM_UP_PERIODS = 6.0
"""Ultimate periods of the loop before its record begins [-]."""
MIN_REVERSALS = 6
"""Times that a valve with friction turns round in its record, else the loop is drawn anew [-]."""
MAX_ATTEMPTS = 100
"""Draws after which a seed is given up [-]."""
MIN_STICKY_S = 1.0
"""Width of the ramp loop from which a valve sticks [% of span]."""
MIN_JUMP_SHARE = 0.1
"""Slip jump over S from which a valve sticks and does not merely have a deadband [-]."""
MAX_STEPS = 120_000
"""Executions of the controller in a record at most [-]."""
MAX_LIMIT_SHARE = 0.3
"""Share of the record with OP at 0 or 100 % beyond which the loop is not in control [-]."""


class Truth(NamedTuple):
    """What is true of a simulated loop."""

    sticky: bool
    """Whether the valve sticks and jumps: S of at least 1 %, and not a deadband alone."""
    S: float
    """Width of the slow-ramp loop of OP and position [% of span]."""
    J: float
    """Slip jump in that ramp [% of span]."""
    cause: str
    """One of `CAUSES`."""
    in_control: bool
    """Whether OP is off its limits over most of the record."""


@dataclass(frozen=True, slots=True)
class SimulatedLoop:
    """A record and the truth about it."""

    record: LoopRecord
    """The record, as the controller saw it or as a historian stored it."""
    truth: Truth
    """What is true."""
    storage: str
    """`raw`, or one of `historian.MODES`."""
    process: str
    """Kind of the process."""
    controller: str
    """Form of the controller."""


def sample_loop(seed: int) -> SimulatedLoop:
    """Draw one loop.

    Parameters
    ----------
    seed : int
        Seed of the loop; the same seed gives the same loop.

    Returns
    -------
    SimulatedLoop
        Record and truth.

    Examples
    --------
    >>> loop = sample_loop(1)
    >>> loop.record == sample_loop(1).record, 1000 <= len(loop.record) <= 4000
    (True, True)
    """
    cause = str(np.random.default_rng([46, seed]).choice(list(CAUSES), p=list(CAUSES.values())))
    for attempt in range(MAX_ATTEMPTS):
        loop = _try_loop(np.random.default_rng([47, seed, attempt]), seed, cause)
        if loop is not None:
            return loop
    raise RuntimeError(f"Seed {seed} gives no moving valve in {MAX_ATTEMPTS} attempts; use another seed.")


def _try_loop(rng: np.random.Generator, seed: int, cause: str) -> SimulatedLoop | None:
    """One attempt; None where the valve is not what the cause says, hardly moves, or the loop runs away."""
    stored = bool(rng.random() < 0.5)
    dt = float(rng.choice((1.0, 2.0, 5.0) if stored else (1.0, 1.0, 2.0, 3.0, 5.0, 10.0)))
    process = draw_process(rng, dt)
    controller, period = _draw_controller(rng, process, dt, tight=cause.endswith("tight"))
    valve = _draw_valve(rng, cause, dt)
    mode = str(rng.choice(historian.MODES)) if stored else "raw"
    every = _draw_interval(rng, dt, period, mode)
    n = min(int(rng.integers(1000, 4001)), max(MAX_STEPS // every, 1000))
    warm = int(WARM_UP_PERIODS * period / dt) + 100
    steps = n * every + warm
    sp = _set_point(rng, steps, period / dt)
    load, noise = _draw_load(rng, cause, steps, period / dt), rng.normal(size=steps) * _draw_noise(rng)
    Ad, Bd = _discrete(process, dt / SUBSTEPS)
    start = float(rng.uniform(-1.0, 1.0)) * valve.coulomb
    delay = max(round(process.dead_time / dt * SUBSTEPS), 0)
    bend = float(rng.choice((0.0, 0.0, rng.uniform(-0.6, 0.6))))
    op, pv, stem = run_loop(
        tuple(controller),
        tuple(valve),
        Ad,
        Bd,
        process.C[0].copy(),
        delay,
        dt,
        sp,
        load,
        noise,
        bend,
        start,
        tuple(Output()),
    )
    op, pv, stem, sp = op[warm:], pv[warm:], stem[warm:], sp[warm:]
    if not np.abs(pv).max() < 60.0 or float(op.std()) < 1e-3:
        return None
    if valve.static > 0.5 and _reversals(stem) < MIN_REVERSALS:
        return None
    ramp = measure_ramp_loop(valve)
    sticky = cause.startswith("sticky")
    if sticky and (ramp.S < MIN_STICKY_S or ramp.J < MIN_JUMP_SHARE * ramp.S):
        return None
    signals = _store(rng, {"op": op, "pv": pv, "sp": sp}, mode, every)
    at_limit = float(np.mean((op <= 0.0) | (op >= 100.0)))
    truth = Truth(sticky, ramp.S, ramp.J, cause, at_limit <= MAX_LIMIT_SHARE)
    record = _record(rng, signals, seed, process, dt * every)
    return SimulatedLoop(record, truth, mode, process.kind, FORMS[controller.form])


def _draw_valve(rng: np.random.Generator, cause: str, dt: float) -> ValveParameters:
    """A valve: hardly any friction, a deadband, or static friction above Coulomb friction."""
    if cause.startswith("sticky"):
        S = float(np.exp(rng.uniform(np.log(1.0), np.log(20.0))))
        J = S * float(rng.uniform(0.2, 0.95))
    elif cause == "deadband":
        S, J = float(np.exp(rng.uniform(np.log(0.7), np.log(10.0)))), 0.0
    else:
        S, J = float(rng.uniform(0.02, 0.4)), 0.0
    air_lag = min(float(np.exp(rng.uniform(np.log(0.1), np.log(3.0)))), dt)
    stribeck = float(np.exp(rng.uniform(np.log(0.3), np.log(3.0))))
    return ValveParameters(
        0.5 * (S + J), 0.5 * (S - J), stribeck, float(rng.uniform(20.0, 50.0)), float(rng.uniform(0.7, 2.0)), air_lag
    )


def _draw_controller(rng: np.random.Generator, process: Process, dt: float, *, tight: bool) -> tuple[Controller, float]:
    """A controller by its gain margin, and the ultimate period of its loop [s]."""
    level = process.kind == "integrating"
    form = int(rng.choice(5, p=(0.1, 0.1, 0.2, 0.35, 0.25) if level else (0.4, 0.25, 0.25, 0.0, 0.1)))
    if tight and form in (ERROR_SQUARED, GAP):
        form = 0
    if level:
        Ti = float(rng.uniform(4.0, 12.0)) * (process.dead_time + 0.3 * process.time_constant)
    else:
        Ti = float(rng.uniform(0.5, 1.5)) * process.time_constant
    ultimate, period = ultimate_point(process, Ti, dt)
    margin = float(rng.uniform(1.03, 1.3) if tight else np.exp(rng.uniform(np.log(2.2), np.log(7.0))))
    gain = min(ultimate / margin, 25.0)
    Td = float(rng.uniform(0.05, 0.15)) * Ti if form == ISA_PID else 0.0
    width = float(rng.uniform(0.5, 3.0)) if form == GAP else float(rng.uniform(3.0, 10.0))
    gap_gain = float(rng.uniform(0.2, 0.6)) if form == GAP else float(rng.uniform(0.1, 0.4))
    return Controller(form, gain, Ti, Td, float(rng.uniform(5.0, 10.0)), width, gap_gain), period


def _draw_interval(rng: np.random.Generator, dt: float, period: float, mode: str) -> int:
    """Samples of the controller to one that is stored; at least eight are stored in the loop's ultimate period."""
    if mode not in ("average", "hold"):
        return 1
    fits = [s for s in (5.0, 10.0, 15.0, 20.0, 30.0, 60.0) if s > dt and s <= period / 8.0 and s % dt == 0.0]
    return round(float(rng.choice(fits)) / dt) if fits else 2


def _draw_noise(rng: np.random.Generator) -> float:
    """Standard deviation of the transmitter's noise [% of span]."""
    return float(np.exp(rng.uniform(np.log(0.01), np.log(0.4))))


def _draw_load(rng: np.random.Generator, cause: str, n: int, period: float) -> NDArray[np.float64]:
    """Load at the process input [% of span], `period` the ultimate one [samples]."""
    load = background_load(rng, n, period * float(rng.uniform(0.2, 3.0))) * float(
        np.exp(rng.uniform(np.log(0.05), np.log(2.0)))
    )
    if cause.endswith("external"):
        wave = period * float(np.exp(rng.uniform(np.log(0.8), np.log(10.0))))
        load += wave_load(rng, n, wave) * float(np.exp(rng.uniform(np.log(1.0), np.log(12.0))))
    return load


def _set_point(rng: np.random.Generator, n: int, period: float) -> NDArray[np.float64]:
    """Set point about 0 [% of span]: constant, or stepped now and then in one loop of seven."""
    if rng.random() < 6.0 / 7.0:
        return np.zeros(n)
    steps = rng.normal(size=n) * (rng.random(n) < 1.0 / (30.0 * period))
    return np.clip(np.cumsum(steps), -8.0, 8.0)


def _discrete(process: Process, h: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The process in steps of h with its input held."""
    from scipy.linalg import expm

    order = len(process.A)
    block = np.zeros((order + 1, order + 1))
    block[:order, :order], block[:order, order:] = process.A, process.B
    both = expm(block * h)
    return both[:order, :order].copy(), both[:order, order].copy()


def _reversals(stem: NDArray[np.float64]) -> int:
    """How often the stem turns round."""
    moves = np.diff(stem)
    direction = np.sign(moves[np.abs(moves) > 0.05])
    return int(np.count_nonzero(np.diff(direction)))


def _store(
    rng: np.random.Generator, signals: dict[str, NDArray[np.float64]], mode: str, every: int
) -> dict[str, NDArray[np.float64]]:
    """The signals with faults of the transmitter, as they are stored."""
    signals = dict(signals)
    if mode in ("average", "hold"):
        signals = {name: historian.store_slower(x, every, average=mode == "average") for name, x in signals.items()}
    if rng.random() < 0.05:
        signals["pv"] = historian.add_spikes(rng, signals["pv"], 5.0 * float(signals["pv"].std()))
    if mode == "quantised" or rng.random() < 0.2:
        for name in ("op", "pv"):
            signals[name] = historian.quantise(signals[name], float(rng.choice((0.01, 0.02, 0.05, 0.1))))
    if mode in ("exception", "swinging_door"):
        store = historian.store_by_exception if mode == "exception" else historian.store_by_swinging_door
        share = float(rng.uniform(0.02, 0.2))
        for name in ("op", "pv"):
            signals[name] = store(signals[name], share * float(signals[name].std()), 60)
    return signals


def _record(
    rng: np.random.Generator, signals: dict[str, NDArray[np.float64]], seed: int, process: Process, dt: float
) -> LoopRecord:
    """The record in engineering units; one loop in two acts the other way round."""
    span, zero = float(rng.choice((1.0, 10.0, 100.0, 400.0))), float(rng.uniform(30.0, 70.0))
    reverse = -1.0 if rng.random() < 0.5 else 1.0
    # A valve that closes with OP: the same loop with the other sign of OP.
    op = signals["op"] if reverse > 0.0 else 100.0 - signals["op"]
    kinds = ("level",) if process.kind == "integrating" else ("flow", "pressure", "temperature", "analyser")
    return LoopRecord(
        f"second-{seed}", dt, op=op, pv=(signals["pv"] + zero) / 100.0 * span, sp=(signals["sp"] + zero) / 100.0 * span,
        loop_type=str(rng.choice(kinds)), integrating=process.kind == "integrating",
    )  # fmt: skip
