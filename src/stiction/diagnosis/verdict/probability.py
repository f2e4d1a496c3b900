r"""From the features of a record to the probability of each cause.

Four tables of weights, all logistic regressions with a ridge, small but for the last (`weighing` has their form):

- `sticks.csv` tells a valve that sticks from everything else that is no mere deadband. It weighs the features that keep
  their meaning from simulated to recorded loops, and was found on both: its weights are the means of many tables, each
  of the few features that a sample of the loops chose;
- `causes.csv` tells all causes apart and weighs all features. It was found on simulated loops only, where the cause
  is known;
- `jumps.csv` tells a valve that sticks from one with play by nothing but the likelihood of a jump, and was found on
  simulated integrating loops, the only ones where play makes a cycle of its own;
- `plant.csv` tells a valve that sticks from a good one by all features, with a ridge so strong that each counts by what
  it says alone, and was found on loops as a plant's historian keeps them (`simulation.population.plant`). A second
  column tells such records from those of the wider population that the second and the third table were found on.

Of a valve with a band the second and the third table together say whether it jumps, the third counting v = `JUMP`:

.. math:: \ln\frac{q_s}{q_d} = (1 - v) \ln\frac{q_s'}{q_d'} + v\, j, \qquad q_s + q_d = q_s' + q_d'

with q' the shares of the second table and j the log odds of the third. To the log odds of stiction by the first table
those by the tables found on simulated loops are added, of which each counts as far as the record looks like what it was
found on, at most w = `OTHERS` and m = `PLANT`, the first table by up to u = `LESS` less where the fourth counts; the
second deals out what is left over the other causes:

.. math:: \text{logit}\,p = (1 - k u)\,\text{logit}\,p_1 + (1 - k)\,w\,\text{logit}\,\frac{q_s}{1 - q_d} + k\,m\,l

.. math:: P(\text{stiction}) = p\,(1 - q_d), \quad P(\text{deadband}) = q_d, \quad
    P(c) = (1 - p)(1 - q_d)\, q_c / \textstyle\sum_{c'} q_{c'}

with p1 the first table's probability, l the log odds by the fourth, k the probability by it that a plant's historian
kept the record, c any of the other causes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.result import Counted
from stiction.diagnosis.verdict.weighing import weighing

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.verdict.features import Features

__all__ = ["UNDECIDED", "causes", "counted", "kept_by_plant"]

UNDECIDED = (0.48, 0.52)
"""Probabilities of stiction between which nothing is called."""
OTHERS, PLANT, LESS = 0.35, 2.5, 0.3
"""What the log odds of the second and third table count at most beside those of the first, what those of the fourth
do, which its ridge keeps small, and how much less the first counts then [-]. The more the others count, the more
simulated loops are told right (0.25, 0.35, 0.5: balanced accuracy 0.903, 0.905, 0.909, seed 12) and the less sure are
recorded ones that are left out (log loss 0.116, 0.120, 0.129); with 2 in place of 2.5 it is 0.126."""
JUMP = 0.35
"""What the log odds of the third table count in those of a jump [-]. Half leaves the least log loss between play and
stiction on simulated integrating loops left out, less keeps more loops with play (`calibrate.py`)."""
SIGNS = {
    "sensor": {"coarse": 0.02, "still": 0.1, "spikes": 0.0},
    "saturation": {"at_limit": 0.0, "saturated": 0.0},
}  # fmt: skip
"""Signs of a faulty transmitter and of an OP at its limit, and beyond what they are one [-]. Without any these are not
blamed: a stem that rests in its band, or one upset of a quiet loop, has tails like a bad transmitter's. Of simulated
loops with a faulty one 2.6 % show none, of the others 95 %; of those at a limit 0.1 %, of the others 97 %
(`simulation.population`, seed 101)."""
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
    p = _probability(sum(one.log_odds for one in _weighed(row, share)))
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
        One for each feature that the first table weighs, one for the second and third table together, one for
        the fourth, and the constant, the strongest first; their log odds sum to those of a valve that sticks,
        deadband aside.
    """
    return tuple(sorted(_weighed(row, _simulated(row)), key=lambda one: -abs(one.log_odds)))


def kept_by_plant(row: Features) -> float:
    """Likeness of a record to what a plant's historian keeps.

    Parameters
    ----------
    row : Features
        What was found in the record.

    Returns
    -------
    float
        Probability, by the fourth table, that it comes from there and not from the wider population [-].
    """
    return _probability(_fourth(row)["plant"])


def _fourth(row: Features) -> dict[str, float]:
    """Log odds by the fourth table."""
    return dict(zip(weighing("plant").outcomes, _scores("plant", row).tolist(), strict=True))


def _simulated(row: Features) -> dict[str, float]:
    """Shares by the second table, those of stiction and deadband by the third as well."""
    named = weighing("causes")
    scores = _scores("causes", row)
    for cause, signs in SIGNS.items():
        if not any(getattr(row, sign) > least for sign, least in signs.items()):
            scores[named.outcomes.index(cause)] = -math.inf
    shares = np.exp(scores - scores.max())
    share = dict(zip(named.outcomes, (shares / shares.sum()).tolist(), strict=True))
    score = dict(zip(named.outcomes, scores.tolist(), strict=True))
    jump = (1.0 - JUMP) * (score["stiction"] - score["deadband"]) + JUMP * float(_scores("jumps", row)[0])
    band = share["stiction"] + share["deadband"]
    play = min(band * _probability(-jump), SAFE)
    return {**share, "stiction": band - play, "deadband": play}


def _scores(name: str, row: Features) -> NDArray[np.float64]:
    """Log odds by a table, shape (n_outcomes,)."""
    table = weighing(name)
    return table.constant + table.added([getattr(row, feature) for feature in table.features]).sum(axis=0)


def _weighed(row: Features, share: dict[str, float]) -> list[Counted]:
    """What each feature and the other tables add to the log odds."""
    sticks = weighing("sticks")
    values = [float(getattr(row, name)) for name in sticks.features]
    alike = min(max(share["stiction"] / (1.0 - share["deadband"]), FLOOR), 1.0 - FLOOR)
    usual = float(sticks.constant[0])
    plant = _fourth(row)
    usual_there = float(weighing("plant").constant[weighing("plant").outcomes.index("stiction")])
    kept = _probability(plant["plant"])
    first = 1.0 - kept * LESS
    return [
        Counted("usual", math.nan, math.nan, first * usual),
        Counted("likeness", alike, _probability(usual), (1.0 - kept) * OTHERS * math.log(alike / (1.0 - alike))),
        Counted("plant", _probability(plant["stiction"]), _probability(usual_there), kept * PLANT * plant["stiction"]),
        *map(Counted, sticks.features, values, sticks.usual.tolist(), (first * sticks.added(values)[:, 0]).tolist()),
    ]


def _probability(odds: float) -> float:
    """Probability of log odds, held where it can still be told from 0 and 1."""
    return 1.0 / (1.0 + math.exp(-min(max(odds, -50.0), 50.0)))
