"""Linear processes: any proper transfer function with dead time, and the forms with names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import ParameterError, require_finite, require_not_negative
from stiction.models.processes.discretise import Discrete, discretise

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["FOPDT", "SOPDT", "Integrating", "StateSpace", "TransferFunction"]


@dataclass(frozen=True, eq=False)
class StateSpace:
    """x' = A x + B u(t - dead_time), y = C x + D u(t - dead_time).

    Parameters
    ----------
    A : array_like, shape (n, n)
        State matrix [1/s].
    B, C : array_like, shape (n,)
        Input column and output row.
    D : float
        Direct path [PV units per % of span].
    dead_time : float
        Dead time [s], kept exactly: no Pade approximation.

    Raises
    ------
    ParameterError
        When the shapes do not fit or an entry is not finite.

    Examples
    --------
    >>> from stiction.models import StateSpace
    >>> StateSpace([[-0.1]], [1.0], [0.3], dead_time=2.0).at(0.0).real.round(6)
    np.float64(3.0)
    """

    A: NDArray[np.float64]
    B: NDArray[np.float64]
    C: NDArray[np.float64]
    D: float = 0.0
    dead_time: float = 0.0

    def __post_init__(self) -> None:
        try:
            A = np.atleast_2d(np.asarray(self.A, dtype=np.float64))
            B = np.asarray(self.B, dtype=np.float64).ravel()
            C = np.asarray(self.C, dtype=np.float64).ravel()
        except (TypeError, ValueError):
            raise ParameterError("A, B or C is not an array of numbers; give (n, n), (n,) and (n,).") from None
        if A.size == 0:
            A = np.zeros((0, 0))
        n = A.shape[0]
        if A.shape != (n, n) or B.shape != (n,) or C.shape != (n,):
            raise ParameterError(
                f"A {A.shape}, B {B.shape} and C {C.shape} do not fit together; give (n, n), (n,) and (n,): one input "
                "and one "
                "output."
            )
        if not (np.all(np.isfinite(A)) and np.all(np.isfinite(B)) and np.all(np.isfinite(C))):
            raise ParameterError("A, B or C has an entry that is not finite; give finite numbers.")
        put = object.__setattr__
        put(self, "A", A)
        put(self, "B", B)
        put(self, "C", C)
        put(self, "D", require_finite("D", self.D))
        put(self, "dead_time", require_not_negative("dead_time", self.dead_time, "s"))

    def state_space(self) -> StateSpace:
        """The process itself."""
        return self

    def at(self, s: complex | NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Transfer function at the complex frequencies `s` [rad/s], same shape."""
        s = np.asarray(s, dtype=np.complex128)
        eye = np.eye(self.A.shape[0])
        flat = [complex(self.C @ np.linalg.solve(p * eye - self.A, self.B)) + self.D for p in s.ravel()]
        return np.array(flat).reshape(s.shape) * np.exp(-s * self.dead_time)

    def discretise(self, dt: float) -> Discrete:
        """The process for held inputs at the sampling period `dt` [s]."""
        return discretise(self.A, self.B, self.C, self.D, self.dead_time, dt)


@dataclass(frozen=True, eq=False)
class TransferFunction:
    """A proper rational transfer function with dead time.

    Parameters
    ----------
    num, den : array_like
        Numerator and denominator, descending powers of s; the gain is in PV units per % of span.
    dead_time : float
        Dead time [s], kept exactly.

    Raises
    ------
    ParameterError
        When the numerator's degree exceeds the denominator's, or a coefficient is not finite.

    Examples
    --------
    >>> from stiction import TransferFunction
    >>> TransferFunction([1.0], [5.0, 6.0, 1.0]).order
    2
    """

    num: NDArray[np.float64]
    den: NDArray[np.float64]
    dead_time: float = 0.0

    def __post_init__(self) -> None:
        num, den = _polynomial("num", self.num), _polynomial("den", self.den)
        if num.size > den.size:
            raise ParameterError(
                f"num has degree {num.size - 1} and den {den.size - 1}: the process is improper and cannot be "
                "simulated; add the missing lags to den."
            )
        put = object.__setattr__
        put(self, "num", num)
        put(self, "den", den)
        put(self, "dead_time", require_not_negative("dead_time", self.dead_time, "s"))

    @property
    def order(self) -> int:
        """Number of states [-]."""
        return self.den.size - 1

    def state_space(self) -> StateSpace:
        """Controllable canonical form, time scaled for conditioning."""
        n = self.order
        den = self.den / self.den[0]
        num = np.concatenate([np.zeros(n + 1 - self.num.size), self.num]) / self.den[0]
        D = num[0]
        C = num[1:] - D * den[1:]
        A = np.zeros((n, n))
        B = np.zeros(n)
        if n:
            A[0, :] = -den[1:]
            A[1:, :-1] += np.eye(n - 1)
            B[0] = 1.0
        return StateSpace(A, B, C, float(D), self.dead_time)

    def at(self, s: complex | NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Transfer function at the complex frequencies `s` [rad/s], same shape."""
        s = np.asarray(s, dtype=np.complex128)
        return np.polyval(self.num, s) / np.polyval(self.den, s) * np.exp(-s * self.dead_time)

    def discretise(self, dt: float) -> Discrete:
        """The process for held inputs at the sampling period `dt` [s]."""
        return self.state_space().discretise(dt)


def FOPDT(K: float, tau: float, dead_time: float = 0.0) -> TransferFunction:
    """First order plus dead time, K exp(-dead_time s) / (tau s + 1).

    Parameters
    ----------
    K : float
        Steady gain [PV units per % of span].
    tau : float
        Time constant [s]; 0 makes a pure dead time.
    dead_time : float
        Dead time [s].

    Returns
    -------
    TransferFunction
        The process.

    Raises
    ------
    ParameterError
        When a time is negative or a parameter not finite.

    Examples
    --------
    >>> import stiction as st
    >>> st.FOPDT(K=3.0, tau=10.0, dead_time=10.0).den.tolist()
    [10.0, 1.0]
    """
    K = require_finite("K", K, "PV units per % of span")
    tau = require_not_negative("tau", tau, "s")
    return TransferFunction(np.array([K]), np.array([tau, 1.0]), dead_time)


def SOPDT(K: float, tau1: float, tau2: float, dead_time: float = 0.0) -> TransferFunction:
    """Second order plus dead time, K exp(-dead_time s) / ((tau1 s + 1)(tau2 s + 1)).

    Parameters
    ----------
    K : float
        Steady gain [PV units per % of span].
    tau1, tau2 : float
        Time constants [s].
    dead_time : float
        Dead time [s].

    Returns
    -------
    TransferFunction
        The process.

    Raises
    ------
    ParameterError
        When a time is negative or a parameter not finite.

    Examples
    --------
    >>> import stiction as st
    >>> st.SOPDT(K=1.0, tau1=5.0, tau2=1.0).den.tolist()
    [5.0, 6.0, 1.0]
    """
    K = require_finite("K", K, "PV units per % of span")
    tau1, tau2 = require_not_negative("tau1", tau1, "s"), require_not_negative("tau2", tau2, "s")
    return TransferFunction(
        np.array([K]), np.asarray(np.polymul([tau1, 1.0], [tau2, 1.0]), dtype=np.float64), dead_time
    )


def Integrating(K: float, dead_time: float = 0.0, tau: float = 0.0) -> TransferFunction:
    """Integrator with dead time and an optional lag, K exp(-dead_time s) / (s (tau s + 1)).

    Parameters
    ----------
    K : float
        Rate gain [PV units per % of span and s].
    dead_time : float
        Dead time [s].
    tau : float
        Time constant of the lag [s].

    Returns
    -------
    TransferFunction
        The process.

    Raises
    ------
    ParameterError
        When a time is negative or a parameter not finite.

    Examples
    --------
    >>> import stiction as st
    >>> st.Integrating(K=0.02, dead_time=1.0).den.tolist()
    [1.0, 0.0]
    """
    K = require_finite("K", K, "PV units per % of span and s")
    tau = require_not_negative("tau", tau, "s")
    return TransferFunction(np.array([K]), np.asarray(np.polymul([tau, 1.0], [1.0, 0.0]), dtype=np.float64), dead_time)


def _polynomial(name: str, value: ArrayLike) -> NDArray[np.float64]:
    try:
        p = np.atleast_1d(np.asarray(value, dtype=np.float64))
    except (TypeError, ValueError):
        raise ParameterError(f"{name} must be a series of numbers, got {value!r}.") from None
    if p.ndim != 1 or not np.all(np.isfinite(p)):
        raise ParameterError(f"{name} must be a series of finite numbers, got {value!r}.")
    p = np.trim_zeros(p, "f")
    if p.size == 0:
        raise ParameterError(f"{name} is zero; give at least one coefficient other than 0.")
    return p
