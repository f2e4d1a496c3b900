"""Kernels of the physical valve: one step while friction holds the stem, sub-steps while it can move."""

from __future__ import annotations

import math
from typing import NamedTuple

from stiction.models.component import ValveState
from stiction.models.friction.karnopp import karnopp_substep
from stiction.models.friction.lugre import lugre_rest, lugre_substep
from stiction.models.numba_compile import inline_kernel, kernel
from stiction.models.positioner import positioner_step

__all__ = ["PhysicalParameters", "physical_at_rest", "physical_parameters", "physical_step"]

MIN_FORCE_SHARE = 1e-9
"""Force over static friction below which a force counts as zero [-]."""


class PhysicalParameters(NamedTuple):
    """Parameters of the kernels of the physical valve, in SI units."""

    lugre: float
    """1 for LuGre friction, 0 for Karnopp's [-]."""
    ramped: float
    """1 where the input moves in a straight line through the sample, 0 where it is held [-]."""
    n: float
    """Sub-steps in a sample [-]."""
    h: float
    """Sub-step [s]."""
    keep: float
    """Share of the pressure that remains after a sub-step of the lag [-]."""
    keep_sample: float
    """Share that remains after a sample [-]."""
    keep_mean: float
    """Mean of that share over a sample [-]."""
    mass: float
    """Moving mass [kg]."""
    spring_rate: float
    """Spring rate [N/m]."""
    viscous: float
    """Viscous coefficient [N s/m]."""
    coulomb: float
    """Coulomb friction [N]."""
    static: float
    """Static friction [N]."""
    per_velocity: float
    """Reciprocal of the Stribeck velocity [s/m]."""
    ease: float
    """1 / (m + h F_v) [1/kg]."""
    tolerance: float
    """Karnopp's velocity tolerance [m/s]."""
    stiffness: float
    """Stiffness of the bristles [N/m]."""
    damping: float
    """Damping of the bristles [N s/m]."""
    scale: float
    """Stroke in 1 % of travel [m]."""
    bottom: float
    """Lower end stop [m]."""
    top: float
    """Upper end stop [m]."""
    rest_force: float
    """Force on the stem that does not depend on air, position or motion [N]."""
    area: float
    """Diaphragm area, negative where air closes the valve [m2]."""
    pressure: float
    """Pressure at 0 % OP [Pa]."""
    per_percent: float
    """Pressure per 1 % OP [Pa]."""
    low: float
    """Lowest signal to the actuator [% of span]."""
    high: float
    """Highest signal to the actuator [% of span]."""
    gain: float
    """Gain of the positioner, 0 where there is none [-]."""
    per_second: float
    """Reciprocal of the integral time of the positioner [1/s]."""
    deadband: float
    """Deadband of the positioner [% of span]."""


@inline_kernel
def physical_parameters(p) -> PhysicalParameters:
    """Unpack the parameters by name, once before the samples, so that they stay in registers."""
    return PhysicalParameters(
        p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11], p[12], p[13], p[14], p[15],
        p[16], p[17], p[18], p[19], p[20], p[21], p[22], p[23], p[24], p[25], p[26], p[27], p[28], p[29], p[30],
    )  # fmt: skip


@inline_kernel
def _signal(op: float, position: float, integral: float, dt: float, q: PhysicalParameters):
    """Signal to the actuator [% of span] and the positioner's integral after `dt` [s]."""
    return positioner_step(op, position, integral, dt, q.gain, q.per_second, q.deadband, q.low, q.high)


@kernel
def physical_at_rest(op: float, position: float, p) -> ValveState:
    """Stem without speed at `position`, the actuator's pressure settled at the input `op`."""
    q = physical_parameters(p)
    op = min(max(op, q.low), q.high)
    pressure = q.pressure + q.per_percent * op
    bristles = 0.0
    if q.lugre != 0.0:
        force = q.rest_force + q.area * pressure - q.spring_rate * q.scale * position
        bristles = lugre_rest(force, q.static, q.stiffness)
    return ValveState(position, op, position, 0.0, 0.0, 0.0, 0.0, bristles, pressure, 0.0)


@inline_kernel
def _is_held(op: float, begin: float, s: ValveState, q: PhysicalParameters) -> bool:
    """Whether friction or an end stop holds a stem at rest whatever the pressure can become in the sample."""
    low, high = min(begin, op), max(begin, op)
    if q.gain != 0.0:
        wander = q.gain * max(abs(begin - s.position), abs(op - s.position)) * q.per_second * q.n * q.h
        first, _ = _signal(begin, s.position, s.integral, 0.0, q)
        last, _ = _signal(op, s.position, s.integral, 0.0, q)
        low = max(min(first, last) - wander, q.low)
        high = min(max(first, last) + wander, q.high)
    early = q.area * (q.pressure + q.per_percent * low)
    other = q.area * (q.pressure + q.per_percent * high)
    now = q.area * s.pressure
    x = q.scale * s.position
    rest = q.rest_force - q.spring_rate * x
    pulled = rest + min(early, other, now) < -q.static and x > q.bottom
    pushed = rest + max(early, other, now) > q.static and x < q.top
    return not (pulled or pushed)


@inline_kernel
def _rest_for_sample(op: float, begin: float, s: ValveState, q: PhysicalParameters) -> ValveState:
    """Hold the stem for a sample: only the pressure and the positioner's integral change, in closed form."""
    first, last, integral = begin, op, s.integral
    if q.gain != 0.0:
        first, _ = _signal(begin, s.position, s.integral, 0.0, q)
        _, integral = _signal(0.5 * (begin + op), s.position, s.integral, q.n * q.h, q)
        last, _ = _signal(op, s.position, integral, 0.0, q)
    pressure = (
        q.keep_sample * s.pressure
        + (1.0 - q.keep_sample) * q.pressure
        + q.per_percent * ((q.keep_mean - q.keep_sample) * first + (1.0 - q.keep_mean) * last)
    )
    return ValveState(s.position, op, s.rest, 0.0, 0.0, op - s.op, 0.0, s.force, pressure, integral)


@inline_kernel
def _is_settled(op: float, s: ValveState, q: PhysicalParameters) -> bool:
    """Whether input, pressure and bristles of a stem at rest are where they were."""
    force = q.rest_force + q.area * s.pressure - q.spring_rate * q.scale * s.position - q.stiffness * s.force
    settled = s.pressure == q.pressure + q.per_percent * op
    return op == s.op and settled and q.gain == 0.0 and abs(force) <= MIN_FORCE_SHARE * q.static


@inline_kernel
def physical_step(op: float, s: ValveState, q: PhysicalParameters) -> ValveState:
    """One sample: one step while friction holds the stem, sub-steps while it can move."""
    op = min(max(op, q.low), q.high)
    begin = s.op if q.ramped != 0.0 else op
    if s.velocity == 0.0:
        if q.lugre == 0.0:
            if _is_held(op, begin, s, q):
                return _rest_for_sample(op, begin, s, q)
        elif _is_settled(op, s, q):
            return s
    n = int(q.n)
    x, v, z, pressure, integral = q.scale * s.position, s.velocity, s.force, s.pressure, s.integral
    signal = min(max(op, q.low), q.high)
    slope = (op - begin) / q.n
    for i in range(n):
        if q.gain != 0.0:
            signal, integral = _signal(begin + slope * (i + 1), x / q.scale, integral, q.h, q)
        elif slope != 0.0:
            signal = begin + slope * (i + 1)
        pressure = q.keep * pressure + (1.0 - q.keep) * (q.pressure + q.per_percent * signal)
        drive = q.rest_force + q.area * pressure
        if q.lugre == 0.0:
            x, v = karnopp_substep(
                x, v, drive, q.h, q.mass, q.spring_rate, q.ease,
                q.coulomb, q.static, q.per_velocity, q.tolerance,
            )  # fmt: skip
        else:
            x, v, z = lugre_substep(
                x, v, z, drive, q.h, q.mass, q.spring_rate, q.viscous,
                q.coulomb, q.static, q.per_velocity, q.stiffness, q.damping,
            )  # fmt: skip
        if x < q.bottom:
            x, v = q.bottom, max(v, 0.0)
        elif x > q.top:
            x, v = q.top, min(v, 0.0)
    moving = 1.0 if v != 0.0 else 0.0
    direction = math.copysign(moving, v)
    return ValveState(x / q.scale, op, s.rest, direction, moving, op - s.op, v, z, pressure, integral)
