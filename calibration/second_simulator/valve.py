"""A control valve as a mass with Karnopp friction, moved by a spring-and-diaphragm actuator.

The equation of motion is scaled by the spring: forces are in % of span, so that a force of 1 % moves a valve without
friction by 1 % (Karnopp 1985; Stribeck curve as in Armstrong-Helouvry 1994).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba as nb
import numpy as np

__all__ = ["RampLoop", "ValveParameters", "measure_ramp_loop", "move_stem"]

KARNOPP_VELOCITY = 0.01
"""Velocity below which the stem counts as at rest [% of span per s]."""
RAMP_STEP = 0.004
"""Step of OP per second of the slow ramp, as a share of the friction band [-]."""


class ValveParameters(NamedTuple):
    """What the stem and its actuator are made of."""

    static: float
    """Static friction [% of span]."""
    coulomb: float
    """Coulomb friction [% of span]."""
    stribeck_velocity: float
    """Velocity at which the friction has fallen most of the way from static to Coulomb [% of span per s]."""
    frequency: float
    """Natural frequency of mass and spring [rad/s]."""
    damping: float
    """Damping ratio [-]."""
    air_lag: float
    """Time constant of the actuator's pressure [s]."""


class RampLoop(NamedTuple):
    """What a slow ramp of OP up and down shows of a valve."""

    S: float
    """Mean width of the loop of OP and position, deadband plus stickband [% of span]."""
    J: float
    """Slip jump [% of span]."""


@nb.njit(cache=True, nogil=True)
def move_stem(op, duration, pressure, position, velocity, valve):
    """Move the stem for a time with OP at rest; return pressure, position and velocity at the end.

    At rest the time of the next break-away is computed in closed form; a stem in motion is integrated.
    """
    static, coulomb, stribeck, frequency, damping, lag = valve
    h = 0.1 / frequency
    decay = math.exp(-h / lag)
    left = duration
    while left > 1e-9:
        if velocity == 0.0:
            force = pressure - position
            if abs(force) <= static:
                goal = position + math.copysign(static, op - position)
                wait = left
                if abs(op - position) - static > 1e-12:
                    wait = min(lag * math.log((pressure - op) / (goal - op)) + 0.2 * h, left)
                pressure = op + (pressure - op) * math.exp(-wait / lag)
                left -= wait
                continue
            direction = math.copysign(1.0, force)
        else:
            direction = math.copysign(1.0, velocity)
        ratio = velocity / stribeck
        friction = coulomb + (static - coulomb) * math.exp(-ratio * ratio)
        push = frequency * frequency * (pressure - position - direction * friction)
        faster = (velocity + h * push) / (1.0 + 2.0 * damping * frequency * h)
        pressure = op + (pressure - op) * decay
        left -= h
        if velocity * faster < 0.0 or (abs(faster) < KARNOPP_VELOCITY and abs(pressure - position) <= static):
            velocity = 0.0
            continue
        velocity = faster
        position += h * velocity
        if position < 0.0 or position > 100.0:
            position = min(max(position, 0.0), 100.0)
            velocity = 0.0
            if abs(pressure - position) > static:  # pressed against the seat
                pressure = op + (pressure - op) * math.exp(-left / lag)
                left = 0.0
    return pressure, position, velocity


def measure_ramp_loop(valve: ValveParameters) -> RampLoop:
    """Ramp OP slowly up and down and measure the loop of OP and stem position.

    Parameters
    ----------
    valve : ValveParameters
        The valve.

    Returns
    -------
    RampLoop
        S is the area of the loop over its height, J twice the force at which the stem breaks away, less S.

    Examples
    --------
    >>> loop = measure_ramp_loop(ValveParameters(2.0, 2.0, 1.0, 40.0, 1.0, 0.5))
    >>> round(loop.S, 1), abs(loop.J) < 0.1
    (4.0, True)
    """
    step = RAMP_STEP * max(valve.static + valve.coulomb, 0.05)
    reach = 6.0 * (valve.static + valve.coulomb) + 1.0
    low, high = 50.0 - 0.5 * reach, 50.0 + 0.5 * reach
    up = np.arange(low, high, step)
    op = np.concatenate([up, up[::-1], up, up[::-1]])
    position = _ramp(op, tuple(valve))
    half = up.size * 2
    op, position = op[half:], position[half:]
    area = abs(float(np.sum(0.5 * (op[1:] + op[:-1]) * np.diff(position))))
    height = float(np.ptp(position))
    if height < 1e-6:
        return RampLoop(2.0 * valve.static, 2.0 * valve.static)
    S = area / height
    force = np.abs(op - position)
    middle = np.abs(op - 50.0) < 0.25 * reach
    return RampLoop(S, max(2.0 * float(np.quantile(force[middle], 0.995)) - S, 0.0))


@nb.njit(cache=True, nogil=True)
def _ramp(op, valve):
    """Position of the stem after each second of a ramp."""
    out = np.empty(op.size)
    pressure, position, velocity = op[0], op[0], 0.0
    for i in range(op.size):
        pressure, position, velocity = move_stem(op[i], 1.0, pressure, position, velocity, valve)
        out[i] = position
    return out
