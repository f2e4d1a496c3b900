"""LuGre friction: bristles that bend before the stem slides, so that friction is continuous at rest."""

from __future__ import annotations

from stiction.models.friction.stribeck import stribeck
from stiction.models.numba_compile import inline_kernel

__all__ = ["lugre_rest", "lugre_substep"]


@inline_kernel
def lugre_rest(force: float, static: float, stiffness: float) -> float:
    """Deflection of the bristles [m] that holds the stem at rest against `force` [N], as far as they can."""
    return min(max(force, -static), static) / stiffness


@inline_kernel
def lugre_substep(
    x: float, v: float, z: float, drive: float, h: float,
    mass: float, spring_rate: float, viscous: float,
    coulomb: float, static: float, per_velocity: float, stiffness: float, damping: float,
):  # fmt: skip
    r"""Move the stem on by `h` [s] under the force `drive` [N]; returns position, velocity and deflection.

    .. math:: \dot z = v - \frac{\sigma_0 |v|}{g(v)} z, \qquad F = \sigma_0 z + \sigma_1 \dot z + F_v v

    with Stribeck's curve as g(v); `per_velocity` is 1 / v_s [s/m]. Deflection and viscous force are taken at the
    end of the sub-step (a linear equation in the new velocity), |v| / g(v) at its beginning: stable for any
    stiffness of the bristles.

    After Canudas de Wit, Olsson, Astrom and Lischinsky (1995).
    """
    yielding = 1.0 + h * stiffness * abs(v) / stribeck(v * per_velocity, coulomb, static)
    bristle_force = stiffness * z / yielding + damping * z * (1.0 / yielding - 1.0) / h
    resisting = (stiffness * h + damping) / yielding + viscous
    v_new = (mass * v + h * (drive - spring_rate * x - bristle_force)) / (mass + h * resisting)
    z_new = (z + h * v_new) / yielding
    return x + h * v_new, v_new, z_new
