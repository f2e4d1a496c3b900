"""A slow, obvious twin of the continuous loop: scipy's ODE solver with events, nothing shared with the package.

Staircase valves with or without dead time, and following valves without; the process and controller are written out
as first and second order equations, not taken from the package's state space.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp


def period_of_twin(A, B, C, dead_time, sb, lag, follows, x, op_lead, turns):
    """Lengths of the last oscillations of z' = A z + B x, u = C z(t - dead_time), from z = 0 but u = op_lead."""
    n = len(B)
    z = np.zeros(n)
    z[-1] = op_lead / C[-1]
    t, up, tops, following = 0.0, 1.0, [], False
    past = []
    while len(tops) < turns:

        def rhs(_t, s, x=x, following=following, up=up):
            drive = C @ s - up * lag if following else x
            return A @ s + B * drive

        def edge(_t, s, x=x, following=following, up=up):
            if following:
                drive = C @ s - up * lag
                return up * (C @ (A @ s + B * drive))
            return 1.0

        def leaves(_t, s, x=x, following=following):
            return 1.0 if following else sb - abs(C @ s - x)

        edge.terminal, edge.direction = True, -1
        leaves.terminal, leaves.direction = True, -1
        if dead_time == 0.0:
            run = solve_ivp(rhs, (0.0, 500.0), z, events=(edge, leaves), rtol=1e-12, atol=1e-13, max_step=0.5)
            t += run.t[-1]
            z = run.y[:, -1]
        else:
            step = 500.0
            run = solve_ivp(rhs, (0.0, step), z, rtol=1e-12, atol=1e-13, max_step=0.5, dense_output=True)
            past.append((t, run.sol))
            t_slip = _slip(past, C, dead_time, sb, x, t)
            z = run.sol(t_slip - t)
            t = t_slip
        op = C @ z if dead_time == 0.0 else _op(past, C, t - dead_time)
        if following:
            x = op - up * lag
            following = False
            continue
        direction = math.copysign(1.0, op - x)
        if direction < 0.0 and up > 0.0:
            tops.append(t)
        up = direction
        x = op - up * lag
        following = follows
    return np.diff(tops)


def _op(past, C, t):
    if t < 0.0:
        return 0.0
    begin, solution = [piece for piece in past if piece[0] <= t][-1]
    return C @ solution(t - begin)


def _slip(past, C, dead_time, sb, x, t):
    """First time after t at which the delayed OP leaves the band: a fine scan, then bisection."""
    h, low = 0.02, t
    while True:
        if low + h > dead_time and abs(_op(past, C, low + h - dead_time) - x) > sb:
            high = low + h
            for _ in range(60):
                middle = 0.5 * (low + high)
                if middle > dead_time and abs(_op(past, C, middle - dead_time) - x) > sb:
                    high = middle
                else:
                    low = middle
            return high
        low += h
