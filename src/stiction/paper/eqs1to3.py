"""Eqs. 1 to 3 stepped in plain Python, with the force at rest as printed or corrected: the proof of E2.

A slow, obvious twin of the physical valve in the paper's units (reading A): pound force, inch, second.
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

MASS, SPRING, VISCOUS, AREA = 3.0, 300.0, 3.5, 100.0
COULOMB, STATIC, STRIBECK = 320.0, 384.0, 0.01
TOLERANCE = 1e-3
TOP = 18.0
DT = 1e-4


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
    held: float
    """Force on the stem at its first rest after a slip, P A - K x [lbf]."""
    friction: dict[str, float]
    """Friction that eq. 2 answers there with, `printed` and `corrected` [lbf]."""


def stribeck_friction(speed: float, *, as_printed: bool = False) -> float:
    """Eq. 3 at a positive speed [in/s]: friction [lbf], infinite where it overflows; E1 mended unless as printed.

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

    Returns
    -------
    Equations1to3
        As printed the force at rest stays above the static friction once it is, whatever the spring does: friction
        answers with F_s to a smaller force and drives the stem instead of holding it, which chatters ever after (how
        often depends on the step). Eq. 3 has E1 mended in both, as it overflows otherwise.

    Raises
    ------
    ParameterError
        When `slope` is not positive, or so low or high that the ramp is too long or the stem never comes to rest.

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
    require_samples("the ramp", TOP / slope, DT)
    n = round(TOP / slope / DT) + 1
    time = DT * np.arange(n, dtype=np.float64)
    pressure = slope * time
    position, starts, rests, first = {}, {}, {}, 0
    for form, spring in (("printed", 0.0), ("corrected", SPRING)):
        stem, moving = _run(pressure.tolist(), spring)
        edge = np.diff(moving.astype(np.int8), prepend=0)
        begins, ends = np.flatnonzero(edge > 0), np.flatnonzero(edge < 0)
        gaps = begins[1:] - ends[: begins.size - 1]
        position[form], starts[form] = stem, int(begins.size)
        rests[form] = DT * float(gaps.max(initial=0))
        if not ends.size:
            raise ParameterError(f"slope = {slope:g} psi/s leaves the stem no time to come to rest; give a lower one.")
        first = int(ends[0])
    held = float(AREA * pressure[first] - SPRING * position["corrected"][first])
    friction = {"printed": STATIC if AREA * pressure[first] >= STATIC else held, "corrected": held}
    return Equations1to3(time, pressure, position, starts, rests, held, friction)


def _run(pressure: list[float], spring_at_rest: float) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Step eqs. 1 to 3 over a pressure of n_samples: stem [in] and whether it moves, each of shape (n_samples,)."""
    stem, moving = np.zeros(len(pressure)), np.zeros(len(pressure), dtype=np.bool_)
    x = v = 0.0
    for k, psi in enumerate(pressure):
        held = psi * AREA - spring_at_rest * x
        if abs(v) >= TOLERANCE:
            friction = math.copysign(stribeck_friction(abs(v)), v)
        elif abs(held) < STATIC:
            friction, v = psi * AREA - SPRING * x, 0.0
        else:
            friction = math.copysign(STATIC, held)
        before = v
        v += DT * (psi * AREA - SPRING * x - VISCOUS * v - friction) / MASS
        if before * v < 0.0:
            v = 0.0
        x += DT * v
        stem[k], moving[k] = x, abs(v) >= TOLERANCE
    return stem, moving
