"""Slow, obvious twins of the models and of the loop, written from the published rules and not from the package.

A twin is a function of the whole input that keeps its memory in local names. One rule of the house is repeated here:
a band is crossed by an input that exceeds it by more than a billionth of it, so that 0.1 + 0.2 does not cross 0.3.
"""

from __future__ import annotations

import math

EDGE = 1.0 + 1e-9


def sgn(value):
    return (value > 0) - (value < 0)


def ideal(op):
    return list(op)


def stenman(op, d):
    """Stay while the input is within d of the stem, else go to it."""
    x, out = op[0], []
    for u in op:
        x = x if abs(u - x) <= d * EDGE else u
        out.append(x)
    return out


def kano(op, S, J):
    """Kano 2004: rest, remember where; go after S back or J on."""
    x, stopped, d, before, slope_before = op[0], True, 1, op[0], 0.0
    u_s = x + d * (S - J) / 2
    out = []
    for u in op:
        slope = u - before
        if not stopped and slope * slope_before <= 0:
            u_s, stopped = before, True
        if stopped and -d * (u - u_s) > S * EDGE:
            d, stopped = -d, False
        elif stopped and d * (u - u_s) > J * EDGE:
            stopped = False
        if not stopped:
            x = u - d * ((S - J) / 2)
        before, slope_before = u, slope
        out.append(x)
    return out


def choudhury(op, S, J):
    """Choudhury 2005, by its flow chart."""
    x, stuck, u_s, before, way_before = op[0], True, op[0], op[0], 0
    out = []
    for u in op:
        way = sgn(u - before)
        if way == way_before:
            if not stuck:
                moves = True
            elif sgn(u - u_s) * sgn(u_s - x) == 1:
                moves = abs(u - u_s) > J * EDGE
            else:
                moves = abs(u - x) > (S * EDGE + J * EDGE) / 2
        else:
            if not stuck:
                u_s = before
            moves = way != 0 and abs(u - x) > (S * EDGE + J * EDGE) / 2
        stuck = not moves
        if moves:
            x = u - way * ((S - J) / 2)
        before, way_before = u, way
        out.append(x)
    return out


def he(op, fs, fd):
    """He 2007: the unbalanced force collects changes of the input, and fd of it stays after a slip."""
    x, force, before, out = op[0], 0.0, op[0], []
    for u in op:
        force += u - before
        if abs(force) > fs * EDGE:
            force = sgn(force) * fd
            x = u - force
        before = u
        out.append(x)
    return out


def he_wang(op, fs, fd, K):
    """He and Wang: a slip K times the way to the balance."""
    x, out = op[0], []
    for u in op:
        e = u - x
        if abs(e) > fs * EDGE:
            x = x + K * (e - sgn(e) * fd)
        out.append(x)
    return out


def srinivasan(op, sb, sj, r, dt):
    """Eq. 5, repaired. `sb` and `sj` are numbers, or functions of position and rate."""
    x, way, before, out = op[0], 0, op[0], []
    for u in op:
        change = u - before
        rate = abs(change) / dt
        band = sb(x, rate) if callable(sb) else sb
        jump = sj(x, rate) if callable(sj) else sj
        e = u - x
        if way != 0 and change * way > 0 and abs(change) >= r * dt / EDGE:
            x = u - way * (band - jump)
        elif abs(e) > band * EDGE:
            way = sgn(e)
            x = u - way * (band - jump)
        else:
            way = 0
        before = u
        out.append(x)
    return out


def srinivasan_printed(op, sb, sj, r, dt):
    """Eq. 5 as the paper prints it."""
    x, change_of_x, before, change_before, out = op[0], 0.0, op[0], 0.0, []
    for u in op:
        change = u - before
        if change_of_x == 0:
            change_of_x = sgn(change) * sj if abs(u - x) > sb * EDGE else 0.0
        elif sgn(change) == sgn(change_before) and sgn(change) != 0 and abs(change) >= r * dt / EDGE:
            change_of_x = change
        else:
            change_of_x = 0.0
        x = x + change_of_x
        before, change_before = u, change
        out.append(x)
    return out


def pid(sp, pv, dt, Kc, Ti, Td=0.0, N=math.inf, b=1.0, c=1.0, low=-math.inf, high=math.inf, integral="backward"):
    """Two-degree-of-freedom PID over whole series, with the integral held while it pushes against a limit."""
    bias, slope, before, out = 0.0, 0.0, 0.0, []
    Tf = Td / N
    for r, y in zip(sp, pv, strict=True):
        share = Kc / Ti * dt * (r - y)
        weighted = c * r - y
        slope = Tf / (Tf + dt) * slope + Kc * Td / (Tf + dt) * (weighted - before)
        before = weighted
        wanted = Kc * (b * r - y) + slope + (bias if integral == "forward" else bias + share)
        pushes = (wanted > high and share > 0) or (wanted < low and share < 0)
        bias = bias if pushes else bias + share
        out.append(min(max(wanted, low), high))
    return out


class Kano:
    """The rule of `kano`, a sample at a time."""

    def __init__(self, S, J, start=0.0):
        self.S, self.J, self.past = S, J, [start]

    def __call__(self, u):
        self.past.append(u)
        return kano(self.past, self.S, self.J)[-1]


def first_order_loop(sp, n, Kc, Ti, dt, valve, K, tau, delay, integral="backward"):
    """PI, a valve and a first-order process behind a buffer of `delay` samples: the conventions of check N16."""
    a = math.exp(-dt / tau)
    bias, y, buffer = 0.0, 0.0, [0.0] * delay
    pv, op, mv = [], [], []
    for _ in range(n):
        e = sp - y
        before = bias
        bias = bias + Kc * dt / Ti * e
        u = Kc * e + (before if integral == "forward" else bias)
        x = valve(u)
        pv.append(y)
        op.append(u)
        mv.append(x)
        buffer.append(x)
        y = a * y + K * (1 - a) * buffer.pop(0)
    return pv, op, mv
