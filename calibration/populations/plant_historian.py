"""Loops as a plant's historian keeps them: fast controllers, slow records, slaves of cascades, averages of samples.

`population` draws loops whose record mostly shows the controller's own samples, six to sixty periods of one
oscillation, and any cause as often as any other. Of the records that plants export few are so: a flow controller runs
every second and its values are kept every ten, a level moves its set point, and most loops do not oscillate at all. All
ranges were written down before a loop was counted, and none was changed by what was counted.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from calibration.historian import average_intervals, quantise_signals, sample_slower
from calibration.populations.case import Case
from calibration.populations.loads import SHAPES, lagged_noise, steps, wave
from calibration.populations.processes import gain_margin, log_uniform, scale_gain, with_gain_margin
from calibration.populations.scenario import Scenario
from calibration.populations.valves import LEAST_JUMP, sticky_valve
from stiction.models import FOPDT, PID, SOPDT, Ideal, Integrating, Kano, Loop, TransferFunction
from stiction.records.quality.quantisation import robust_range

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["plant_population"]

PLANT = 5
"""What the seed of a loop is followed by, so that none of these loops is drawn like one of `population`."""
STICKY_ONE_IN = 3
"""One loop in so many sticks."""
KINDS = {"flow": 0.5, "pressure": 0.17, "level": 0.2, "temperature": 0.13}
"""What is controlled, and how often it is."""
RECORD_DT = {1.0: 0.15, 2.0: 0.1, 5.0: 0.15, 10.0: 0.5, 20.0: 0.1}
"""Sampling period of the record [s] -> how often it is so."""
CONTROLLER_DT = (0.5, 1.0, 2.0)
"""Sampling periods of the controllers [s]."""
SAMPLES = (500.0, 2000.0)
"""Shortest and longest record [samples]."""
MOST_SAMPLES = 40_000
"""Longest run [samples of the controller]."""
ASKED = (0.2, 8.0)
"""What a good valve is asked for [% of span], about."""
MOVED = {"slave": 0.35, "load": 0.25, "cycle": 0.4}
"""What moves a loop with a sticky valve, and how often it does."""
GOOD = {
    "slave": ("none", 0.3), "fast slave": ("none", 0.12), "load": ("none", 0.2), "quiet": ("none", 0.08),
    "steps": ("none", 0.07), "wave": ("external disturbance", 0.15), "tight": ("tight tuning", 0.08),
}  # fmt: skip
"""What moves a loop with a good valve -> its cause, and how often it does."""
MODELS = ("Kano", "Choudhury", "He", "Srinivasan", "Stenman", "HeWang")
"""Valve models of those that do not stick hardly at all."""


def plant_population(n: int, seed: int = 0) -> Iterator[Case]:
    """Draw `n` loops as a plant's historian keeps them, one in three with a valve that sticks.

    Parameters
    ----------
    n : int
        Number of loops.
    seed : int
        Seed of everything that is random; each loop has its own, so that a longer population begins with a shorter one.

    Yields
    ------
    Case
        One loop after the other; their period is not known.

    Examples
    --------
    >>> from calibration.populations import plant_population
    >>> [(case.cause, case.record.dt >= case.loop.dt) for case in plant_population(2, seed=2)]
    [('stiction', True), ('tight tuning', True)]
    """
    for i in range(n):
        rng = np.random.default_rng([seed, i, PLANT])
        case = None
        while case is None:
            case = _draw(rng, f"plant-{i:04d}", sticky=i % STICKY_ONE_IN == 0)
        yield case


def _draw(rng: np.random.Generator, tag: str, *, sticky: bool) -> Case | None:
    """Draw a case, or None where the loop has no margin, does not move, runs into a limit of OP or takes too long."""
    dt_shown = float(rng.choice(list(RECORD_DT), p=list(RECORD_DT.values())))
    dt = float(rng.choice([x for x in CONTROLLER_DT if x <= dt_shown]))
    drawn = _loop(rng, dt)
    n = int(dt_shown / dt) * int(log_uniform(rng, *SAMPLES))
    if drawn is None or n > MOST_SAMPLES:
        return None
    loop, kind, ultimate = drawn
    still = np.zeros(n)
    plan = Scenario(loop, sp=still, load=still, pv_load=still, kind=kind, every=int(dt_shown / dt))
    cause, found = _sticky(rng, plan, ultimate) if sticky else _good(rng, plan, ultimate)
    return None if found is None else _recorded(rng, found, cause, kind, tag)


def _recorded(rng: np.random.Generator, plan: Scenario, cause: str, kind: str, tag: str) -> Case | None:
    """The run of a plan with noise, as the historian keeps it."""
    clean = plan.run()
    swing, op_swing = _swing(clean.pv), _swing(clean.op)
    if not (swing > 0.0 and op_swing > 0.02):
        return None
    level = min(swing * log_uniform(rng, 0.003, 0.5), 0.1 * op_swing / abs(plan.loop.controller.Kc))
    colour = float(rng.choice([0.0, 0.0, rng.uniform(1.0, 5.0)]))
    run = plan.run(level * lagged_noise(rng, plan.n, colour))
    if not _sound(run):
        return None
    shown, effects = run, []
    if plan.every > 1:
        keep, effect = (average_intervals, "averaging") if rng.random() < 0.6 else (sample_slower, "sampling")
        shown, effects = keep(run, plan.every * run.dt), [effect]
    if rng.random() < 0.3:
        op_step = float(rng.choice([0.0, 0.01, 0.1]))
        shown, effects = (
            quantise_signals(shown, op=op_step, pv=swing * log_uniform(rng, 1e-4, 0.02)),
            [*effects, "quantisation"],
        )
    sp = shown.sp if rng.random() < 0.75 else None
    shown = replace(shown, tag=tag, loop_type=kind, integrating=kind == "level", sp=sp, mv=None)
    return Case(
        shown, cause, replace(plan.loop, noise=level), cycles=np.nan, kind=plan.kind, S=plan.S, J=plan.J, noise=level,
        effects=tuple(effects),
    )  # fmt: skip


def _loop(rng: np.random.Generator, dt: float) -> tuple[Loop, str, float] | None:
    """Draw a loop with a good valve, what it controls, and its period at the limit of stability [s]."""
    kind = str(rng.choice(list(KINDS), p=list(KINDS.values())))
    gain = log_uniform(rng, 0.2, 5.0)
    process: TransferFunction
    if kind == "level":
        gain, dead_time, lag = (
            gain / log_uniform(rng, 200.0, 2000.0),
            log_uniform(rng, 1.0, 30.0),
            log_uniform(rng, 1.0, 20.0),
        )
        process = Integrating(gain, dead_time, lag)
        closed = (dead_time + lag) * log_uniform(rng, 1.0, 15.0)
        Kc, Ti = 1.0 / (gain * (closed + dead_time)), 4.0 * (closed + dead_time) * log_uniform(rng, 0.5, 2.0)
    elif kind == "flow":
        process = FOPDT(gain, log_uniform(rng, 0.5, 8.0), log_uniform(rng, 0.3, 3.0))
        Kc, Ti = log_uniform(rng, 0.1, 0.9) / gain, log_uniform(rng, 2.0, 60.0)
    elif kind == "pressure":
        tau, dead_time = log_uniform(rng, 5.0, 120.0), log_uniform(rng, 1.0, 8.0)
        process = FOPDT(gain, tau, dead_time)
        closed = tau * log_uniform(rng, 0.3, 2.0)
        Kc = tau / (gain * (closed + dead_time)) * log_uniform(rng, 0.3, 1.0)
        Ti = min(tau, 4.0 * (closed + dead_time)) * log_uniform(rng, 0.5, 2.0)
    else:
        tau, lag, dead_time = log_uniform(rng, 30.0, 600.0), log_uniform(rng, 5.0, 60.0), log_uniform(rng, 5.0, 60.0)
        process = SOPDT(gain, tau, lag, dead_time)
        closed = max(dead_time, 0.3 * tau) * log_uniform(rng, 0.7, 3.0)
        Kc = tau / (gain * (closed + dead_time + lag / 2.0))
        Ti = min(tau, 4.0 * (closed + dead_time)) * log_uniform(rng, 0.5, 2.0)
    weight = float(rng.choice([1.0, 0.0], p=[0.8, 0.2]))
    found = with_gain_margin(rng, Loop(PID(Kc, Ti, b=weight, op_limits=(0.0, 100.0)), Ideal(), process, dt))
    return None if found is None else (found[0], kind, found[1])


def _sticky(rng: np.random.Generator, plan: Scenario, ultimate: float) -> tuple[str, Scenario | None]:
    """The plan with a sticky valve, OP asked for what makes it slip now and then; None where it comes to rest."""
    S = log_uniform(rng, 0.2, 6.0)
    J = S * float(rng.uniform(LEAST_JUMP, 1.0))
    valve, S, J = (
        (Kano(S, J), S, J) if rng.random() < 0.35 else sticky_valve(rng, plan.loop.dt, str(rng.choice(MODELS)))
    )
    moved = str(rng.choice(list(MOVED), p=list(MOVED.values())))
    if moved == "cycle":
        load = (
            0.3 * S * float(rng.random()) ** 2 * lagged_noise(rng, plan.n, log_uniform(rng, 5.0, 1000.0) / plan.loop.dt)
        )
        load[: max(int(ultimate / plan.loop.dt), 20)] += 0.7 * S
        plan = replace(plan, load=load)
    else:
        asked = log_uniform(rng, *ASKED)
        plan = (
            replace(plan, sp=_slave(rng, plan, asked))
            if moved == "slave"
            else replace(plan, load=_load(rng, plan, asked))
        )
        size = S / log_uniform(rng, 0.25, 1.2) / max(_swing(plan.run().op), 1e-9)
        plan = replace(plan, sp=size * plan.sp, load=size * plan.load)
    plan = replace(plan, loop=replace(plan.loop, valve=valve), kind=moved, S=S, J=J)
    run = plan.run()
    assert run.mv is not None
    moves = np.ptp(run.mv[plan.n // 10 :]) > 0.0 and np.ptp(run.op[plan.n // 2 :]) > 0.25 * S
    return "stiction", plan if moves else None


def _good(rng: np.random.Generator, plan: Scenario, ultimate: float) -> tuple[str, Scenario]:
    """The plan with what moves a loop whose valve is good, and its cause."""
    kind = str(rng.choice(list(GOOD), p=[share for _, share in GOOD.values()]))
    asked, dt = log_uniform(rng, *ASKED), plan.loop.dt
    changes: dict[str, NDArray[np.float64]] = {}
    if kind in ("slave", "fast slave"):
        changes["sp"] = _slave(rng, plan, asked, fast=kind == "fast slave")
    elif kind == "steps":
        size = asked / 2.0 * _gain(plan.loop, max(10.0 * plan.loop.process.dead_time, 20.0 * dt))
        changes["sp"] = size * steps(rng, plan.n, plan.n / log_uniform(rng, 2.0, 20.0))
        changes["load"] = _load(rng, plan, 0.05 * asked)
    elif kind == "wave":
        shortest = max(6.0 * plan.every * dt, 2.0 * ultimate)
        period = log_uniform(rng, shortest, max(plan.n * dt / 6.0, 1.3 * shortest))
        shape = str(rng.choice(list(SHAPES), p=list(SHAPES.values())))
        series = asked / 2.0 * wave(rng, shape, plan.n, period / dt, jitter=float(rng.choice([0.0, 0.03])))
        where = str(rng.choice(["load", "sp", "pv_load"], p=[0.6, 0.2, 0.2]))
        changes[where] = series if where == "load" else series * _gain(plan.loop, period / 6.0)
        if where == "load":
            changes[where] = series + _load(rng, plan, 0.2 * asked)
    else:
        changes["load"] = _load(rng, plan, 0.1 * asked if kind == "quiet" else asked)
    if kind == "tight":
        limit = gain_margin(plan.loop)
        assert limit is not None
        plan = replace(plan, loop=scale_gain(plan.loop, limit[0] * float(rng.uniform(0.85, 0.98))))
    return GOOD[kind][0], replace(plan, kind=kind, **changes)  # type: ignore[arg-type]


def _slave(rng: np.random.Generator, plan: Scenario, asked: float, *, fast: bool = False) -> NDArray[np.float64]:
    """Set point that another controller moves, so that OP moves by about `asked` [% of span], shape (n,)."""
    dt = plan.loop.dt
    lag = log_uniform(rng, 10.0, 40.0) if fast else log_uniform(rng, 40.0, 1500.0)
    series = lagged_noise(rng, plan.n, lag / dt)
    if rng.random() < 0.5:
        series = _smoothed(series, log_uniform(rng, 5.0, 100.0) / dt)
    series = series / series.std()
    if rng.random() < 0.5:
        series = series + log_uniform(rng, 0.005, 0.1) * lagged_noise(rng, plan.n, 0.0)
    every = int(rng.choice([1, 1, 2, 10]))
    series = np.repeat(series[::every], every)[: plan.n]
    if rng.random() < 0.5:
        series = series + log_uniform(rng, 0.2, 2.0) * np.linspace(-1.0, 1.0, plan.n)
    return asked / 4.0 * _gain(plan.loop, lag) * series


def _load(rng: np.random.Generator, plan: Scenario, asked: float) -> NDArray[np.float64]:
    """Random load, at times with steps or a ramp, so that OP moves by about `asked` [% of span], shape (n,)."""
    series = lagged_noise(rng, plan.n, log_uniform(rng, 5.0, 1500.0) / plan.loop.dt)
    if rng.random() < 0.3:
        series = series + steps(rng, plan.n, plan.n / 10.0)
    if rng.random() < 0.3:
        series = series + log_uniform(rng, 0.3, 3.0) * np.linspace(-1.0, 1.0, plan.n)
    return asked / 4.0 * series


def _sound(run: LoopRecord) -> bool:
    """Whether the loop is stable and OP keeps off its limits."""
    assert run.pv is not None
    return bool(np.isfinite(run.pv).all()) and float(np.mean((run.op <= 0.1) | (run.op >= 99.9))) < 0.02


def _smoothed(x: NDArray[np.float64], lag: float) -> NDArray[np.float64]:
    from scipy.signal import lfilter

    keep = float(np.exp(-1.0 / lag))
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], x - x[0]), dtype=np.float64)


def _gain(loop: Loop, lag: float) -> float:
    """What the process makes of a wave of six times `lag` [PV units per %]."""
    return abs(complex(loop.process.at(2j * np.pi / (6.0 * lag))))


def _swing(x: NDArray[np.float64] | None) -> float:
    assert x is not None
    return robust_range(x) if np.isfinite(x).all() else 0.0
