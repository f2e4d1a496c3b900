"""Processes as state space models, their ultimate gain and period."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["KINDS", "Process", "draw_process", "ultimate_point"]

KINDS = ("fopdt", "sopdt", "inverse_response", "integrating", "recycle")


class Process(NamedTuple):
    """A process from stem position [% of span] to PV [% of span]."""

    kind: str
    """One of `KINDS`."""
    A: NDArray[np.float64]
    """State matrix, shape (n, n) [1/s]."""
    B: NDArray[np.float64]
    """Input matrix, shape (n, 1)."""
    C: NDArray[np.float64]
    """Output matrix, shape (1, n)."""
    dead_time: float
    """Dead time [s]."""
    time_constant: float
    """Largest lag, without that of a recycle [s]."""

    def response(self, omega: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Frequency response at angular frequencies [rad/s]."""
        resolvents = 1j * np.asarray(omega)[:, None, None] * np.eye(len(self.A)) - self.A
        states = np.linalg.solve(resolvents, np.broadcast_to(self.B, (len(omega), *self.B.shape)))
        return (self.C @ states)[:, 0, 0] * np.exp(-1j * omega * self.dead_time)


def draw_process(rng: np.random.Generator, dt: float) -> Process:
    """Draw a process whose time constants suit a controller that runs every `dt` seconds.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of chance.
    dt : float
        Interval of the controller [s].

    Returns
    -------
    Process
        The process; its gain is positive.
    """
    kind = str(rng.choice(KINDS, p=(0.35, 0.25, 0.1, 0.2, 0.1)))
    tau = dt * float(np.exp(rng.uniform(np.log(4.0), np.log(60.0))))
    dead = max(tau * float(rng.uniform(0.08, 0.9)), dt)
    gain = float(np.exp(rng.uniform(np.log(0.4), np.log(3.0))))
    second = tau * float(rng.uniform(0.1, 0.9))
    first = [[-1.0 / tau]]
    if kind == "fopdt":
        A, B, C = first, [[1.0 / tau]], [[gain]]
    elif kind == "integrating":
        lag = tau * 0.3
        A, B, C = [[0.0, 1.0], [0.0, -1.0 / lag]], [[0.0], [1.0 / lag]], [[gain / (3.0 * tau), 0.0]]
    elif kind == "recycle":
        # The recycle returns a share of the product after a long lag: dz/dt = (y - z) / slow.
        share, slow = float(rng.uniform(0.2, 0.6)), tau * float(rng.uniform(3.0, 8.0))
        A = [[-1.0 / tau, share / tau], [1.0 / slow, -1.0 / slow]]
        B, C = [[1.0 / tau], [0.0]], [[gain * (1.0 - share), 0.0]]
    else:
        A, B = [[-1.0 / tau, 0.0], [1.0 / second, -1.0 / second]], [[1.0 / tau], [0.0]]
        # (1 - a s) / ((tau s + 1)(second s + 1)) = (1 + a/second) / (...) - a/second / (tau s + 1)
        share = float(rng.uniform(0.2, 0.8)) if kind == "inverse_response" else 0.0
        C = [[-gain * share, gain * (1.0 + share)]]
    return Process(kind, np.array(A), np.array(B), np.array(C), dead, tau)


def ultimate_point(process: Process, integral_time: float, dt: float) -> tuple[float, float]:
    """Gain of a PI controller at which the loop just oscillates, and the period of that oscillation.

    Parameters
    ----------
    process : Process
        The process.
    integral_time : float
        Integral time of the controller [s].
    dt : float
        Interval of the controller, whose hold delays by half of it [s].

    Returns
    -------
    tuple of float
        Gain [% of OP per % of PV] and period [s]; the gain is inf where the phase never crosses -180 degrees.
    """
    omega = np.geomspace(1e-3 / process.time_constant, np.pi / dt, 2000)
    loop = process.response(omega) * (1.0 + 1.0 / (1j * omega * integral_time)) * np.exp(-0.5j * omega * dt)
    phase = np.unwrap(np.angle(loop))
    falls = np.flatnonzero((phase[:-1] > -np.pi) & (phase[1:] <= -np.pi))
    if falls.size == 0:
        return np.inf, 2.0 * np.pi / float(omega[-1])
    i = int(falls[0])
    return 1.0 / float(abs(loop[i])), 2.0 * np.pi / float(omega[i])
