r"""From the features of a record to the probability of each cause.

Two tables of weights, both logistic regressions with a small ridge (`weighing` has their form):

- `sticks.csv` tells a valve that sticks from everything else that is no mere deadband. It weighs few features, those
  that keep their meaning from simulated to recorded loops, and was found on both;
- `causes.csv` tells all causes apart and weighs all features. It was found on simulated loops only, where the cause
  is known.

Their log odds of stiction are pooled, the first counting `POOL`; of the second the share of deadband is used, and how
what is left is dealt out over the other causes:

.. math:: \text{logit}\,p = w\,\text{logit}\,p_1 + (1 - w)\,\text{logit}\,\frac{q_s}{1 - q_d}

.. math:: P(\text{stiction}) = p\,(1 - q_d), \quad P(\text{deadband}) = q_d, \quad
    P(c) = (1 - p)(1 - q_d)\, q_c / \textstyle\sum_{c'} q_{c'}

with p1 the first table's probability, q the second's, c any of the other causes.
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

UNDECIDED = (0.48, 0.52)
"""Probabilities of stiction between which nothing is called."""
POOL = 0.85
"""What the log odds of the first table count [-]; those of the second count the rest. Of 0.75, 0.8, 0.85 and 0.9 the
last two tell all 23 recorded loops right that are left out, and 0.85 more simulated ones (`calibrate.py`)."""
SAFE, FLOOR = 0.999, 1e-4
"""Largest share given to deadband, and smallest of stiction by the second table: no table is surer than that [-]."""


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
    share = _simulated(row)
    p = 1.0 / (1.0 + math.exp(-_held(sum(one.log_odds for one in _weighed(row, share)))))
    play = share.pop("deadband")
    del share["stiction"]
    rest = (1.0 - p) * (1.0 - play) / sum(share.values())
    return {"stiction": p * (1.0 - play), "deadband": play, **{name: rest * q for name, q in share.items()}}


def counted(row: Features) -> tuple[Counted, ...]:
    """What each feature did to the probability of stiction.

    Parameters
    ----------
    row : Features
        What was found in the record.

    Returns
    -------
    tuple of Counted
        One for each feature that the first table weighs, one for the second table, and the constant, the strongest
        first; their log odds sum to those of a valve that sticks, deadband aside.
    """
    return tuple(sorted(_weighed(row, _simulated(row)), key=lambda one: -abs(one.log_odds)))


def _simulated(row: Features) -> dict[str, float]:
    """Shares by the second table."""
    named = weighing("causes")
    scores = named.constant + named.added([getattr(row, name) for name in named.features]).sum(axis=0)
    shares = np.exp(scores - scores.max())
    share = dict(zip(named.outcomes, (shares / shares.sum()).tolist(), strict=True))
    share["deadband"] = min(share["deadband"], SAFE)
    return share


def _weighed(row: Features, share: dict[str, float]) -> list[Counted]:
    """What each feature and the second table add to the pooled log odds."""
    sticks = weighing("sticks")
    values = [float(getattr(row, name)) for name in sticks.features]
    added = (POOL * sticks.added(values)[:, 0]).tolist()
    alike = min(max(share["stiction"] / (1.0 - share["deadband"]), FLOOR), 1.0 - FLOOR)
    usual = float(sticks.constant[0])
    return [
        Counted("usual", math.nan, math.nan, POOL * usual),
        Counted("likeness", alike, 1.0 / (1.0 + math.exp(-usual)), (1.0 - POOL) * math.log(alike / (1.0 - alike))),
        *map(Counted, sticks.features, values, sticks.usual.tolist(), added),
    ]


def _held(odds: float) -> float:
    return min(max(odds, -50.0), 50.0)
