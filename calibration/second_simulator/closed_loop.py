"""The closed loop: controller, valve, process and load, one execution of the controller after the other."""

from __future__ import annotations

import numba as nb
import numpy as np

from calibration.second_simulator.controllers import controller_step
from calibration.second_simulator.valve import move_stem

__all__ = ["SUBSTEPS", "run_loop"]

SUBSTEPS = 4
"""Steps of the process in one interval of the controller."""


@nb.njit(cache=True, nogil=True)
def run_loop(controller, valve, Ad, Bd, C, delay, dt, sp, load, noise, bend, start):
    """Run the loop; signals in % of span, the PV about its set point of 0.

    Parameters
    ----------
    controller, valve : tuple of float
        `Controller` and `ValveParameters` as plain tuples.
    Ad, Bd, C : ndarray, shapes (n, n), (n,), (n,)
        The process, discrete in steps of dt / `SUBSTEPS`.
    delay : int
        Dead time [steps of the process].
    dt : float
        Interval of the controller [s].
    sp, load, noise : ndarray, shape (n_samples,)
        Set point, load at the process input, noise of the transmitter [% of span].
    bend : float
        Curvature of the installed characteristic [-]; 0 for a straight one.
    start : float
        Position of the stem off its balance [% of span].

    Returns
    -------
    tuple of ndarray
        OP, measured PV and stem position, shape (n_samples,) each.
    """
    n, order = sp.size, C.size
    op_out, pv_out, stem_out = np.empty(n), np.empty(n), np.empty(n)
    line, place = np.zeros(delay + 1), 0
    state, after = np.zeros(order), np.zeros(order)
    op, integral, derivative = 50.0, 50.0, 0.0
    pressure, position, velocity = 50.0, 50.0 + start, 0.0
    last_error, last_pv = 0.0, 0.0
    for k in range(n):
        pv = noise[k]
        for i in range(order):
            pv += C[i] * state[i]
        error = sp[k] - pv
        if k == 0:
            last_error, last_pv = error, pv
        op, integral, derivative = controller_step(
            controller, dt, error, pv, last_error, last_pv, op, integral, derivative
        )
        last_error, last_pv = error, pv
        op_out[k], pv_out[k] = op, pv
        for _ in range(SUBSTEPS):
            before = position
            pressure, position, velocity = move_stem(op, dt / SUBSTEPS, pressure, position, velocity, valve)
            away = 0.5 * (before + position) - 50.0
            line[place] = away + bend * away * abs(away) / 50.0 + load[k]
            place = (place + 1) % (delay + 1)
            u = line[place]
            for i in range(order):
                total = Bd[i] * u
                for j in range(order):
                    total += Ad[i, j] * state[j]
                after[i] = total
            for i in range(order):
                state[i] = after[i]
        stem_out[k] = position
    return op_out, pv_out, stem_out
