"""The positioner: a controller on the valve that drives the actuator until the stem reaches its set point."""

from __future__ import annotations

import math
from dataclasses import dataclass

from stiction.errors import require_not_negative, require_positive
from stiction.models.numba_compile import inline_kernel

__all__ = ["Positioner", "positioner_step"]


@inline_kernel
def positioner_step(
    op: float, position: float, integral: float, dt: float,
    gain: float, per_second: float, deadband: float, low: float, high: float,
):  # fmt: skip
    """Signal to the actuator and integral after `dt` [s]; the integral is held while the signal is at a limit."""
    error = op - position
    error = gain * (error - min(max(error, -deadband), deadband))
    change = error * per_second * dt
    signal = op + error + integral + change
    if signal > high:
        return high, integral + min(change, 0.0)
    if signal < low:
        return low, integral + max(change, 0.0)
    return signal, integral + change


@dataclass(frozen=True)
class Positioner:
    r"""Proportional or PI positioner on the stem position.

    The signal to the actuator is :math:`u + K_p\,(e + \frac{1}{T_i}\int e\,dt)`, with the position error e less
    the deadband.

    Parameters
    ----------
    gain : float
        Proportional gain [-].
    integral_time : float
        Integral time [s]; infinity, the default, gives a proportional positioner.
    deadband : float
        Half width of the deadband: the positioner ignores a smaller error [% of span].

    Raises
    ------
    ParameterError
        When the gain or the deadband is negative, or the integral time is not positive.

    Examples
    --------
    >>> from stiction.models.positioner import Positioner
    >>> Positioner(gain=5.0, integral_time=4.0).deadband
    0.0
    """

    gain: float
    integral_time: float = math.inf
    deadband: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "gain", require_not_negative("gain", self.gain, "-"))
        object.__setattr__(self, "deadband", require_not_negative("deadband", self.deadband, "% of span"))
        time = require_positive("integral_time", self.integral_time, "s", infinite=True)
        object.__setattr__(self, "integral_time", time)
