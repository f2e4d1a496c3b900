"""Valves tried once, however often the searches come back to them: what one costs on a record is what it cost before.

The steps about a valley begin with the valley itself, those about two valleys meet, and the best of each S is often the
best of some J.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.likelihood import Trial, Trials, trials_of
from stiction.models.compiled import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.likelihood import Prediction

__all__ = ["NOTHING", "tried_too"]

NOTHING = Trials(np.empty((0, len(Trial._fields))), np.empty(0))
"""No trials."""


def tried_too(prediction: Prediction, tried: Trials, valve: NDArray[np.float64]) -> Trials:
    """Try more valves, none twice.

    Parameters
    ----------
    prediction : Prediction
        What is predicted.
    tried : Trials
        Valves tried on it before.
    valve : ndarray, shape (n, 5)
        Those tried now, as in `Trials`.

    Returns
    -------
    Trials
        Both, each valve as often as it is given.
    """
    before, valve = len(tried.valve), np.concatenate([tried.valve, valve])
    first, cost = np.arange(len(valve)), np.empty(len(valve))
    first_alike(valve, before, np.argsort(valve[:, 0], kind="stable"), first)
    new = before + np.flatnonzero(first[before:] == np.arange(before, len(valve)))
    cost[:before], cost[new] = tried.cost, trials_of(prediction, valve[new]).cost
    return Trials(valve, cost[first])


@kernel
def first_alike(valve, before, order, first):
    """Lower `first` (n,), which holds each its own place, to that of the first row of `valve` (n, 5) that is equal.

    `order` sorts them by S, equal ones as they come. Rows up to `before` keep their own.
    """
    for i in range(1, order.shape[0]):
        k = order[i]
        back = i - 1 if k >= before else -1
        while back >= 0 and valve[order[back], 0] == valve[k, 0]:
            one, same = order[back], True
            for column in range(1, valve.shape[1]):
                same = same and valve[one, column] == valve[k, column]
            if same:
                first[k] = first[one]
                break
            back -= 1
