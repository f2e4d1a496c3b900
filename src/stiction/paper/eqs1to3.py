"""Eqs. 1 to 3 stepped in plain Python, with the force at rest as printed or corrected: the proof of E2.

A slow and simple second implementation of the physical valve in the paper's units (reading A): pound force, inch,
second.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import ParameterError, require_positive, require_samples

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Equations1to3", "equations1to3", "stribeck_friction"]

MASS = 3.0
"""Mass of stem and plug [lbf s2/in]."""
SPRING = 300.0
"""Spring rate [lbf/in]."""
VISCOUS = 3.5
"""Viscous coefficient [lbf s/in]."""
AREA = 100.0
"""Diaphragm area [in2]."""
COULOMB = 320.0
"""Coulomb friction [lbf]."""
STATIC = 384.0
"""Static friction [lbf]."""
STRIBECK = 0.01
"""Stribeck velocity [in/s]."""
VELOCITY_TOLERANCE = 1e-3
"""Speed below which the stem counts as at rest [in/s]."""
MAX_PRESSURE_PSI = 18.0
"""End of the ramp [psi]."""
DT_S = 1e-4
"""Time step [s]."""


@dataclass(frozen=True)
class Equations1to3:
    """The ramp of slope 4 with the force at rest of eq. 2 as printed and corrected."""

    time: NDArray[np.float64] = field(repr=False)
    """Time [s], shape (n_samples,)."""
    pressure: NDArray[np.float64] = field(repr=False)
    """Pressure on the diaphragm [psi], shape (n_samples,)."""
    position: dict[str, NDArray[np.float64]] = field(repr=False)
    """Stem, `printed` and `corrected` [in], each of shape (n_samples,)."""
    starts: dict[str, int]
    """Times the stem started from rest, `printed` and `corrected` [-]."""
    longest_rest: dict[str, float]
    """Longest rest after the first start, `printed` and `corrected` [s]."""
    force_at_rest: float
    """Force on the stem at its first rest after a slip, P A - K x [lbf]."""
    friction: dict[str, float]
    """Friction of eq. 2 at that rest, `printed` and `corrected` [lbf]."""


def stribeck_friction(speed: float, *, as_printed: bool = False) -> float:
    """Eq. 3 at a positive speed [in/s]: friction [lbf], infinite on overflow; E1 is corrected unless `as_printed`.

    Examples
    --------
    >>> from stiction.paper.eqs1to3 import stribeck_friction
    >>> stribeck_friction(1.0), stribeck_friction(1.0, as_printed=True)
    (320.0, inf)
    """
    exponent = (speed / STRIBECK) ** 2
    try:
        return COULOMB + (STATIC - COULOMB) * math.exp(exponent if as_printed else -exponent)
    except OverflowError:
        return math.inf


def equations1to3(slope: float = 4.0) -> Equations1to3:
    """Ramp the pressure at `slope` [psi/s] with Fe = P A as printed and Fe = P A - K x.

    Returns as printed, the force at rest ignores the spring. Once above static friction it stays above it, so that
    friction F_s exceeds the real force and drives the stem, which then chatters (the number of starts depends on the
    time step). Eq. 3 has E1 corrected in both forms, because it overflows otherwise. Raises ParameterError when `slope`
    is not positive, or so low or high that the ramp is too long or the stem never comes to rest.

    References
    ----------
    srinivasan2008, eqs. 1 to 3; karnopp1985 for the velocity tolerance.

    Examples
    --------
    >>> from stiction.paper.eqs1to3 import equations1to3
    >>> equations1to3().starts["corrected"]
    5
    """
    slope = require_positive("slope", slope, "psi/s")
    require_samples("the ramp", MAX_PRESSURE_PSI / slope, DT_S)
    n = round(MAX_PRESSURE_PSI / slope / DT_S) + 1
    time = DT_S * np.arange(n, dtype=np.float64)
    pressure = slope * time
    position, starts, rests, first = {}, {}, {}, 0
    for form, spring in (("printed", 0.0), ("corrected", SPRING)):
        stem, moving = _run(pressure.tolist(), spring)
        edge = np.diff(moving.astype(np.int8), prepend=0)
        begins, ends = np.flatnonzero(edge > 0), np.flatnonzero(edge < 0)
        gaps = begins[1:] - ends[: begins.size - 1]
        position[form], starts[form] = stem, int(begins.size)
        rests[form] = DT_S * float(gaps.max(initial=0))
        if not ends.size:
            raise ParameterError(
                f"slope = {slope:g} psi/s is too high for the stem to come to rest; give a lower slope."
            )
        first = int(ends[0])
    force_at_rest = float(AREA * pressure[first] - SPRING * position["corrected"][first])
    friction = {"printed": STATIC if AREA * pressure[first] >= STATIC else force_at_rest, "corrected": force_at_rest}
    return Equations1to3(time, pressure, position, starts, rests, force_at_rest, friction)


def _run(pressure: list[float], spring_at_rest: float) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Step eqs. 1 to 3 over a pressure of n_samples: stem [in] and whether it moves, each of shape (n_samples,)."""
    stem, moving = np.zeros(len(pressure)), np.zeros(len(pressure), dtype=np.bool_)
    x = v = 0.0
    for k, psi in enumerate(pressure):
        force_at_rest = psi * AREA - spring_at_rest * x
        if abs(v) >= VELOCITY_TOLERANCE:
            friction = math.copysign(stribeck_friction(abs(v)), v)
        elif abs(force_at_rest) < STATIC:
            friction, v = psi * AREA - SPRING * x, 0.0
        else:
            friction = math.copysign(STATIC, force_at_rest)
        before = v
        v += DT_S * (psi * AREA - SPRING * x - VISCOUS * v - friction) / MASS
        if before * v < 0.0:
            v = 0.0
        x += DT_S * v
        stem[k], moving[k] = x, abs(v) >= VELOCITY_TOLERANCE
    return stem, moving
