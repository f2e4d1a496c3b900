"""The PID controller in standard and parallel form: filtered derivative, output limits, anti-windup, manual."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.errors import ParameterError, require_finite, require_not_negative, require_positive, require_range
from stiction.models.numba_compile import inline_kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["PID", "PIDState", "pid_at_rest", "pid_step"]


class PIDState(NamedTuple):
    """State of the controller between two samples."""

    op: float
    """Controller output [% of span]."""
    integral: float
    """Integral part, the bias included [% of span]."""
    derivative: float
    """Filtered derivative part [% of span]."""
    error: float
    """Weighted error of the derivative part in the last sample [PV units]."""


@inline_kernel
def pid_at_rest(op: float, pv: float, p) -> PIDState:
    """State of a controller at rest with `pv` at its set point and the output `op`."""
    return PIDState(op, op - p[0] * (p[4] - 1.0) * pv, 0.0, (p[5] - 1.0) * pv)


@inline_kernel
def pid_step(sp: float, pv: float, s: PIDState, manual: float, p) -> PIDState:
    """One sample in automatic, or in manual with the output `manual` when that is not NaN."""
    proportional = p[0] * (p[4] * sp - pv)
    gain = p[1] * (sp - pv)
    error = p[5] * sp - pv
    derivative = 0.0
    if p[2] != 0.0:
        derivative = p[3] * s.derivative + p[2] * (error - s.error)
    if manual == manual:
        op = min(max(manual, p[6]), p[7])
        return PIDState(op, op - proportional - derivative, derivative, error)
    integral = s.integral + gain
    op = proportional + derivative + (s.integral if p[8] != 0.0 else integral)
    if op > p[7]:
        if p[9] != 0.0 and gain > 0.0:
            integral = s.integral
        op = p[7]
    elif op < p[6]:
        if p[9] != 0.0 and gain < 0.0:
            integral = s.integral
        op = p[6]
    return PIDState(op, integral, derivative, error)


@dataclass(frozen=True)
class PID:
    r"""PID controller, standard (ISA) form.

    .. math:: u = K_c\left(b\,r - y + \frac{1}{T_i}\int e\,dt
              + \frac{T_d\,s}{1 + T_d s / N}(c\,r - y)\right)

    Parameters
    ----------
    Kc : float
        Proportional gain [% of span per PV unit]; negative for a direct-acting loop.
    Ti : float
        Integral time [s]; infinity switches the integral off.
    Td : float
        Derivative time [s].
    N : float
        Derivative filter: its time constant is Td / N [-]; infinity takes the bare difference quotient.
    b, c : float
        Set point weights of the proportional and of the derivative part [-].
    op_limits : tuple of float
        Output limits [% of span]; none by default, so that a loop can be written in deviations.
    anti_windup : bool
        Hold the integral while the output is at a limit and the error would drive it further.
    integral : str
        "backward" adds this sample's error to the integral before the output is computed, "forward" after.

    Raises
    ------
    ParameterError
        When a parameter is outside its limits.

    Examples
    --------
    >>> import stiction as st
    >>> st.PID(Kc=0.2, Ti=10.0).Ki
    0.02
    >>> st.PID.parallel(Kp=0.5, Ki=1.0, Kd=0.1).Td
    0.2
    """

    Kc: float
    Ti: float
    Td: float = 0.0
    N: float = math.inf
    b: float = 1.0
    c: float = 1.0
    op_limits: tuple[float, float] = (-math.inf, math.inf)
    anti_windup: bool = True
    integral: str = "backward"

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "Kc", require_finite("Kc", self.Kc, "% of span per PV unit"))
        put(self, "Ti", require_positive("Ti", self.Ti, "s", infinite=True))
        put(self, "N", require_positive("N", self.N, infinite=True))
        put(self, "Td", require_not_negative("Td", self.Td, "s"))
        put(self, "b", require_finite("b", self.b))
        put(self, "c", require_finite("c", self.c))
        put(self, "op_limits", require_range("op_limits", self.op_limits))
        if self.integral not in ("backward", "forward"):
            raise ParameterError(f"integral = {self.integral!r} is unknown; use 'backward' or 'forward'.")

    @classmethod
    def parallel(cls, Kp: float, Ki: float, Kd: float = 0.0, *, Tf: float = 0.0, **options: object) -> PID:
        """Build the controller from parallel gains, u = Kp e + Ki int e dt + Kd de/dt / (1 + Tf s).

        Parameters
        ----------
        Kp : float
            Proportional gain [% of span per PV unit], not zero.
        Ki : float
            Integral gain [% of span per PV unit and s].
        Kd : float
            Derivative gain [% of span s per PV unit].
        Tf : float
            Time constant of the derivative filter [s].
        **options
            Further options of `PID`.

        Raises
        ------
        ParameterError
            When `Kp` is zero (no standard form) or the gains differ in sign.
        """
        Kp = require_finite("Kp", Kp, "% of span per PV unit")
        Ki = require_finite("Ki", Ki, "% of span per PV unit and s")
        Kd = require_finite("Kd", Kd, "% of span s per PV unit")
        if Kp == 0.0 or Ki * Kp < 0.0 or Kd * Kp < 0.0:
            raise ParameterError(
                f"Kp = {Kp:g}, Ki = {Ki:g}, Kd = {Kd:g} has no standard form; give Kp other than 0 and equal signs."
            )
        Td = Kd / Kp
        Tf = require_not_negative("Tf", Tf, "s")
        return cls(Kp, Kp / Ki if Ki else math.inf, Td, Td / Tf if Tf and Td else math.inf, **options)  # type: ignore[arg-type]

    @property
    def Ki(self) -> float:
        """Integral gain [% of span per PV unit and s]."""
        return self.Kc / self.Ti

    @property
    def Kd(self) -> float:
        """Derivative gain [% of span s per PV unit]."""
        return self.Kc * self.Td

    @property
    def Tf(self) -> float:
        """Time constant of the derivative filter [s]."""
        return self.Td / self.N

    def pack(self, dt: float) -> NDArray[np.float64]:
        """Parameters as `pid_step` takes them for the sampling period `dt` [s], shape (10,)."""
        lag = self.Tf + dt
        late = 1.0 if self.integral == "forward" else 0.0
        guard = 1.0 if self.anti_windup else 0.0
        return np.array(
            [self.Kc, self.Ki * dt, self.Kd / lag, self.Tf / lag, self.b, self.c, *self.op_limits, late, guard]
        )

    def transfer_function(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Numerator and denominator of OP over error, descending powers of s."""
        Kc, Ki, Kd, Tf = self.Kc, self.Ki, self.Kd, self.Tf
        if Ki == 0.0:
            return np.array([Kc * Tf + Kd, Kc]), np.array([Tf, 1.0])
        return np.trim_zeros(np.array([Kc * Tf + Kd, Kc + Ki * Tf, Ki]), "f"), np.trim_zeros(
            np.array([Tf, 1.0, 0.0]), "f"
        )
