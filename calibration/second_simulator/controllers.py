"""Controllers that the first simulator does not have; errors and outputs in % of span.

Velocity-form PI, ISA PID with filtered derivative, PI with back-calculation (Astrom and Hagglund 2006), error-squared
level controller (Shunta and Fehervari 1976), gap controller (Shinskey 1996).
"""

from __future__ import annotations

from typing import NamedTuple

import numba as nb

__all__ = [
    "BACK_CALCULATION",
    "ERROR_SQUARED",
    "FORMS",
    "GAP",
    "ISA_PID",
    "VELOCITY_PI",
    "Controller",
    "controller_step",
]

VELOCITY_PI, ISA_PID, BACK_CALCULATION, ERROR_SQUARED, GAP = range(5)
FORMS = ("velocity_pi", "isa_pid", "back_calculation", "error_squared", "gap")


class Controller(NamedTuple):
    """Form and settings."""

    form: int
    """Place in `FORMS`."""
    gain: float
    """Proportional gain [% of OP per % of PV]."""
    integral_time: float
    """Integral time [s]."""
    derivative_time: float
    """Derivative time, of the ISA PID alone [s]."""
    filter_ratio: float
    """Derivative time over that of its filter [-]."""
    gap: float
    """Half width of the gap, or error at which an error-squared gain reaches `gain` [% of PV]."""
    gap_gain: float
    """Gain inside the gap, or at no error, as a share of `gain` [-]."""


@nb.njit(cache=True, nogil=True)
def controller_step(controller, dt, error, pv, last_error, last_pv, op, integral, derivative, low, high):
    """One execution, OP between its limits; return OP and the states of the integral and the derivative."""
    form, gain, Ti, Td, N, gap, gap_gain = controller
    if form == VELOCITY_PI:
        op += gain * (error - last_error + dt / Ti * error)
        return min(max(op, low), high), integral, derivative
    if form == ISA_PID:
        ratio = Td / (Td + N * dt)
        derivative = ratio * derivative - gain * N * ratio * (pv - last_pv)
        free = gain * error + integral + derivative
        out = min(max(free, low), high)
        if free == out:
            integral += gain * dt / Ti * error
        return out, integral, derivative
    if form == ERROR_SQUARED:
        gain *= gap_gain + (1.0 - gap_gain) * min(abs(error) / gap, 2.0)
    elif form == GAP and abs(error) < gap:
        gain *= gap_gain
    free = gain * error + integral
    out = min(max(free, low), high)
    integral += gain * dt / Ti * error + dt / Ti * (out - free)
    return out, integral, derivative
