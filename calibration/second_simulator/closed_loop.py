"""The closed loop: controller, valve, process and load, one execution of the controller after the other."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba as nb
import numpy as np

from calibration.second_simulator.controllers import controller_step
from calibration.second_simulator.valve import move_stem

__all__ = ["SUBSTEPS", "Output", "run_loop"]

SUBSTEPS = 4
"""Steps of the process in one interval of the controller."""


class Output(NamedTuple):
    """What lies between the controller and its valve."""

    low: float = 0.0
    """Lower limit of OP [% of span]."""
    high: float = 100.0
    """Upper limit of OP [% of span]."""
    rate: float = 1e9
    """Largest move of OP in an execution [% of span]."""
    zone: float = 0.0
    """Half width of a dead zone of the valves about 50 % [% of span]."""
    pulse: int = 0
    """Period of a time-proportioned output [executions]; 0 of a continuous one."""
    begin: float = 50.0
    """OP at rest [% of span]."""


@nb.njit(cache=True, nogil=True)
def run_loop(controller, valve, Ad, Bd, C, delay, dt, sp, load, noise, bend, start, output):
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
    output : tuple of float
        `Output` as a plain tuple.

    Returns
    -------
    tuple of ndarray
        OP, measured PV and stem position, shape (n_samples,) each.
    """
    n, order = sp.size, C.size
    op_out, pv_out, stem_out = np.empty(n), np.empty(n), np.empty(n)
    line, place = np.zeros(delay + 1), 0
    state, after = np.zeros(order), np.zeros(order)
    low, high, rate, zone, pulse, begin = output
    op, integral, derivative, asked = begin, begin, 0.0, begin
    pressure, position, velocity = begin, begin + start, 0.0
    last_error, last_pv = 0.0, 0.0
    for k in range(n):
        pv = noise[k]
        for i in range(order):
            pv += C[i] * state[i]
        error = sp[k] - pv
        if k == 0:
            last_error, last_pv = error, pv
        asked, integral, derivative = controller_step(
            controller, dt, error, pv, last_error, last_pv, asked, integral, derivative, low, high
        )
        op = min(max(asked, op - rate), op + rate)
        last_error, last_pv = error, pv
        op_out[k], pv_out[k] = op, pv
        for _ in range(SUBSTEPS):
            before = position
            pressure, position, velocity = move_stem(op, dt / SUBSTEPS, pressure, position, velocity, valve)
            away = 0.5 * (before + position) - begin
            if pulse > 0:
                away = (100.0 if (k % pulse) < 0.01 * op * pulse else 0.0) - begin
            if zone > 0.0:
                away = math.copysign(max(abs(away) - zone, 0.0), away)
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
