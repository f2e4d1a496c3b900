"""A first look at a stretch: how much better some sticky valve predicts its PV than a good one, by few trials.

It tells which stretch of a long record is worth a diagnosis of its own, and no more than that: the likelihood of the
best of `SIZES` by `RATIOS` valves, with stems that go on and that rest, on the middle `SAMPLES` of the stretch. Of 16
simulated flow and pressure loops whose valve sticks in the last fifth of 20 000 samples it is largest in the last
quarter in 16, at 26 to 339; in the other quarters, where the valve is good, it is 19 to 42.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.likelihood import Trial, good_valve, prediction_of, trials_of, valves
from stiction.diagnosis.identification.signals import prepare
from stiction.errors import RecordError
from stiction.records.quality.quantisation import robust_range

if TYPE_CHECKING:
    from stiction.records.record import LoopRecord

__all__ = ["glance"]

SAMPLES = 2000
"""Samples looked at, those in the middle [-]."""
SIZES = np.geomspace(0.08, 1.0, 18)
"""S over the OP's swing [-]."""
RATIOS = (0.2, 0.4, 0.6, 0.8, 1.0)
"""J / S [-]."""


def glance(record: LoopRecord) -> float:
    """Look for a sticky valve with few trials.

    Parameters
    ----------
    record : LoopRecord
        A stretch with OP and PV.

    Returns
    -------
    float
        Twice the log likelihood by which the best of the valves tried beats a good one [-]; -inf where too little of
        OP and PV was recorded, or OP rests.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    >>> glance(st.simulate(loop, sp=10.0, duration=2000.0, seed=1)) > 500.0
    True
    """
    first = max((len(record) - SAMPLES) // 2, 0)
    try:
        signals = prepare(record.window(first, min(first + SAMPLES, len(record))), None, fine=True)
    except RecordError:
        return -np.inf
    swing = robust_range(signals.op)
    if not swing > 0.0:
        return -np.inf
    tried = np.concatenate([valves(swing * SIZES, RATIOS, K, 0.0, swing) for K in (0.0, 1.0)])
    good = good_valve(Trial(swing, 0.0, 0.0, 0.0, 0.0))
    cost = trials_of(prediction_of(signals), np.concatenate([tried, good])).cost
    return float(cost[-1] - cost[:-1].min())
