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

from calibration.populations.causes import SCENARIOS, add_sensor_fault, share_at_limit, start_near_limit
from calibration.populations.demand import MAX_NOISE_SHARE
from calibration.populations.draw import record_scenario, sample_held_out
from stiction.models import Kano

if TYPE_CHECKING:
    from collections.abc import Iterator

    from calibration.populations.case import Case

__all__ = ["FAULTS", "two_fault_population"]

TWO = 9
"""What the seed of a loop is followed by, so that none of these loops is drawn like one of `population`."""
FAULTS = {"at a limit": 0.5, "spikes": 0.3, "coarse": 0.1, "sticking": 0.1}
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
    >>> from calibration.populations import two_fault_population
    >>> [case.cause for case in two_fault_population(2, seed=1)]
    ['stiction', 'stiction']
    """

    def draw(rng: np.random.Generator, i: int) -> Case:
        fault = str(rng.choice(list(FAULTS), p=list(FAULTS.values())))
        # Drawn again with the loop, a fault that seldom shows would come less often.
        while (case := _drawn(rng, fault, f"two-{i:04d}")) is None:
            pass
        return case

    return sample_held_out(n, seed, TWO, draw)


def _drawn(rng: np.random.Generator, fault: str, tag: str) -> Case | None:
    """A loop with that fault, or None where it does not show, or the valve is of a kind that is not run with it."""
    plan = SCENARIOS["stiction"](rng)
    assert plan is not None
    kind = f"{plan.kind}, {fault}"
    if fault != "at a limit":
        if fault != "spikes" and not isinstance(plan.loop.valve, Kano):
            return None
        plan = replace(add_sensor_fault(rng, plan, fault, hit=HIT, high=HIGH, step=STEP), kind=kind)
        return record_scenario(plan, "stiction", rng, MAX_NOISE_SHARE, tag)
    plan = replace(start_near_limit(rng, plan, AT_LIMIT), kind=kind)
    if not 2.0 < plan.op_start < 98.0:
        return None
    # OP may lie at its limit where that is what is wrong, which `recorded` asks the cause.
    case = record_scenario(plan, "saturation", rng, MAX_NOISE_SHARE, tag)
    if case is None or not SEEN_AT_LIMIT[0] < share_at_limit(case.record.op) < SEEN_AT_LIMIT[1]:
        return None
    mv = case.record.mv
    assert mv is not None
    slips = np.sum(np.abs(np.diff(mv)) > MOVED * case.J)
    return replace(case, cause="stiction") if slips >= SLIPS else None
