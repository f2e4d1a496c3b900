"""Simulation of the loop in continuous time, event by event, exact to rounding.

Between events the loop is linear: the stem rests, or it follows its input at a fixed lag. The states of the
linear part are advanced by their Taylor series, over steps so short (norm of A times step <= 1/2) that the error after
twelve terms is below 2e-14 of them; steps are longer when the last terms are negligible. A dead time is exact: the
series of the output are kept and read back later. Events are roots of these polynomials: the input leaves the band
(slip), or slows down below the rate (rest).

Times in here are in units of the longest step. Directions are +1 up, -1 down.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from stiction.models.numba_compile import kernel

__all__ = [
    "BUFFER_FULL", "DIVERGED", "REST", "SETTLED", "STOPPED", "TERMS", "ContinuousLoop", "RunLimits", "RunSpace",
    "simulate_events",
]  # fmt: skip

TERMS = 13
"""Coefficients of each series [-]: with a step of 1 or less the next term is below 0.5**13 / 13! of the states."""
SETTLED = 0
"""End of a run: the motion repeats."""
STOPPED = 1
"""End of a run: the largest number of turns or steps is reached."""
REST = 2
"""End of a run: the loop is at rest."""
DIVERGED = 3
"""End of a run: OP is more than 1e5 bands from its origin."""
BUFFER_FULL = 4
"""End of a run: the buffer for the dead time is full."""
_BAND_WIDENING = 1.0 + 1e-11
"""Width of the break-away band over sb [-]: an input that equals it to within rounding has not crossed it."""
_MAX_REST_STEP = 32.0
"""Longest step while the stem rests and the last terms are negligible [-]."""


@kernel
def _polynomial(q, t):
    total = 0.0
    for k in range(q.shape[0] - 1, -1, -1):
        total = total * t + q[k]
    return total


@kernel
def _derivative(q, t):
    total = 0.0
    for k in range(q.shape[0] - 1, 0, -1):
        total = total * t + k * q[k]
    return total


@kernel
def _turning_point(q, a, b):
    """Where the slope of q changes sign between a and b."""
    rising = _derivative(q, a) > 0.0
    for _ in range(60):
        middle = 0.5 * (a + b)
        if middle in (a, b):
            break
        if (_derivative(q, middle) > 0.0) == rising:
            a = middle
        else:
            b = middle
    return 0.5 * (a + b)


@kernel
def _root(q, level, sign, a, b):
    """Root of sign (q - level) between a, where it is negative, and b, where it is not: Newton within a bracket."""
    t = b
    for _ in range(80):
        f = sign * (_polynomial(q, t) - level)
        if f >= 0.0:
            b = t
        else:
            a = t
        slope = sign * _derivative(q, t)
        new = t - f / slope if slope != 0.0 else 0.5 * (a + b)
        if not a < new < b:
            new = 0.5 * (a + b)
        if abs(new - t) <= 1e-15 or new in (a, b):
            t = new
            break
        t = new
    return t


@kernel
def _first_reach(q, level, sign, a, b):
    """First time in a..b at which sign (q - level) >= 0; -1 when it stays below."""
    if sign * (_polynomial(q, a) - level) >= 0.0:
        return a
    if sign * (_polynomial(q, b) - level) >= 0.0:
        return _root(q, level, sign, a, b)
    if sign * _derivative(q, a) > 0.0 and sign * _derivative(q, b) < 0.0:
        top = _turning_point(q, a, b)
        if sign * (_polynomial(q, top) - level) >= 0.0:
            return _root(q, level, sign, a, top)
    return -1.0


@kernel
def _first_slowdown(q, rate, sign, a, b):
    """First time in a..b at which the rate of q in direction `sign` is below `rate`; -1 when it never is."""
    if sign * _derivative(q, b) >= rate:
        return -1.0
    for _ in range(60):
        middle = 0.5 * (a + b)
        if middle in (a, b):
            break
        if sign * _derivative(q, middle) >= rate:
            a = middle
        else:
            b = middle
    return 0.5 * (a + b)


@kernel
def _shift_origin(q, s, out):
    """Coefficients of q about s."""
    n = q.shape[0]
    for k in range(n):
        out[k] = q[k]
    if s == 0.0:
        return
    for i in range(n - 1):
        for k in range(n - 2, i - 1, -1):
            out[k] += s * out[k + 1]


@kernel
def _extend_range(q, a, b, low, high):
    """Widen low..high to the values of q over a..b."""
    for t in (a, b):
        v = _polynomial(q, t)
        low, high = min(low, v), max(high, v)
    if (_derivative(q, a) > 0.0) != (_derivative(q, b) > 0.0):
        v = _polynomial(q, _turning_point(q, a, b))
        low, high = min(low, v), max(high, v)
    return low, high


class ContinuousLoop(NamedTuple):
    """A loop in units of the longest step, its states balanced."""

    A: Any
    """State matrix, shape (n, n)."""
    B: Any
    """Input of the stem, shape (n,)."""
    C: Any
    """States to the input of the valve, shape (n,)."""
    D: float
    """Stem to the input of the valve."""
    C_pv: Any
    """States to PV, shape (n,)."""
    D_pv: float
    """Stem to PV."""
    delay: float
    """Dead time [steps]."""
    sb: float
    """Band in which the stem rests [% of span]."""
    lag: float
    """Lag of a stem that follows [% of span]."""
    rate: float
    """Rate of the input below which the stem rests [% of span per step]."""


class RunLimits(NamedTuple):
    """When a run ends."""

    turns: int
    """Most turns [-]."""
    steps: int
    """Most steps [-]."""
    tolerance: float
    """Largest difference of turns that are the same, over band and states [-]."""


class RunSpace(NamedTuple):
    """Arrays that a run fills."""

    seg_t: Any
    """Times of the series stored for the dead time, shape (size,)."""
    seg_q: Any
    """Those series, shape (size, TERMS)."""
    turns: Any
    """A row for each turn down of the stem: time of rest at the top, level, OP high and low, PV high and low, times
    followed, slips, time until the turn; high and low are of the swing just ended."""
    states: Any
    """States at that rest, shape (n_turns, n)."""
    events: Any
    """Time and level of every rest, shape (n_events, 2)."""
    grid: Any
    """Times at which stem, OP and PV are wanted."""
    x: Any
    """Stem at these times."""
    op: Any
    """OP at these times, before the dead time."""
    pv: Any
    """PV at these times, before the dead time."""


@kernel
def simulate_events(loop, load_t, load, z, x, up, limits, space):
    """Run the loop from rest at `x` with the states `z` (n,), which are overwritten.

    `up` is the direction of the last motion. `load` (n_loads,) holds from the times `load_t`. Returns (why it ended,
    turns, events, time, period in turns).
    """
    A, B, C, D, C_pv, D_pv, delay, sb, lag, rate = loop
    most_turns, most_steps, tolerance = limits
    seg_t, seg_q, turns, states, events, grid, grid_x, grid_op, grid_pv = space
    n = z.shape[0]
    Z = np.zeros((TERMS, n))
    uq, xq, yq = np.zeros(TERMS), np.zeros(TERMS), np.zeros(TERMS)
    rested, largest = z.copy(), np.abs(z) + 1e-300
    size = seg_t.shape[0]
    head, cur = 0, 0
    t, rest_t, follows, followed, slips = 0.0, 0.0, False, 0.0, 0.0
    n_turns, n_events, at, k_load = 0, 0, 0, 0
    op_low, op_high, pv_low, pv_high = math.inf, -math.inf, math.inf, -math.inf
    band = sb * _BAND_WIDENING
    for _ in range(most_steps):
        while k_load + 1 < load_t.shape[0] and load_t[k_load + 1] <= t:
            k_load += 1
        v = load[k_load]
        cap = _MAX_REST_STEP
        if delay > 0.0:
            cap = min(cap, delay)
        if k_load + 1 < load_t.shape[0]:
            cap = min(cap, load_t[k_load + 1] - t)
        past = t - delay
        if delay > 0.0 and past >= 0.0:
            while cur + 1 < head and seg_t[(cur + 1) % size] <= past + 1e-12 * (1.0 + t):
                cur += 1
        elif delay > 0.0:
            cap = min(cap, -past)
        h = min(1.0, cap)
        if follows and delay > 0.0:
            q = seg_q[cur % size]
            _shift_origin(q, past - seg_t[cur % size], xq)
            if cur + 1 < head:
                h = min(h, seg_t[(cur + 1) % size] - past)
            xq[0] -= up * lag
            if up * (xq[0] - x) < -1e-9 * sb:
                follows, rest_t = False, t
                rested[:] = z
                if n_events < events.shape[0]:
                    events[n_events, 0], events[n_events, 1] = t, x
                    n_events += 1
        if not follows:
            for k in range(TERMS):
                xq[k] = 0.0
            xq[0] = x
        for i in range(n):
            Z[0, i] = z[i]
        for k in range(TERMS):
            if delay == 0.0 and follows:
                total = 0.0
                for i in range(n):
                    total += C[i] * Z[k, i]
                xq[k] = total - (up * lag if k == 0 else 0.0)
            drive = xq[k] + (v if k == 0 else 0.0)
            u, y = D * drive, D_pv * drive
            for i in range(n):
                u += C[i] * Z[k, i]
                y += C_pv[i] * Z[k, i]
                if k + 1 < TERMS:
                    total = B[i] * drive
                    for j in range(n):
                        total += A[i, j] * Z[k, j]
                    Z[k + 1, i] = total / (k + 1)
            uq[k], yq[k] = u, y
        if not follows:
            tail = 1e-32
            for i in range(n):
                tail = max(tail, abs(Z[TERMS - 1, i]) / largest[i], abs(Z[TERMS - 2, i]) / largest[i])
            h = min(max(1.0, (1e-16 / tail) ** (1.0 / (TERMS - 1))), cap)
        if delay > 0.0 and head - cur >= size:
            return BUFFER_FULL, n_turns, n_events, t, 0
        seg_t[head % size] = t
        for k in range(TERMS):
            seg_q[head % size, k] = uq[k]
        head += 1
        done, event, sign, op, speed = h, False, 0.0, 0.0, 0.0
        if delay == 0.0 or past >= 0.0:
            piece = cur if delay > 0.0 else head - 1
            begin = past if delay > 0.0 else t
            end = begin + h
            while True:
                q = seg_q[piece % size]
                origin = seg_t[piece % size]
                a, b = max(begin - origin, 0.0), end - origin
                last = True
                if delay > 0.0 and piece + 1 < head and seg_t[(piece + 1) % size] < end - 1e-12 * (1.0 + t):
                    b = seg_t[(piece + 1) % size] - origin
                    last = False
                if follows:
                    hit = _first_slowdown(q, rate, up, a, b)
                else:
                    hit = _first_reach(q, x + band, 1.0, a, b)
                    sign = 1.0
                    other = _first_reach(q, x - band, -1.0, a, b if hit < 0.0 else hit)
                    if other >= 0.0:
                        hit, sign = other, -1.0
                if hit >= 0.0:
                    event, b = True, hit
                    done = origin + hit - begin
                    op, speed = _polynomial(q, hit), _derivative(q, hit)
                op_low, op_high = _extend_range(q, a, b, op_low, op_high)
                if event or last:
                    break
                piece += 1
        pv_low, pv_high = _extend_range(yq, 0.0, done, pv_low, pv_high)
        while at < grid.shape[0] and grid[at] < t + done:
            local = grid[at] - t
            grid_x[at], grid_op[at], grid_pv[at] = (
                _polynomial(xq, local),
                _polynomial(uq, local),
                _polynomial(yq, local),
            )
            at += 1
        moved = 0.0
        for i in range(n):
            total = 0.0
            for k in range(TERMS - 1, -1, -1):
                total = total * done + Z[k, i]
            z[i] = total
            largest[i] = max(largest[i], abs(total))
            moved = max(moved, abs(Z[1, i]) / (largest[i] + sb * abs(B[i])))
        t += done
        if abs(uq[0]) > 1e5 * sb:
            return DIVERGED, n_turns, n_events, t, 0
        if not event:
            if follows:
                x = _polynomial(xq, done)
            elif moved < 1e-9 and t - rest_t > delay and k_load + 1 == load_t.shape[0]:
                return REST, n_turns, n_events, t, 0
            continue
        if follows:
            x = _polynomial(xq, done)
            follows = False
        else:
            if sign < 0.0 and up > 0.0:
                if n_turns < turns.shape[0]:
                    row = turns[n_turns]
                    row[0], row[1] = rest_t, x
                    row[2], row[3], row[4], row[5] = op_high, op_low, pv_high, pv_low
                    row[6], row[7], row[8] = followed, slips, t - rest_t
                    for i in range(n):
                        states[n_turns, i] = rested[i]
                n_turns += 1
                op_low, op_high, pv_low, pv_high = math.inf, -math.inf, math.inf, -math.inf
                followed, slips = 0.0, 0.0
                for m in range(1, 5):
                    if n_turns > m + 1:
                        change = abs(turns[n_turns - 1, 1] - turns[n_turns - 1 - m, 1]) / sb
                        for i in range(n):
                            change = max(change, abs(states[n_turns - 1, i] - states[n_turns - 1 - m, i]) / largest[i])
                        if change <= tolerance:
                            return SETTLED, n_turns, n_events, t, m
                if n_turns >= most_turns:
                    return STOPPED, n_turns, n_events, t, 0
            up = sign
            slips += 1.0
            x = op - up * lag
            if delay == 0.0:
                speed = 0.0
                for i in range(n):
                    total = B[i] * (x + v)
                    for j in range(n):
                        total += A[i, j] * z[j]
                    speed += C[i] * total
            follows = up * speed >= rate
            if follows:
                followed += 1.0
        if not follows:
            rest_t = t
            rested[:] = z
            if n_events < events.shape[0]:
                events[n_events, 0], events[n_events, 1] = t, x
                n_events += 1
    return STOPPED, n_turns, n_events, t, 0
