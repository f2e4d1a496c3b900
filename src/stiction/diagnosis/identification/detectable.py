"""The smallest band that would have shown in a record: how far "no stiction" reaches.

Where no valve that sticks is found there may be none, or one whose band leaves no mark beside the load and the noise.
So one is put into the record: its stem on the OP recorded, and what the process found behind a good valve makes of the
difference between stem and OP, added to the PV. There it is compared with a good valve as any is. The controller's
answer to what was added is not in OP; beside what else moves OP it is small.

That says what would have shown, not what would not: where a load moves a loop the process behind a good valve is seldom
known well, and a valve that sticks tells more of it. `docs/verdict-measured.md` says how far it holds.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.likelihood import NONE, Trial, errors_of, stem_of
from stiction.diagnosis.identification.processes import answer

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.likelihood import Prediction
    from stiction.diagnosis.identified import ProcessFit

__all__ = ["detectable"]

SHARES = 0.5, 0.12
"""Largest and smallest S tried, as shares of OP's swing [-]: a band of more than half of it hardly lets the stem move,
and a good valve behind a smaller gain explains that as well; one below the latter is seldom told where it shows."""
TRIED = 8
"""S tried between them [-]."""
JUMPS = 0.5
"""J over S of the valve put in [-]."""
SEEN = 30.0
"""Twice the log likelihood by which the valve put in has to beat a good one [-]."""


def detectable(prediction: Prediction, process: ProcessFit, dt: float) -> float:
    """Find the smallest S with which a valve that sticks would most likely have shown.

    Parameters
    ----------
    prediction : Prediction
        What is predicted.
    process : ProcessFit
        The process found behind a good valve.
    dt : float
        Time between two samples of the PV [s].

    Returns
    -------
    float
        S [% of span]; infinite where it cannot be told of any that it would have shown.
    """
    op = prediction.op.reshape(-1, prediction.width).mean(axis=1)
    least = math.inf
    for S in float(np.ptp(prediction.op)) * np.geomspace(*SHARES, TRIED):
        stem = stem_of(prediction, Trial(S, JUMPS, 0.0, 0.0, 0.0)).reshape(op.size, -1).mean(axis=1)
        pv = prediction.pv + _answer(process, stem - op, dt) / prediction.spread
        good, sticky = errors_of(prediction._replace(pv=pv, ends=NONE), np.array([op, stem]))[0]
        if prediction.samples * math.log(good / sticky) < SEEN + prediction.op_order:
            break
        least = float(S)
    return least


def _answer(process: ProcessFit, stem: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
    """What a process makes of a stem about its mean [engineering units]."""
    if process.integrating:
        return process.gain * dt * answer(stem, math.inf, process.time_constant / dt, process.dead_time / dt)
    slow = (process.time_constant - process.lag) / dt
    return process.gain * answer(stem, slow, process.lag / dt, process.dead_time / dt)
