"""Draw a population: a plan for each cause, its run, its noise, and what the historian makes of it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from calibration.historian import EFFECTS, INTERVAL_EFFECTS, apply_effect, sample_slower
from calibration.historian.effects import MAX_INTERVAL_SAMPLES
from calibration.populations.case import CAUSES, Case
from calibration.populations.causes import PER_PERIOD, SCENARIOS
from calibration.populations.loads import lagged_noise
from calibration.populations.position import report_position
from calibration.populations.processes import log_uniform
from stiction.errors import ParameterError
from stiction.records.quality.quantisation import robust_range

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from calibration.populations.scenario import Scenario
    from stiction.records.record import LoopRecord

__all__ = ["EFFECT_SHARE", "population", "record_scenario", "sample_held_out"]

MILD = 0.3
"""Largest strength of what the historian does to a case [-]."""
EFFECT_SHARE = 1.0 / 3.0
"""Share of the cases that a historian has spoiled [-]."""

OWN = 1
"""What the seed of the position adds to that of its loop, so that the loop is the same with a position and without."""
CUT = 2
"""The same of the place that a short record is cut out from."""
SHAKEN = 0.05
"""Largest standard deviation that noise gives OP, as a share of its swing: beyond, a plant filters the PV [-]."""


def population(
    n: int,
    causes: tuple[str, ...] = CAUSES,
    seed: int = 0,
    *,
    noise: float = 0.2,
    historian: bool = True,
    position: bool | str = False,
    samples: tuple[int, int] | None = None,
) -> Iterator[Case]:
    """Draw `n` loops, their causes taken in turn.

    Parameters
    ----------
    n : int
        Number of loops.
    causes : tuple of str
        Causes to draw, out of `CAUSES`.
    seed : int
        Seed of everything that is random; each loop has its own, so that a longer population begins with a
        shorter one.
    noise : float
        Largest standard deviation of the measurement noise, as a share of the PV's swing [-].
    historian : bool
        Whether one case in three went through a historian that did something to it, mildly.
    position : bool or str
        Whether the valve's position was recorded, as `position.report_position` reports it; one of
        `position.POSITIONS` asks for that kind. Nothing else of the loop depends on it.
    samples : tuple of int, optional
        Fewest and most samples of which the record is cut out, where the cause shows [-]; by default all are kept.

    Yields
    ------
    Case
        One loop after the other.

    Raises
    ------
    ParameterError
        When a cause is unknown.

    Notes
    -----
    Processes are flow, first and second order, some with a zero, and integrating; controllers PI or PID of several
    forms, tuned by SIMC, lambda tuning, or badly; valves of every model. Records hold 500 to 4000 samples, 6 to 60
    periods of 8 to 200 samples, before the historian: where 60 periods are fewer than 500 samples there are more.

    Examples
    --------
    >>> from calibration.populations import population
    >>> [case.cause for case in population(2, ("stiction", "none"), seed=1)]
    ['stiction', 'none']
    """
    unknown = [cause for cause in causes if cause not in CAUSES]
    if unknown:
        raise ParameterError(f"cause {unknown[0]!r} is unknown; use {', '.join(CAUSES)}.")
    for i in range(n):
        rng = np.random.default_rng([seed, i])
        case = None
        while case is None:
            case = _draw(causes[i % len(causes)], rng, noise, f"loop-{i:04d}")
        case = _positioned(case, np.random.default_rng([seed, i, OWN]), position)
        if samples is not None:
            case = _cut(case, np.random.default_rng([seed, i, CUT]), *samples)
        yield stored(case, rng) if historian and rng.random() < EFFECT_SHARE else case


def sample_held_out(
    n: int, seed: int, lot: int, draw: Callable[[np.random.Generator, int], Case | None]
) -> Iterator[Case]:
    """Draw loops that are none of `population`, each again until it shows what it should, without the position.

    Parameters
    ----------
    n : int
        Number of loops.
    seed : int
        Seed of everything that is random.
    lot : int
        What the seed and number of a loop are followed by, so that none is drawn like one of another population.
    draw : callable
        Draws the loop of a number, before any historian; None where it does not show what it should.

    Yields
    ------
    Case
        One loop after the other; one in three went through a historian, as in `population`.
    """
    for i in range(n):
        rng = np.random.default_rng([seed, i, lot])
        case = None
        while case is None:
            case = draw(rng, i)
        case = replace(case, record=replace(case.record, mv=None))
        yield stored(case, rng) if rng.random() < EFFECT_SHARE else case


def _draw(cause: str, rng: np.random.Generator, noise: float, tag: str) -> Case | None:
    """Draw a case, or None where the loop does not show the cause."""
    plan = SCENARIOS[cause](rng)
    return None if plan is None else record_scenario(plan, cause, rng, noise, tag)


def record_scenario(plan: Scenario, cause: str, rng: np.random.Generator, noise: float, tag: str) -> Case | None:
    """Run a plan and record it.

    Parameters
    ----------
    plan : Scenario
        A loop and what moves it.
    cause : str
        Its cause.
    rng : numpy.random.Generator
        What noise and kind of loop are drawn from.
    noise : float
        Largest standard deviation of the measurement noise, as a share of the PV's swing [-].
    tag : str
        Name of the loop.

    Returns
    -------
    Case or None
        The case, before any historian; None where the loop does not move or runs into a limit of OP.
    """
    clean = plan.run()
    if not _sound(clean, cause):
        return None
    assert clean.pv is not None
    swing, op_swing = robust_range(clean.pv), robust_range(clean.op)
    controller = plan.loop.controller
    amplified = abs(controller.Kc) * (1.0 + (controller.N if controller.Td else 0.0))
    level = min(noise * swing * float(rng.random()) ** 2, SHAKEN * op_swing / amplified)
    colour = float(rng.choice([0.0, 0.0, rng.uniform(1.0, 5.0)]))
    record = plan.run(level * lagged_noise(rng, plan.n, colour))
    if not _sound(record, cause):
        return None
    shown = sample_slower(record, plan.every * record.dt)
    integrating = plan.loop.process.den[-1] == 0.0  # type: ignore[union-attr]
    kinds = ["level", "level", "pressure"] if integrating else ["flow", "flow", "pressure", "temperature"]
    shown = replace(
        shown, tag=tag, loop_type=str(rng.choice(kinds)), integrating=bool(integrating),
        sp=None if rng.random() < 0.15 else shown.sp,
    )  # fmt: skip
    period = plan.period * plan.loop.dt
    return Case(
        shown, cause, replace(plan.loop, noise=level), shown.duration / period, plan.kind, period, plan.S, plan.J,
        level, plan.random_load, _windows(plan),
    )  # fmt: skip


def _positioned(case: Case, rng: np.random.Generator, position: bool | str) -> Case:
    """The case with its valve's position as reported, or without."""
    if not position:
        return replace(case, record=replace(case.record, mv=None))
    per_period = case.period / case.record.dt
    scale = per_period if np.isfinite(per_period) else len(case.record) / 20.0
    record, kind = report_position(case.record, scale, rng, None if position is True else str(position))
    return replace(case, record=record, position=kind)


def _cut(case: Case, rng: np.random.Generator, fewest: int, most: int) -> Case:
    """A stretch of the record in which the cause shows: where the valve sticks, or after the kick that makes a ring."""
    n = len(case.record)
    size = min(round(log_uniform(rng, fewest, most)), n)
    first, last = case.sticking[0] if case.sticking else (0, 0 if case.kind == "ringing" else n)
    at = min(max(int(rng.integers(first, max(last - size, first) + 1)), 0), n - size)
    sticking = tuple((max(begin - at, 0), min(end - at, size)) for begin, end in case.sticking)
    record = case.record.window(at, at + size)
    return replace(case, record=record, cycles=record.duration / case.period, sticking=sticking)


def _sound(record: LoopRecord, cause: str) -> bool:
    """Whether the loop moves, and keeps off the limits of OP unless that is what is wrong with it."""
    assert record.pv is not None
    if not (np.isfinite(record.pv).all() and np.ptp(record.pv) > 0.0 and np.ptp(record.op) > 0.01):
        return False
    return cause == "saturation" or float(np.mean((record.op <= 0.1) | (record.op >= 99.9))) < 0.02


def _windows(plan: Scenario) -> tuple[tuple[int, int], ...]:
    """Where the valve sticks, in samples of the record."""
    if plan.sticks is None:
        return ()
    inside = np.flatnonzero(plan.sticks[plan.burn :])
    return ((int(inside[0]) // plan.every, int(inside[-1]) // plan.every + 1),)


def stored(case: Case, rng: np.random.Generator) -> Case:
    """Let a historian do one thing to a case, mildly.

    Parameters
    ----------
    case : Case
        The case.
    rng : numpy.random.Generator
        What it does is drawn from.

    Returns
    -------
    Case
        As it comes back.
    """
    strength = MILD * float(rng.random())
    per_period = case.period / case.record.dt if np.isfinite(case.period) else 2.0 * PER_PERIOD[0]
    room = float(np.log(max(per_period / PER_PERIOD[0], 1.0)) / np.log(MAX_INTERVAL_SAMPLES))
    usual = [
        name
        for name in EFFECTS
        if name not in INTERVAL_EFFECTS or round(MAX_INTERVAL_SAMPLES ** min(strength, room)) > 1
    ]
    effect = str(rng.choice(usual))
    strength = min(strength, room) if effect in INTERVAL_EFFECTS else strength
    record = apply_effect(case.record, effect, strength, int(rng.integers(2**31)))
    return replace(case, record=record, cycles=record.duration / case.period, effects=(effect,))
