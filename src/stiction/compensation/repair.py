"""Fix the valve: what the loop would do with a good one, at the limits of a specification.

A repaired valve is not an ideal one. Specifications of control valves bound what is left together: about 1 % of span
of deadband and resolution (the nominal limit that is recalled of EnTech's Control Valve Dynamic Specification 3.0,
1998; the part of it that was opened says that a response to steps of "1 % and less" is expected: take the number as
"after" `entech1998`, not as a quotation). Here deadband is play alone, as everywhere. In (S, J) they are

    deadband = S - J,   resolution = J,   so that   S = deadband + resolution.

The default splits 1 % in two halves. The repaired loop may still cycle by itself, a hundredth of span wide; that is
what such a limit allows.

A loop whose process has a high gain makes a whole cycle of S = 1 % and less, with a valve that keeps the specification
before any repair. A repair that leaves it so is none: both limits are narrowed until they leave half of its S at most.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from stiction.errors import require_not_negative
from stiction.limitcycle.continuous_form import continuous_form
from stiction.models import Kano

if TYPE_CHECKING:
    from stiction.models import Loop, Valve

__all__ = ["DEADBAND", "RESOLUTION", "kept", "repair", "stiction_of"]

DEADBAND, RESOLUTION = 0.5, 0.5
"""What a good valve is allowed to keep [% of span]; 1 % together."""
MOST_KEPT = 0.5
"""Share of its S that a repair leaves at most [-]."""


def stiction_of(valve: Valve) -> tuple[float, float] | None:
    """S and J of a valve [% of span]; None where its model has none.

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


def kept(S: float, deadband: float = DEADBAND, resolution: float = RESOLUTION) -> tuple[float, float]:
    """Deadband and resolution that a repair may leave of `S` [% of span]: the limits, and half of S at most.

    Examples
    --------
    >>> kept(5.0), kept(0.8)
    ((0.5, 0.5), (0.2, 0.2))
    """
    narrowed = min(1.0, MOST_KEPT * S / max(deadband + resolution, 1e-12))
    return narrowed * deadband, narrowed * resolution


def repair(loop: Loop, deadband: float = DEADBAND, resolution: float = RESOLUTION) -> Loop:
    """Put a good valve, at the limits of the specification, in the place of the sticky one.

    Parameters
    ----------
    loop : Loop
        The loop; a compensator is taken out with the fault it was for.
    deadband, resolution : float
        What the good valve keeps at most [% of span], and no more than half of the sticky one's S.

    Returns
    -------
    Loop
        The repaired loop; no valve jumps further than before.

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
    J = resolution
    if stiction := stiction_of(loop.valve):
        deadband, resolution = kept(stiction[0], deadband, resolution)
        J = min(stiction[1], resolution)
    return replace(loop, valve=Kano(deadband + J, J, travel=loop.valve.travel), compensator=None)
