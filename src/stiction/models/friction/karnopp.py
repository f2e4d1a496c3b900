"""Karnopp's friction: up to static friction the stem stays at rest; below a speed tolerance it counts as at rest."""

from __future__ import annotations

import math

from stiction.models.friction.stribeck import stribeck
from stiction.models.numba_compile import inline_kernel

__all__ = ["karnopp_substep"]


@inline_kernel
def karnopp_substep(
    x: float, v: float, drive: float, h: float,
    mass: float, spring_rate: float, ease: float,
    coulomb: float, static: float, per_velocity: float, tolerance: float,
):  # fmt: skip
    r"""Move the stem on by `h` [s] under the force `drive` [N]; returns position [m] and velocity [m/s].

    `ease` is 1 / (m + h F_v) [1/kg] and `per_velocity` 1 / v_s [s/m].

    .. math:: v' = \frac{m v + h\,(F - K x - F(v))}{m + h F_v}, \qquad x' = x + h v'

    The viscous force is taken at the end of the sub-step, so that the method is stable for any damping. The
    position is updated after the velocity, so that the method neither amplifies nor damps the stem's oscillation. A
    steady slide is stable in this form exactly when it is stable in the differential equation.

    The stem rests while the force on it, eqs. 1-2 with E2 corrected, is at most the static friction; it comes to rest
    where its velocity changes sign, or falls below the tolerance while static friction can hold it.

    After Karnopp (1985).
    """
    force = drive - spring_rate * x
    if v == 0.0:
        if abs(force) <= static:
            return x, 0.0
        direction = math.copysign(1.0, force)
    else:
        direction = math.copysign(1.0, v)
    friction = direction * stribeck(v * per_velocity, coulomb, static)
    v_new = (mass * v + h * (force - friction)) * ease
    speed = v_new * direction
    if speed <= 0.0 or (speed < tolerance and speed <= v * direction and abs(force) <= static):
        return x, 0.0
    return x + h * v_new, v_new
