"""Scales on which findings are weighed: few are straight in what they say, and none may outweigh all others."""

from __future__ import annotations

import math

__all__ = ["better", "kept", "logarithm", "squashed"]

CHANCE = 8.0
"""Twice a log likelihood that chance gives the best of many valves [-]: no share of less says anything."""
LEAST_LEFT = 1e-3
"""Share of the PV's energy that is left unexplained at least [-]."""


def better(fit: float, fit_linear: float) -> float:
    """How much better a sticky valve explains the PV.

    Parameters
    ----------
    fit, fit_linear : float
        Shares of the PV that the sticky valve and a good one explain [%].

    Returns
    -------
    float
        Log of what the good one leaves over what the sticky one does, over 3, between 0 and 1 [-].
    """
    left, left_linear = (max(1.0 - share / 100.0, LEAST_LEFT) for share in (fit, fit_linear))
    return min(max(math.log(left_linear / left), 0.0) / 3.0, 1.0)


def logarithm(likelier: float) -> float:
    """Twice a log likelihood ratio on the scale of its logarithm.

    Parameters
    ----------
    likelier : float
        Twice the log likelihood ratio [-].

    Returns
    -------
    float
        ln(1 + its size) over 8, with its sign; 0 where it is not known [-].
    """
    return 0.0 if math.isnan(likelier) else math.copysign(math.log1p(abs(likelier)) / 8.0, likelier)


def kept(over_rival: float, over_good: float) -> float:
    """Share of its likelihood over a good valve that a sticky one keeps over another rival.

    Parameters
    ----------
    over_rival, over_good : float
        Twice the log likelihood by which it beats the rival and the good valve [-].

    Returns
    -------
    float
        The share, held at -1 and 1; 1 where there is no rival [-].
    """
    share = over_rival / max(over_good, CHANCE)
    return 1.0 if math.isnan(share) else min(max(share, -1.0), 1.0)


def squashed(statistic: float) -> float:
    """Vuong's statistic between -1 and 1.

    Parameters
    ----------
    statistic : float
        The statistic x [-].

    Returns
    -------
    float
        x / (3 + the size of x); 0 where it is not known [-].
    """
    return 0.0 if math.isnan(statistic) else statistic / (3.0 + abs(statistic))
