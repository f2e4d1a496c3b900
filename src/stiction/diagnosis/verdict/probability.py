"""From what the identification found to one probability.

A record is compared twice, about the moving average over one period and about its mean; each comparison gives

- band: S over the OP's swing, held at 0.7. A loop that cycles because of its valve moves its OP through the band
  and little more (OP_pp >= S), while noise and drift fit bands of a tenth of the swing;
- floor: the lower end of S's interval over the OP's swing, held at 0.5;
- advantage: ln(error of the best good valve / error of the sticky valve), each with its own best process, held
  at 0.7;
- grip: the band times the share of the PV's variation that the sticky valve explains.

The features are averages over the two, weighed by the share each explains; where the loop oscillates the comparison
about the period weighs three times as much. The weights are those of a logistic regression with a small ridge
(0.03) on 270 loops of `simulation.population` (seeds 31 and 32, 150 loops each; deadband left out, since it is told
apart by J) and on the labelled real records, each loop weighing one and both sets weighing the same.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.diagnosis.result import Identification

__all__ = ["UNDECIDED", "Features", "features", "probability"]

WEIGHTS = (-5.61, 5.61, 3.18, 2.84, 5.07)
"""Constant, band, advantage, grip, floor."""
BAND_CAP, ADVANTAGE_CAP, FLOOR_CAP = 0.7, 0.7, 0.5
LEAST_FIT = 0.02
"""Share explained below which a comparison weighs no less [-]."""
PERIOD_WEIGHT = 3.0
"""How much more the comparison about the period of an oscillating loop weighs [-]."""
UNDECIDED = (0.4, 0.6)
"""Probabilities between which nothing is called."""
RESERVATION = 0.85
"""What the log odds keep for each reservation about the data."""


class Features(NamedTuple):
    """What the probability is computed from."""

    band: float
    """S over the OP's swing, capped [-]."""
    advantage: float
    """ln(error of a good valve / error of the sticky one), capped [-]."""
    grip: float
    """Band times the share of the PV's variation explained by the sticky valve [-]."""
    floor: float
    """Lower end of S's interval over the OP's swing, capped [-]."""


def features(found: Sequence[Identification], swing: float, *, oscillating: bool) -> Features:
    """Average the comparisons of one record.

    Parameters
    ----------
    found : sequence of Identification
        One per comparison; where there are two, the first is the one about the period.
    swing : float
        Peak to peak of the OP [% of span].
    oscillating : bool
        Whether the loop oscillates.

    Returns
    -------
    Features
        Band, advantage, grip and floor.
    """
    weights = np.array([max(one.fit / 100.0, LEAST_FIT) for one in found])
    if oscillating and len(found) > 1:
        weights[0] *= PERIOD_WEIGHT
    rows = np.array([_row(one, swing) for one in found])
    band, advantage, fit, floor = (float(x) for x in weights @ rows / weights.sum())
    return Features(min(band, BAND_CAP), advantage, band * fit, min(floor, FLOOR_CAP))


def _row(one: Identification, swing: float) -> tuple[float, float, float, float]:
    left, left_linear = (max(1.0 - fit / 100.0, 1e-3) for fit in (one.fit, one.fit_linear))
    advantage = min(max(math.log(left_linear / left), 0.0), ADVANTAGE_CAP)
    return one.S / swing, advantage, max(one.fit / 100.0, 0.0), one.S_low / swing


def probability(found: Features, reservations: int = 0) -> float:
    """Probability that the valve sticks or has play [-].

    Parameters
    ----------
    found : Features
        Band, advantage, grip and floor.
    reservations : int
        Number of doubts about the data; each draws the odds towards even.

    Returns
    -------
    float
        The probability.

    Examples
    --------
    >>> probability(Features(0.7, 0.7, 0.65, 0.5)) > 0.95, probability(Features(0.05, 0.0, 0.05, 0.0)) < 0.05
    (True, True)
    """
    odds = WEIGHTS[0] + sum(w * x for w, x in zip(WEIGHTS[1:], found, strict=True))
    return 1.0 / (1.0 + math.exp(-odds * RESERVATION**reservations))
