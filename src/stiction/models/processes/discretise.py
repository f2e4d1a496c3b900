"""Exact discretisation of a linear process with a zero-order hold and a dead time of any length."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.errors import require_samples

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Discrete", "discretise"]


class Discrete(NamedTuple):
    """x(k+1) = A x(k) + b_new u(k-n) + b_old u(k-n-1), y(k) = c x(k) + d u(k-m)."""

    A: NDArray[np.float64]
    """State matrix, shape (n_states, n_states)."""
    b_new: NDArray[np.float64]
    """Effect of the input that arrives within the sample, shape (n_states,)."""
    b_old: NDArray[np.float64]
    """Effect of the previous input, shape (n_states,)."""
    c: NDArray[np.float64]
    """Output row, shape (n_states,)."""
    d: float
    """Direct path."""
    delay: int
    """Whole samples of dead time n."""
    direct_delay: int
    """Delay m of the direct path [samples]."""


def discretise(A, B, C, D: float, dead_time: float, dt: float) -> Discrete:
    """Discretise x' = A x + B u(t - dead_time), y = C x + D u(t - dead_time) exactly for held inputs.

    `A`, `B`, `C`, of shape (n, n): state space of the process without its dead time. `dead_time`, `dt`: dead time and
    sampling period [s]. Returns the matrices and the whole samples of delay. Raises ParameterError when the dead time
    has too many samples (`errors.require_samples`).

    A dead time of n samples and a fraction f splits a sample in two: for f dt the input is still the
    older one, for the rest it is the newer one. Both integrals of exp(A t) B are taken exactly.
    """
    require_samples("dead_time", dead_time, dt)
    ratio = dead_time / dt
    delay = round(ratio)
    if abs(ratio - delay) > 1e-9 * max(1.0, ratio):
        delay = math.floor(ratio)
    fraction = max(ratio - delay, 0.0)
    if abs(fraction) < 1e-9 * max(1.0, ratio):
        fraction = 0.0
    whole, all_of_it = _integrals(A, B, dt)
    _, newer = _integrals(A, B, (1.0 - fraction) * dt) if fraction else (whole, all_of_it)
    return Discrete(whole, newer, all_of_it - newer, C.copy(), D, delay, delay + (1 if fraction else 0))


def _integrals(A, B, t: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """exp(A t) and the integral of exp(A s) B over 0..t."""
    n = A.shape[0]
    if n == 0:
        return A, B
    if n == 1:
        a = A[0, 0]
        gain = math.expm1(a * t) / a if a != 0.0 else t
        return np.array([[math.exp(a * t)]]), gain * B
    from scipy.linalg import expm

    block = np.zeros((n + 1, n + 1))
    block[:n, :n] = A * t
    block[:n, n] = B * t
    power = np.asarray(expm(block), dtype=np.float64)
    return np.ascontiguousarray(power[:n, :n]), np.ascontiguousarray(power[:n, n])
