"""Fig. 3: the laboratory valve follows the faster ramps."""

from __future__ import annotations

from stiction.paper.lab_valve import FOLLOWED_RATES, LabRamp, lab_ramp

__all__ = ["figure3"]


def figure3() -> tuple[LabRamp, ...]:
    """Ramps at 0.0667 and 0.0167 %/s: stick, jump, follow.

    Returns Fig. 3a and 3b: OP and stem by model. The data are simulated with parameters read off the paper's text, as
    the recorded data are not available: r between 0.0125 and 0.0167 %/s, d = 5.1 %; the jump is assumed.

    The one-parameter model moves in stairs at every rate, so it cannot show this figure; the two-parameter model and
    eq. 5 show it. Eq. 5 as printed shows it too, with an error below one increment of the OP.

    References
    ----------
    srinivasan2008, Fig. 3 and section V.

    Examples
    --------
    >>> from stiction.paper import figure3
    >>> [ramp.behaviour["three parameters, corrected (eq. 5)"] for ramp in figure3()]
    ['follow', 'follow']
    """
    return tuple(lab_ramp(rate, "follow") for rate in FOLLOWED_RATES)
