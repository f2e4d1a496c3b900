"""Loops with a valve that sticks and a second fault, of which the first must not be lost sight.

In `population` a loop has one thing wrong with it, so that a transmitter with spikes or an OP at its limit says that
the valve is good. In a plant neither knows of the other: a valve sticks in a loop whose OP comes to its limit as
often as in others. Here every valve sticks; the good ones with these faults are those of `population`. All ranges were
written down before a loop was counted, and none was changed by the counts.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.models import Kano
from stiction.simulation.population.causes import PLANS
from stiction.simulation.population.draw import SPOILED, recorded, stored
from stiction.simulation.population.plan import with_series

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stiction.simulation.population.case import Case
    from stiction.simulation.population.plan import Plan

__all__ = ["FAULTS", "two_fault_population"]

TWO = 9
"""What the seed of a loop is followed by, so that none of these loops is drawn like one of `population`."""
NOISE = 0.2
"""Largest standard deviation of the measurement noise, as a share of the PV's swing [-]."""
FAULTS = {"limit": 0.5, "spikes": 0.3, "coarse": 0.1, "sticking": 0.1}
"""Second faults and how often they come: OP at a limit, a loose contact, a PV of few steps, one that hangs."""
AT_LIMIT, SEEN_AT_LIMIT = (0.05, 0.4), (0.03, 0.6)
"""Share of the samples beyond the limit, without it, and that at it may be in the record [-]."""
SLIPS = 8
"""Moves of the stem by `MOVED` of J and more that the record of a loop at its limit has at least."""
MOVED = 0.5
"""What counts as such a move, as a share of J [-]."""
HIT, HIGH = (0.001, 0.02), (0.5, 4.0)
"""Share of the samples with a spike, and its size over the PV's swing [-]."""
STEP = (0.05, 0.3)
"""Step of a coarse PV, or band in which one hangs, over the PV's swing [-]."""


def two_fault_population(n: int, seed: int = 0) -> Iterator[Case]:
    """Draw `n` loops with a valve that sticks and a second fault.

    Parameters
    ----------
    n : int
        Number of loops.
    seed : int
        Seed of everything that is random; each loop has its own, so that a longer population begins with a shorter one.

    Yields
    ------
    Case
        One loop after the other. One in three went through a historian, as in `population`.

    Examples
    --------
    >>> from stiction.simulation.population import two_fault_population
    >>> [case.cause for case in two_fault_population(2, seed=1)]
    ['stiction', 'stiction']
    """
    for i in range(n):
        rng = np.random.default_rng([seed, i, TWO])
        fault = str(rng.choice(list(FAULTS), p=list(FAULTS.values())))
        case = None
        while case is None:
            case = _drawn(rng, fault, f"two-{i:04d}")
        yield stored(case, rng) if rng.random() < SPOILED else case


def _drawn(rng: np.random.Generator, fault: str, tag: str) -> Case | None:
    """A loop with that fault, or None where it does not show."""
    plan = PLANS["stiction"](rng)
    assert plan is not None
    plan = _limited(rng, plan) if fault == "limit" else _measured(rng, plan, fault)
    # OP may lie at its limit where that is what is wrong, which `recorded` asks the cause.
    case = None if plan is None else recorded(plan, "saturation" if fault == "limit" else "stiction", rng, NOISE, tag)
    if case is None:
        return None
    op, mv = case.record.op, case.record.mv
    assert mv is not None
    if fault == "limit":
        at_limit = float(np.mean((op >= 99.95) | (op <= 0.05)))
        if not SEEN_AT_LIMIT[0] < at_limit < SEEN_AT_LIMIT[1] or np.sum(np.abs(np.diff(mv)) > MOVED * case.J) < SLIPS:
            return None
    return replace(case, cause="stiction", record=replace(case.record, mv=None))


def _limited(rng: np.random.Generator, plan: Plan) -> Plan | None:
    """The plan with OP so near to a limit that it would go beyond; None where that leaves no room for it."""
    unlimited = replace(plan.loop.controller, op_limits=(-np.inf, np.inf))
    op = replace(plan, loop=replace(plan.loop, controller=unlimited)).run().op
    share, high = float(rng.uniform(*AT_LIMIT)), bool(rng.random() < 0.5)
    limit = float(np.quantile(op, 1.0 - share if high else share))
    start = plan.op_start - limit + (100.0 if high else 0.0)
    return replace(plan, op_start=start, kind=f"{plan.kind}, at a limit") if 2.0 < start < 98.0 else None


def _measured(rng: np.random.Generator, plan: Plan, fault: str) -> Plan | None:
    """The plan with a faulty transmitter; None where the valve is of a kind that is not run with one."""
    pv = plan.run().pv
    assert pv is not None
    swing = float(np.subtract(*np.percentile(pv, (99, 1))))
    kind = f"{plan.kind}, {fault}"
    if fault == "spikes":
        hit = rng.random(plan.n) < rng.uniform(*HIT)
        size = swing * rng.uniform(*HIGH) * rng.uniform(0.5, 1.0, plan.n) * rng.choice([-1.0, 1.0])
        return replace(with_series(plan, pv_load=np.where(hit, size, 0.0)), kind=kind)
    if not isinstance(plan.loop.valve, Kano):
        return None
    step = swing * float(rng.uniform(*STEP))
    return replace(plan, kind=kind, sensor=(step, 0.0) if fault == "coarse" else (0.0, step))
