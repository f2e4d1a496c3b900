"""From what the identification found to one probability.

A record is compared twice, about the moving average over one period and about its mean; each comparison gives

- band: S over the OP's swing, held at 0.7. A loop that cycles because of its valve moves its OP through the band
  and little more (OP_pp >= S), while noise and drift fit bands of a tenth of the swing;
- advantage: ln(error of the best good valve / error of the sticky valve), each with its own best process, held
  at 0.7;
- grip: the band times the share of the PV's variation that the sticky valve explains.

The features are averages over the two, weighed by the share each explains. The weights are those of a logistic
regression with a small ridge on 270 loops of `simulation.population` (seeds 31 and 32; deadband left out, since it is
told apart by J) and on the labelled real records, each loop weighing one and both sets weighing the same.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.diagnosis.result import Identification

__all__ = ["UNDECIDED", "Features", "features", "probability"]

WEIGHTS = (-5.73, 6.63, 4.67, 4.00)
"""Constant, band, advantage, grip."""
BAND_CAP, ADVANTAGE_CAP = 0.7, 0.7
LEAST_FIT = 0.02
"""Share explained below which a comparison weighs no less [-]."""
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
        Band, advantage and grip.
    """
    weights = np.array([max(one.fit / 100.0, LEAST_FIT) for one in found])
    rows = np.array([_row(one, swing) for one in found])
    band, advantage, fit = (float(x) for x in weights @ rows / weights.sum())
    return Features(min(band, BAND_CAP), advantage, band * fit)


def _row(one: Identification, swing: float) -> tuple[float, float, float]:
    left, left_linear = (max(1.0 - fit / 100.0, 1e-3) for fit in (one.fit, one.fit_linear))
    advantage = min(max(math.log(left_linear / left), 0.0), ADVANTAGE_CAP)
    return one.S / swing, advantage, max(one.fit / 100.0, 0.0)


def probability(found: Features, reservations: int = 0) -> float:
    """Probability that the valve sticks or has play [-].

    Parameters
    ----------
    found : Features
        Band, advantage and grip.
    reservations : int
        Number of doubts about the data; each draws the odds towards even.

    Returns
    -------
    float
        The probability.

    Examples
    --------
    >>> probability(Features(0.7, 0.7, 0.65)) > 0.95, probability(Features(0.05, 0.0, 0.05)) < 0.05
    (True, True)
    """
    odds = WEIGHTS[0] + sum(w * x for w, x in zip(WEIGHTS[1:], found, strict=True))
    return 1.0 / (1.0 + math.exp(-odds * RESERVATION**reservations))
