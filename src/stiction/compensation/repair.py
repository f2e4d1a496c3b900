"""Fix the valve: what the loop would do with a good one, at the limits of a specification.

A repaired valve is not an ideal one. Specifications of control valves bound what is left together: about 1 % of span
of deadband and resolution (the nominal limit that is recalled of EnTech's Control Valve Dynamic Specification 3.0,
1998; the part of it that was opened says that a response to steps of "1 % and less" is expected: take the number as
"after" `entech1998`, not as a quotation). Both are measured by step tests; in (S, J) they are

    deadband = S - J,   resolution = J,   so that   S = deadband + resolution.

The default splits 1 % in two halves. The repaired loop may still cycle by itself, a hundredth of span wide; that is
what such a limit allows.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from stiction.errors import require_not_negative
from stiction.models import Kano

if TYPE_CHECKING:
    from stiction.models import Loop

__all__ = ["DEADBAND", "RESOLUTION", "repair"]

DEADBAND, RESOLUTION = 0.5, 0.5
"""What a good valve is allowed to keep [% of span]; 1 % together."""


def repair(loop: Loop, deadband: float = DEADBAND, resolution: float = RESOLUTION) -> Loop:
    """Put a good valve, at the limits of the specification, in the place of the sticky one.

    Parameters
    ----------
    loop : Loop
        The loop; a compensator is taken out with the fault it was for.
    deadband, resolution : float
        What the good valve keeps [% of span].

    Returns
    -------
    Loop
        The repaired loop; a valve that is better than the limits stays as it is, and none jumps further than before.

    Raises
    ------
    ParameterError
        When a limit is negative.

    References
    ----------
    entech1998: the limit of 1 %, after it.

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
    good = Kano(deadband + resolution, resolution, travel=loop.valve.travel)
    if isinstance(loop.valve, Kano):
        J = min(loop.valve.J, good.J)
        good = loop.valve if loop.valve.S <= good.S else replace(good, S=deadband + J, J=J)
    return replace(loop, valve=good, compensator=None)
