"""Two controllers in cascade: the OP of the primary is the set point of the secondary, which moves the valve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.models.controllers.pid import pid_at_rest, pid_step
from stiction.models.dispatch import data_driven_parameters, data_driven_step, valve_at_rest
from stiction.models.numba_compile import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.models import Loop

__all__ = ["simulate_cascade"]


def simulate_cascade(
    primary: Loop,
    secondary: Loop,
    sp: NDArray[np.float64],
    primary_load: NDArray[np.float64],
    secondary_load: NDArray[np.float64],
    seed: int,
    start: float = 50.0,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Simulate a primary and a secondary loop whose signals are all in percent.

    Parameters
    ----------
    primary, secondary : Loop
        The two loops, sampled at the same period. Their processes are of first order. The valve of the primary is not
        used: its process is driven by the PV of the secondary.
    sp : ndarray, shape (n_samples,)
        Set point of the primary [% of span].
    primary_load, secondary_load : ndarray, shape (n_samples,)
        Loads at the inlets of the two processes [% of span].
    seed : int
        Seed of the measurement noise.
    start : float
        Operating point of all signals before the first sample [% of span].

    Returns
    -------
    tuple of ndarray, each of shape (n_samples,)
        PV and OP of the primary, PV and OP of the secondary [% of span].

    Examples
    --------
    >>> import stiction as st
    >>> primary = st.Loop(st.PID(2.0, 100.0), st.Kano(0.0, 0.0), st.FOPDT(1.0, 100.0, 10.0), dt=5.0)
    >>> secondary = st.Loop(st.PID(0.5, 10.0), st.Kano(0.0, 0.0), st.FOPDT(1.0, 10.0, 5.0), dt=5.0)
    >>> sp = np.full(400, 52.0)
    >>> pv, op, secondary_pv, secondary_op = simulate_cascade(primary, secondary, sp, 0.0 * sp, 0.0 * sp, seed=0)
    >>> round(float(pv[-1]), 2), round(float(op[-1] - secondary_pv[-1]), 2)
    (52.0, 0.0)
    """
    n, rng = sp.shape[0], np.random.default_rng(seed)
    noise = rng.normal(0.0, 1.0, (2, n)) * np.array([[primary.noise], [secondary.noise]])
    outer, inner = primary.discrete, secondary.discrete
    out = np.empty((4, n))
    _run_cascade(
        primary.controller.pack(primary.dt), _first_order(outer), outer.delay,
        secondary.controller.pack(secondary.dt), _first_order(inner), inner.delay,
        secondary.valve.code, secondary.valve.pack(secondary.dt),
        sp, primary_load, secondary_load, noise, start, out,
    )  # fmt: skip
    return out[0], out[1], out[2], out[3]


def _first_order(process) -> NDArray[np.float64]:
    """Pole, input gains of the newer and of the older sample, and output gain of a first-order process."""
    return np.array([process.A[0, 0], process.b_new[0], process.b_old[0], process.c[0]])


@kernel
def _run_cascade(pid1, p1, delay1, pid2, p2, delay2, model, valve, sp, load1, load2, noise, start, out):
    """Fill `out` (4, n_samples) with PV and OP of the primary, PV and OP of the secondary."""
    n = sp.shape[0]
    set1 = (pid1[0], pid1[1], pid1[2], pid1[3], pid1[4], pid1[5], pid1[6], pid1[7], pid1[8], pid1[9])
    set2 = (pid2[0], pid2[1], pid2[2], pid2[3], pid2[4], pid2[5], pid2[6], pid2[7], pid2[8], pid2[9])
    c1, c2 = pid_at_rest(start, start, set1), pid_at_rest(start, start, set2)
    stem, q = valve_at_rest(model, start, start, valve), data_driven_parameters(valve)
    position, flow = load1 * 0.0, load1 * 0.0
    automatic = np.nan
    x1 = x2 = old1 = old2 = 0.0
    for k in range(n):
        pv1 = start + p1[3] * x1
        pv2 = start + p2[3] * x2
        flow[k] = pv2 - start
        out[0, k], out[2, k] = pv1 + noise[0, k], pv2 + noise[1, k]
        c1 = pid_step(sp[k], out[0, k], c1, automatic, set1)
        c2 = pid_step(c1.op, out[2, k], c2, automatic, set2)
        stem = data_driven_step(model, c2.op, stem, q)
        position[k] = min(max(stem.position, q[0]), q[1]) - start
        out[1, k], out[3, k] = c1.op, c2.op
        new1 = flow[k - delay1] + load1[k - delay1] if k >= delay1 else 0.0
        new2 = position[k - delay2] + load2[k - delay2] if k >= delay2 else 0.0
        x1 = p1[0] * x1 + p1[1] * new1 + p1[2] * old1
        x2 = p2[0] * x2 + p2[1] * new2 + p2[2] * old2
        old1, old2 = new1, new2
