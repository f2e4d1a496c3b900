"""Fig. 5: a flow loop whose valve sticks and jumps differently over its travel."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.valvetests import RampTest

__all__ = ["Figure5", "figure5"]

DT_S = 1.0
"""Sampling period [s]."""
SENSOR_LAG_S = 2.0
"""Time constant of the flow sensor [s]."""
NOISE_STD = 0.1
"""Standard deviation of the flow's noise, as stem position [% of span]."""
RAMP_RATE = 0.05
"""Rate of the OP [% of span / s]."""
FLOW_GAIN = 1.2
"""Flow over stem position [m3/h per % of span]."""
FLOW_ZERO = 4.0
"""Flow at stem position 0 [m3/h]."""
POSITIONS = (20.0, 30.0, 40.0, 50.0, 60.0)
"""Stem positions of the table [% of span]."""
STICK_BANDS = (3.0, 3.4, 4.5, 3.8, 3.2)
"""Stick bands at these positions [% of span]."""
JUMPS = (1.2, 1.8, 3.0, 2.2, 1.5)
"""Jumps at these positions [% of span]."""


@dataclass(frozen=True)
class Figure5:
    """A ramp of the flow loop up and down, and the result of the ramp test from the flow alone."""

    time: NDArray[np.float64] = field(repr=False)
    """Time [s], shape (n_samples,)."""
    op: NDArray[np.float64] = field(repr=False)
    """OP [% of span], shape (n_samples,)."""
    pv: dict[str, NDArray[np.float64]] = field(repr=False)
    """Flow with eq. 5 as `printed` and `corrected` [m3/h], each of shape (n_samples,)."""
    position: dict[str, NDArray[np.float64]] = field(repr=False)
    """Stem position, not measured in the paper [% of span], each of shape (n_samples,)."""
    travel: NDArray[np.float64]
    """Positions at which sb and sj are given [% of span], shape (5,)."""
    sb: NDArray[np.float64]
    """Stick band there [% of span], shape (5,)."""
    sj: NDArray[np.float64]
    """Jump there [% of span], shape (5,)."""
    test: RampTest = field(repr=False)
    """Result of `analyse_ramp` for the flow of the corrected model."""


def figure5(seed: int = 0) -> Figure5:
    """Ramp the valve of a flow loop whose sb and sj vary over the travel.

    `seed`: seed of the flow's noise. Returns the paper's industrial record is not available and its text gives no
    numbers for it: the table of sb and sj, the rate, the flow's gain, the sensor's lag of 2 s and the noise are this
    project's, chosen to show what the text describes: stairs at a low rate, with a slip jump and a stick band that vary
    over the stem position. The paper ramped up only; the way down is added, since a flow alone shows the stick band
    only when both directions are present.

    References
    ----------
    srinivasan2008, Fig. 5, section III B and eq. 5 with <sb, sj> = f(x, du).

    Examples
    --------
    >>> from stiction.paper import figure5
    >>> {ramp.behaviour for ramp in figure5().test.ramps}
    {'staircase'}
    """
    from stiction.models import Srinivasan, Table
    from stiction.records import LoopRecord
    from stiction.simulation import stroke
    from stiction.valvetests import analyse_ramp

    rest = np.full(60, POSITIONS[0])
    rise = np.arange(POSITIONS[0], POSITIONS[-1], RAMP_RATE * DT_S)
    op = np.concatenate([rest, rise, np.full(60, POSITIONS[-1]), rise[::-1], rest])
    travel, sb, sj = np.array(POSITIONS), np.array(STICK_BANDS), np.array(JUMPS)
    noise = NOISE_STD * FLOW_GAIN * np.random.default_rng(seed).standard_normal(op.size)
    position: dict[str, NDArray[np.float64]] = {}
    pv: dict[str, NDArray[np.float64]] = {}
    for name, as_printed in (("printed", True), ("corrected", False)):
        valve = Srinivasan(Table(travel, sb), Table(travel, sj), r=2.0 * RAMP_RATE, as_printed=as_printed)
        stem = np.asarray(stroke(valve, op, DT_S).mv)
        position[name] = stem
        pv[name] = FLOW_ZERO + FLOW_GAIN * _sensor(stem) + noise
    record = LoopRecord("flow loop", DT_S, op=op, pv=pv["corrected"], loop_type="flow")
    return Figure5(np.arange(op.size, dtype=np.float64) * DT_S, op, pv, position, travel, sb, sj, analyse_ramp(record))


def _sensor(stem: NDArray[np.float64]) -> NDArray[np.float64]:
    """Stem position after the first-order lag of the flow sensor."""
    keep = float(np.exp(-DT_S / SENSOR_LAG_S))
    flow = stem.copy()
    for k in range(1, stem.size):
        flow[k] = keep * flow[k - 1] + (1.0 - keep) * stem[k]
    return flow
