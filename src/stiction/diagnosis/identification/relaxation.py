r"""How well a good valve predicts the PV if a relaxation oscillation from outside moves it.

A level that fills until a pump starts, a neighbour's valve that sticks or a surge goes one way until something comes
to a limit, and then the other. Its period wanders with how fast it goes, so that no wave of one period predicts it
(`outside_wave`), but where it turns is known: the PV comes to much the same level every time. OP, which the controller
makes of the PV, does so too, and a stem that slips there passes for the cause. So the good valve gets a relay with
hysteresis of the PV in place of OP's lags, which to it are its stem's:

.. math:: s_k = \begin{cases} 1 & y_k \ge b \\ -1 & y_k \le a \\ s_{k-1} & a < y_k < b \end{cases}

with y the PV, as it is or behind a short lag. It is for the PV what the largest slip jump is for OP: a stem that rests
at one of two places. The levels a and b are looked for with the same care, first over the whole swing of the PV, then
closer and closer about the best ones. A valve that sticks slips where OP comes to a level; in a loop that nothing else
moves OP and PV go together, and the relay predicts some of that too: what counts is how much it leaves.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.contest import LookAlike
from stiction.diagnosis.identification.likelihood import EQUAL, errors_of, kept
from stiction.diagnosis.identification.prediction import behind_lag
from stiction.models.compiled import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.likelihood import Prediction

__all__ = ["relaxation", "relays"]

LAGS = (0.0, 2.0)
"""Lags of the PV before the relay [samples]."""
ENDS = 0.01, 0.99
"""Quantiles of the PV between which the levels are looked for [-]."""
LEVELS = (-0.4, -0.1, 0.2, 0.5, 0.7, 0.85, 0.95)
"""Levels tried first, each side of the middle, in half swings [-]; below 0 beyond the middle, as where it is held."""
STEPS = (0.1, 0.04, 0.016, 0.008)
"""Steps of the closer searches, in half swings [-]."""
AROUND = (-1.0, 0.0, 1.0)
"""Levels tried in each of them about the best, in its steps [-]."""


def relaxation(prediction: Prediction) -> LookAlike:
    """Let a relay of the PV stand beside a good valve, with the levels that predict best.

    Parameters
    ----------
    prediction : Prediction
        What is predicted.

    Returns
    -------
    LookAlike
        What the valve leaves.
    """
    behind = [_behind(prediction.pv, lag) for lag in LAGS]
    ends = [np.quantile(pv, ENDS) for pv in behind]
    levels = [0.5 * (high - low) * np.array(LEVELS) for low, high in ends]
    middle = [0.5 * (low + high) for low, high in ends]
    tried = [_best(prediction, pv, at - off, at + off) for pv, at, off in zip(behind, middle, levels, strict=True)]
    best = min(range(len(LAGS)), key=lambda i: tried[i][0])
    pv, (_, low, high) = behind[best], tried[best]
    for step in STEPS:
        around = 0.5 * step * np.ptp(ends[best]) * np.array(AROUND)
        _, low, high = _best(prediction, pv, low + around, high + around)
    return LookAlike(errors_of(prediction, relays(pv, np.array([low]), np.array([high])))[1][0], prediction.op_order)


def _behind(pv: NDArray[np.float64], lag: float) -> NDArray[np.float64]:
    """The PV behind a lag [samples]."""
    out = np.empty_like(pv)
    behind_lag(pv, float(kept(np.array(lag))), out)
    return out


def _best(
    prediction: Prediction, pv: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[float, float, float]:
    """What the best of all pairs of levels leaves, and the levels."""
    low, high = (x.ravel() for x in np.meshgrid(low, high))
    low, high = low[low <= high], high[low <= high]
    left = errors_of(prediction, relays(pv, low, high))[0]
    # Relays that switch alike leave the same, and rounding shall not choose.
    best = int(np.argmin(np.round(prediction.samples * np.log(left), EQUAL)))
    return float(left[best]), float(low[best]), float(high[best])


@kernel
def relays(pv, low, high):
    """Switch relays with hysteresis by one signal.

    Parameters
    ----------
    pv : ndarray, shape (n_samples,)
        The signal.
    low, high : ndarray, shape (n_relays,)
        Levels at or below which each is at -1, and at or above which at 1; where both hold it is at 1.

    Returns
    -------
    ndarray, shape (n_relays, n_samples)
        Where each is [-]; before the first level it is on the side of the middle that the signal is on.

    Examples
    --------
    >>> import numpy as np
    >>> relays(np.array([0.2, 1.0, 0.0, -1.0, 0.0]), np.array([-0.5]), np.array([0.5]))
    array([[ 1.,  1.,  1., -1., -1.]])
    """
    out = np.empty((low.size, pv.size))
    for i in range(low.size):
        at = 1.0 if pv[0] >= 0.5 * (low[i] + high[i]) else -1.0
        for k in range(pv.size):
            if pv[k] >= high[i]:
                at = 1.0
            elif pv[k] <= low[i]:
                at = -1.0
            out[i, k] = at
    return out
