"""Replace a sticky valve by a repaired one, at the limits of a specification.

A repaired valve is not ideal. A customary limit is 1 % of span for deadband and resolution together (after
`entech1998`: the number is recalled, not quoted). Deadband is play without stiction, as everywhere in this package. In
(S, J),

    deadband = S - J,   resolution = J,   and so   S = deadband + resolution.

By default each gets half of the 1 %. The repaired loop may still have a limit cycle, as the specification allows it.

With a high process gain, a loop can oscillate with S of 1 % or less, so that its valve meets the specification before
any repair. The repair must then reach lower limits: deadband and resolution together are at most half of S.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from stiction.errors import require_not_negative
from stiction.limitcycle.continuous_form import continuous_form
from stiction.models import Kano

if TYPE_CHECKING:
    from stiction.models import Loop, Valve

__all__ = ["REPAIRED_DEADBAND", "REPAIRED_RESOLUTION", "repair", "residual_stiction", "stiction_of"]

REPAIRED_DEADBAND, REPAIRED_RESOLUTION = 0.5, 0.5
"""Deadband and resolution of a good valve [% of span]."""
MAX_RESIDUAL_SHARE = 0.5
"""Largest share of S that remains after a repair [-]."""


def stiction_of(valve: Valve) -> tuple[float, float] | None:
    """Return S and J of a valve [% of span]; None when its model has none.

    Examples
    --------
    >>> import stiction as st
    >>> stiction_of(st.Kano(5.0, 2.0)), stiction_of(st.Stenman(3.0)), stiction_of(st.Ideal())
    ((5.0, 2.0), (3.0, 3.0), None)
    """
    S, J = getattr(valve, "S", None), getattr(valve, "J", None)
    if S is not None and J is not None:
        return float(S), float(J)
    banded = continuous_form(valve)
    if banded is None or not banded.sb > 0.0:
        return None
    return float(banded.sb + banded.lag), float(banded.sb - banded.lag)


def residual_stiction(
    S: float, deadband: float = REPAIRED_DEADBAND, resolution: float = REPAIRED_RESOLUTION
) -> tuple[float, float]:
    """Return deadband and resolution after a repair [% of span]: the limits, but together at most half of `S`.

    Examples
    --------
    >>> residual_stiction(5.0), residual_stiction(0.8)
    ((0.5, 0.5), (0.2, 0.2))
    """
    narrowed = min(1.0, MAX_RESIDUAL_SHARE * S / max(deadband + resolution, 1e-12))
    return narrowed * deadband, narrowed * resolution


def repair(loop: Loop, deadband: float = REPAIRED_DEADBAND, resolution: float = REPAIRED_RESOLUTION) -> Loop:
    """Replace the sticky valve of a loop by a good one at the limits of the specification.

    Parameters
    ----------
    loop : Loop
        The loop; its compensator is removed.
    deadband, resolution : float
        Limits for the good valve [% of span]; together at most half of the sticky valve's S.

    Returns
    -------
    Loop
        The repaired loop; its slip jump is not larger than before.

    Raises
    ------
    ParameterError
        When a limit is negative.

    References
    ----------
    entech1998: the limit of 1 %, recalled.

    Examples
    --------
    >>> import stiction as st
    >>> from stiction.compensation import repair
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> repair(loop).valve.S, repair(loop).valve.J
    (1.0, 0.5)
    """
    deadband = require_not_negative("deadband", deadband, "% of span")
    resolution = require_not_negative("resolution", resolution, "% of span")
    J = resolution
    if stiction := stiction_of(loop.valve):
        deadband, resolution = residual_stiction(stiction[0], deadband, resolution)
        J = min(stiction[1], resolution)
    return replace(loop, valve=Kano(deadband + J, J, travel=loop.valve.travel), compensator=None)
