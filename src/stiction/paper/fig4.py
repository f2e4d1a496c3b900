"""Fig. 4: the laboratory valve climbs the slower ramps in stairs."""

from __future__ import annotations

from stiction.paper.lab_valve import STAIRCASE_RATES, LabRamp, lab_ramp

__all__ = ["figure4"]


def figure4() -> tuple[LabRamp, ...]:
    """Ramps at 0.0125 and 0.01 %/s: stick, slip, stick.

    Returns Fig. 4a and 4b: OP and stem by model. The data are simulated with parameters read off the paper's text, as
    the recorded data are not available: r between 0.0125 and 0.0167 %/s, d = 5.1 %; the jump is assumed.

    The two-parameter model never sticks again on a ramp, so it cannot show this figure. The one-parameter model moves
    in stairs, but its jump equals its band: from 5 to 15 % with d = 5.1 % there is a single slip.

    References
    ----------
    srinivasan2008, Fig. 4 and section V.

    Examples
    --------
    >>> from stiction.paper import figure4
    >>> [ramp.behaviour["three parameters, corrected (eq. 5)"] for ramp in figure4()]
    ['staircase', 'staircase']
    """
    return tuple(lab_ramp(rate, "staircase") for rate in STAIRCASE_RATES)
