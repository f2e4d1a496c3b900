r"""From the features of a record to the probability of each cause.

Two tables of weights, both logistic regressions with a small ridge (`weighing` has their form):

- `sticks.csv` tells a valve that sticks from everything else that is no mere deadband. It weighs few features, those
  that keep their meaning from simulated to recorded loops, and was found on both;
- `causes.csv` tells all causes apart and weighs all features. It was found on simulated loops only, where the cause
  is known; of it the share of deadband is used, and how what is left is dealt out over the other causes.

.. math:: P(\text{stiction}) = p\,(1 - q_d), \quad P(\text{deadband}) = q_d, \quad
    P(c) = (1 - p)(1 - q_d)\, q_c / \textstyle\sum_{c'} q_{c'}

with p the first table's probability, q the second's, c any of the other causes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.result import Counted
from stiction.diagnosis.verdict.weighing import weighing

if TYPE_CHECKING:
    from stiction.diagnosis.verdict.features import Features

__all__ = ["UNDECIDED", "causes", "counted"]

UNDECIDED = (0.45, 0.55)
"""Probabilities of stiction between which nothing is called."""
SAFE = 0.999
"""Largest share given to deadband, so that the rest stays a probability [-]."""


def causes(row: Features) -> dict[str, float]:
    """Probability of each cause.

    Parameters
    ----------
    row : Features
        What was found in the record.

    Returns
    -------
    dict
        Cause -> probability [-]; they sum to 1.
    """
    sticks, named = weighing("sticks"), weighing("causes")
    odds = float(sticks.constant[0] + sticks.added([getattr(row, name) for name in sticks.features])[:, 0].sum())
    p = 1.0 / (1.0 + math.exp(-min(max(odds, -50.0), 50.0)))
    scores = named.constant + named.added([getattr(row, name) for name in named.features]).sum(axis=0)
    shares = np.exp(scores - scores.max())
    share = dict(zip(named.outcomes, (shares / shares.sum()).tolist(), strict=True))
    play = min(share.pop("deadband"), SAFE)
    del share["stiction"]
    rest = (1.0 - p) * (1.0 - play) / sum(share.values())
    return {"stiction": p * (1.0 - play), "deadband": play, **{name: rest * q for name, q in share.items()}}


def counted(row: Features) -> tuple[Counted, ...]:
    """What each feature did to the probability of stiction, the strongest first.

    Parameters
    ----------
    row : Features
        What was found in the record.

    Returns
    -------
    tuple of Counted
        One for each feature that the first table weighs.
    """
    sticks = weighing("sticks")
    values = [float(getattr(row, name)) for name in sticks.features]
    added = sticks.added(values)[:, 0].tolist()
    rows = map(Counted, sticks.features, values, sticks.usual.tolist(), added)
    return tuple(sorted(rows, key=lambda one: -abs(one.log_odds)))
