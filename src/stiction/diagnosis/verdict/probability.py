"""From what the identification found to one probability.

Three numbers per comparison, averaged over the two comparisons of a record (about the moving average over one
period, and about the mean of the whole record) with the squared share of the PV each explains as weight:

- band: S over the OP's swing. A loop that cycles because of its valve moves its OP through the band and little
  more (OP_pp >= S), while noise and drift fit bands of a tenth of the swing;
- advantage: ln(error of the best good valve / error of the sticky valve), each with its own best process, held
  at most `ADVANTAGE_CAP`;
- fit: the share of the PV's variation that the sticky valve explains.

The weights are those of a logistic regression on simulated loops of `simulation.population` (seed 21, weight 0.3)
and on the real records that are labelled, each loop weighing one, with a small ridge. Left out one at a time, the
real loops are judged as `stiction benchmark` and the documentation print it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.diagnosis.result import Identification

__all__ = ["UNDECIDED", "Features", "features", "jump_probability", "probability"]

WEIGHTS = (-6.21, 8.69, 3.48, 1.20)
"""Constant, band, advantage, fit."""
ADVANTAGE_CAP = 0.7
LEAST_FIT = 0.02
"""Share explained below which a comparison weighs no less [-]."""
UNDECIDED = (0.4, 0.6)
"""Probabilities between which nothing is called."""
RESERVATION = 0.85
"""What the log odds keep for each reservation about the data."""


class Features(NamedTuple):
    """What the probability is computed from."""

    band: float
    """S over the OP's swing [-]."""
    advantage: float
    """ln(error of a good valve / error of the sticky one), capped [-]."""
    fit: float
    """Share of the PV's variation explained by the sticky valve [-]."""


def features(found: Sequence[Identification], swing: float) -> Features:
    """Average the comparisons of one record.

    Parameters
    ----------
    found : sequence of Identification
        One per comparison.
    swing : float
        Peak to peak of the OP [% of span].

    Returns
    -------
    Features
        Band, advantage and fit.
    """
    rows = np.array([_row(one, swing) for one in found])
    weights = np.maximum(rows[:, 2], LEAST_FIT) ** 2
    return Features(*(float(x) for x in weights @ rows / weights.sum()))


def _row(one: Identification, swing: float) -> tuple[float, float, float]:
    left, left_linear = (max(1.0 - fit / 100.0, 1e-3) for fit in (one.fit, one.fit_linear))
    advantage = min(max(math.log(left_linear / left), 0.0), ADVANTAGE_CAP)
    return one.S / swing, advantage, max(one.fit / 100.0, 0.0)


def probability(found: Features, reservations: int = 0) -> float:
    """Probability that the valve sticks or has play [-].

    Parameters
    ----------
    found : Features
        Band, advantage and fit.
    reservations : int
        Number of doubts about the data; each draws the odds towards even.

    Returns
    -------
    float
        The probability.

    Examples
    --------
    >>> probability(Features(0.8, 0.7, 0.95)) > 0.95, probability(Features(0.05, 0.0, 0.99)) < 0.05
    (True, True)
    """
    odds = WEIGHTS[0] + sum(w * x for w, x in zip(WEIGHTS[1:], found, strict=True))
    return 1.0 / (1.0 + math.exp(-odds * RESERVATION**reservations))


def jump_probability(found: Identification, cycles: float) -> float:
    """Probability that the stem jumps, rather than only has play (J = 0), given that it does not follow.

    Parameters
    ----------
    found : Identification
        With its error surface, whose first column is J = 0.
    cycles : float
        Periods in the record [-]; two slips in each are what J is seen in.

    Returns
    -------
    float
        Probability by the likelihood ratio of the best valve with J = 0 and the best of all.
    """
    play = float(found.surface.error[:, 0].min())
    best = min(float(found.surface.error.min()), play)
    if best <= 0.0:
        return 0.0 if play <= 0.0 else 1.0
    return 1.0 - math.exp(-2.0 * max(cycles, 1.0) * math.log(play / best))
