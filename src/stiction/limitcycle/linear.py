"""The linear part of a loop: everything between the stem and the valve's input, with its real dead time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import ParameterError, require_finite
from stiction.models.loop import require_loop
from stiction.models.processes import as_process

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from stiction.models import PID, Loop

__all__ = ["LinearPart", "linear_part"]


@dataclass(frozen=True, eq=False)
class LinearPart:
    """OP = -L MV: z' = A z + B mv, op(t) = C z(t - dead_time) + D mv(t - dead_time), pv likewise with C_pv, D_pv.

    All signals are deviations from the point at which the loop would rest if its valve had no friction.
    """

    A: NDArray[np.float64]
    """State matrix [1/s], shape (n, n); process states first, then the integral, then the derivative filter."""
    B: NDArray[np.float64]
    """Effect of the stem position, shape (n,)."""
    C: NDArray[np.float64]
    """From the states to the OP, shape (n,)."""
    D: float
    """Direct path from the stem to the OP, after the dead time [-]."""
    C_pv: NDArray[np.float64]
    """From the states to the PV, shape (n,)."""
    D_pv: float
    """Direct path from the stem to the PV, after the dead time [PV units per % of span]."""
    dead_time: float
    """Dead time [s]."""
    rest: float
    """OP, and so stem position, at which the frictionless loop rests [% of span]."""

    @property
    def order(self) -> int:
        """Number of states [-]."""
        return self.A.shape[0]

    @cached_property
    def poles(self) -> NDArray[np.complex128]:
        """Poles of L without its dead time [1/s]."""
        return np.linalg.eigvals(self.A).astype(np.complex128)

    @cached_property
    def _modes(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Numerators of L and of the process and their common denominator, descending powers of s."""
        if not self.order:
            return np.array([self.D]), np.array([self.D_pv]), np.ones(1)
        den = np.poly(self.A)
        num = np.poly(self.A - np.outer(self.B, self.C)) - den + self.D * den
        num_pv = np.poly(self.A - np.outer(self.B, self.C_pv)) - den + self.D_pv * den
        return tuple(np.asarray(p.real, dtype=np.float64) for p in (num, num_pv, den))  # type: ignore[return-value]

    def at(self, s: ArrayLike) -> NDArray[np.complex128]:
        """L(s) at complex frequencies `s` [rad/s], same shape."""
        s = np.asarray(s, dtype=np.complex128)
        return -np.polyval(self._modes[0], s) / np.polyval(self._modes[2], s) * np.exp(-s * self.dead_time)

    def process_at(self, s: ArrayLike) -> NDArray[np.complex128]:
        """Transfer function from the stem to the PV at complex frequencies `s` [rad/s], same shape."""
        s = np.asarray(s, dtype=np.complex128)
        return np.polyval(self._modes[1], s) / np.polyval(self._modes[2], s) * np.exp(-s * self.dead_time)

    def zeros(self) -> NDArray[np.complex128]:
        """Zeros of L [1/s]."""
        num = self._modes[0]
        return np.roots(np.where(np.abs(num) < 1e-13 * np.max(np.abs(num)), 0.0, num)).astype(np.complex128)

    def states_at(self, omega: float) -> NDArray[np.complex128]:
        """Phasor of the states for a stem that moves as exp(j omega t), shape (n,)."""
        resolvent = 1j * omega * np.eye(self.order) - self.A
        return np.linalg.solve(resolvent, self.B.astype(complex)).astype(np.complex128)


def linear_part(loop: Loop, *, sp: float = 0.0, disturbance: float = 0.0) -> LinearPart:
    """Return the linear part of a loop, its controller taken in continuous time.

    `loop`: the loop; its `dt` has no effect. `sp`: set point [PV units]. `disturbance`: load at the process inlet [% of
    span]. Returns state space and operating point. Raises ParameterError when controller and process together are
    improper or have no point of rest, the loop has a compensator, or `sp` or `disturbance` is not finite.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID.parallel(0.5, 1.0, 0.1), st.Stenman(0.5), st.TransferFunction([1], [5, 6, 1]), dt=0.01)
    >>> abs(complex(linear_part(loop).at(0.740j))).__round__(4)
    0.2877
    """
    require_loop(loop)
    if loop.compensator is not None:
        raise ParameterError(
            f"the loop has a compensator ({type(loop.compensator).__name__}), for which there is no describing "
            "function and no exact cycle; give the loop without it, or simulate it."
        )
    sp, disturbance = require_finite("sp", sp, "PV units"), require_finite("disturbance", disturbance, "% of span")
    process = as_process(loop.process).state_space()
    chain = _chain(loop.controller, process.A, process.B, process.C, process.D)
    A, B, C, D, C_pv, E, c_sp = chain
    n = A.shape[0]
    scale = np.abs(A).sum(axis=1) + np.abs(B)
    scale[scale == 0.0] = 1.0
    balance = np.zeros((n + 1, n + 1))
    balance[:n, :n], balance[:n, n] = A / scale[:, None], B / scale
    balance[n, :n], balance[n, n] = C, D - 1.0
    known = np.append((-B * disturbance - E * sp) / scale, -D * disturbance - c_sp * sp)
    solution = np.linalg.lstsq(balance, known, rcond=1e-12)[0]
    if np.max(np.abs(balance @ solution - known)) > 1e-8 * max(1.0, float(np.max(np.abs(known)))):
        raise ParameterError(
            f"the loop has no steady state for sp = {sp:g} and disturbance = {disturbance:g}: its process has "
            "no finite steady-state gain, or integrates the load without integral action. Set both to 0."
        )
    return LinearPart(A, B, C, D, C_pv, process.D, process.dead_time, float(solution[n]))


def _chain(controller: PID, A, B, C, D: float) -> tuple[Any, ...]:
    """Process and PID in one state space: A, B, C, D, C_pv and the effects of the set point on states and OP."""
    Kc, Ki, Kd, Tf = controller.Kc, controller.Ki, controller.Kd, controller.Tf
    n = A.shape[0]
    integral, filtered = Ki != 0.0, Kd != 0.0 and Tf > 0.0
    size = n + integral + filtered
    a, b, c, e = np.zeros((size, size)), np.zeros(size), np.zeros(size), np.zeros(size)
    a[:n, :n], b[:n] = A, B
    c[:n] = -Kc * C
    direct, set_point = -Kc * D, Kc * controller.b
    if integral:
        a[n, :n], b[n], e[n] = -Ki * C, -Ki * D, Ki
        c[n] = 1.0
    if filtered:
        last = size - 1
        a[last, :n], a[last, last], b[last] = -C / Tf, -1.0 / Tf, -D / Tf
        c[:n] -= Kd / Tf * C
        c[last] = -Kd / Tf
        direct -= Kd / Tf * D
    elif Kd != 0.0:
        if D != 0.0:
            raise ParameterError(
                "controller and process are improper together: an ideal derivative (N = inf) of a process with a "
                "direct path. Give the derivative a filter (N = 10) or the process a lag."
            )
        c[:n] -= Kd * (C @ A)
        direct -= Kd * float(C @ B)
    pv = np.zeros(size)
    pv[:n] = C
    return a, b, c, float(direct), pv, e, set_point
