"""Loops with a good or a sticky valve that something moves, the sticky one asked for little more than its S."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from calibration.populations.causes import DT, sample_any_loop
from calibration.populations.valves import sticky_valve
from stiction.models import PhysicalValve

if TYPE_CHECKING:
    from calibration.populations.scenario import Scenario
    from stiction.models import Loop, Valve

__all__ = ["MAX_NOISE_SHARE", "STICKY_ONE_IN", "SampledLoop", "sample_loop", "scale_demand"]

STICKY_ONE_IN = 3
"""One loop in so many sticks."""
MAX_NOISE_SHARE = 0.2
"""Largest standard deviation of the measurement noise, as a share of the PV's swing [-]."""
ASKED = (0.2, 0.95)
"""S over what a good valve would be asked for by what moves the loop, of a loop with a sticky one [-]."""


class SampledLoop(NamedTuple):
    """A loop, as yet with a good valve, and the sticky one that it is to have."""

    loop: Loop
    """The loop."""
    valve: Valve | None
    """The sticky valve; None where the valve is good."""
    S: float
    """Its S [% of span]; 0 of a good one."""
    J: float
    """Its J [% of span]; 0 of a good one."""


def sample_loop(rng: np.random.Generator, *, sticky: bool) -> SampledLoop:
    """Draw a loop, and a sticky valve for it.

    Parameters
    ----------
    rng : numpy.random.Generator
        What is drawn from.
    sticky : bool
        Whether its valve sticks.

    Returns
    -------
    SampledLoop
        The loop and the valve.
    """
    dt = float(rng.choice(DT))
    valve, S, J = sticky_valve(rng, dt) if sticky else (None, 0.0, 0.0)
    return SampledLoop(sample_any_loop(rng, min(dt, 2.0) if isinstance(valve, PhysicalValve) else dt), valve, S, J)


def scale_demand(rng: np.random.Generator, plan: Scenario, drawn: SampledLoop, size: float) -> tuple[Scenario, float]:
    """Give a plan its valve, and tell how large what moves it is.

    Parameters
    ----------
    rng : numpy.random.Generator
        What is drawn from.
    plan : Scenario
        The loop with a good valve, and what moves it, of size 1.
    drawn : SampledLoop
        The valve that it is to have.
    size : float
        What moves a loop with a good valve is so large [-].

    Returns
    -------
    tuple of Scenario and float
        The plan with the valve, and that size; of a sticky one such as asks OP for S over one of `ASKED`.
    """
    if drawn.valve is None:
        return plan, size
    asked = float(np.subtract(*np.percentile(plan.run().op, (99.5, 0.5))))
    kind = f"{type(drawn.valve).__name__}, {plan.kind}"
    stuck = replace(plan, loop=replace(plan.loop, valve=drawn.valve), kind=kind, S=drawn.S, J=drawn.J)
    return stuck, drawn.S / float(rng.uniform(*ASKED)) / max(asked, 1e-6)
