"""Valve positions of many candidate valves over one OP signal: the compiled part of the search."""

from __future__ import annotations

import numpy as np

from stiction.models.component import TIE_TOLERANCE
from stiction.models.numba_compile import kernel

__all__ = [
    "as_valve_arrays",
    "first_order_lags",
    "lag_products",
    "process_products",
    "relay_signals",
    "valve_positions",
    "whole_position",
]


@kernel
def valve_positions(op, per_block, S, J, rests, start, out):
    """Fill `out` (n_valves, n_blocks) with the mean valve position over blocks of `per_block` samples of `op`.

    The rule is Kano's. A resting stem moves when OP is more than (S + J) / 2 away from it; a moving one stays
    (S - J) / 2 behind OP while OP goes on in its direction. Where `rests` is true the stem rests again after every
    sample, as in the models of Stenman and of He. `start` is the first position, in units of (S + J) / 2 from OP.
    The valves are the inner loop, without branches, so that several are computed at once.
    """
    n = out.shape[0]
    edge, gap, goes = np.empty(n), np.empty(n), np.empty(n)
    position, direction, total = np.empty(n), np.zeros(n), np.empty(n)
    for v in range(n):  # expressions of whole arrays take seconds to compile
        half = 0.5 * (S[v] + J[v])
        edge[v], gap[v], goes[v] = half * (1.0 + TIE_TOLERANCE), 0.5 * (S[v] - J[v]), 0.0 if rests[v] else 1.0
        position[v] = op[0] + start[v] * half
    previous = op[0]
    for k in range(out.shape[1]):
        for v in range(n):
            total[v] = 0.0
        for i in range(k * per_block, (k + 1) * per_block):
            u = op[i]
            step = u - previous
            for v in range(n):
                was, way = position[v], direction[v]
                error = u - was
                moves, up, down = step * way > 0.0, error > edge[v], error < -edge[v]
                jumped = u - gap[v] if up else (u + gap[v] if down else was)
                turned = goes[v] if up else (-goes[v] if down else 0.0)
                now = u - way * gap[v] if moves else jumped
                position[v] = now
                direction[v] = way if moves else turned
                total[v] += now
            previous = u
        for v in range(n):
            out[v, k] = total[v] / per_block


@kernel
def relay_signals(x, low, high, out):
    """Fill `out` (n_relays, n_samples) with relays of `x`: 1 from `high` upwards, -1 from `low` downwards."""
    for i in range(out.shape[0]):
        state = 1.0 if x[0] >= 0.5 * (low[i] + high[i]) else -1.0
        for k in range(x.size):
            if x[k] >= high[i]:
                state = 1.0
            elif x[k] <= low[i]:
                state = -1.0
            out[i, k] = state


@kernel
def _first_order_lags(x, keep, settled, out):
    """Fill `out` with the rows of `x` behind a lag; four rows at a time, as each sample waits for the one before."""
    new = 1.0 - keep
    last = x.shape[0] - x.shape[0] % 4
    for row in range(0, last, 4):
        a = x[row, 0] if settled else 0.0
        b = x[row + 1, 0] if settled else 0.0
        c = x[row + 2, 0] if settled else 0.0
        d = x[row + 3, 0] if settled else 0.0
        for k in range(x.shape[1]):
            a = keep * a + new * x[row, k]
            b = keep * b + new * x[row + 1, k]
            c = keep * c + new * x[row + 2, k]
            d = keep * d + new * x[row + 3, k]
            out[row, k], out[row + 1, k], out[row + 2, k], out[row + 3, k] = a, b, c, d
    for row in range(last, x.shape[0]):
        a = x[row, 0] if settled else 0.0
        for k in range(x.shape[1]):
            a = keep * a + new * x[row, k]
            out[row, k] = a


@kernel
def _add_correlation(factor, window, out, size):
    """Add to each out[i] the sum of factor[t] window[t + i]; four samples at a time, as each sum waits for the last."""
    whole = factor.size - factor.size % 4
    for t in range(0, whole, 4):
        a, b, c, d = factor[t], factor[t + 1], factor[t + 2], factor[t + 3]
        w, x, y, z = window[t:], window[t + 1 :], window[t + 2 :], window[t + 3 :]
        for i in range(size):
            out[i] += a * w[i] + b * x[i] + c * y[i] + d * z[i]
    for t in range(whole, factor.size):
        for i in range(size):
            out[i] += factor[t] * window[t + i]


@kernel
def _to_next_lags(products, at, size, begins, ends, signal, start, stop, shortest):
    """Replace products by those of the next lags: one sample more at the start, one less at the end."""
    for i in range(size - 1):
        products[at + i] = products[at + i + 1] + begins * signal[start + i] - ends * signal[stop + i]
    products[at + size - 1] = shortest


@kernel
def lag_products(x, pv, op, first, groups, first_products, n_pv, now, own, shared):
    """Add to `own` and `shared` products of lags, summed over the samples from `first` on, for each row of `x`.

    The lags of `x` (n, n_samples) begin at 1 and are added up in `groups` (n_x_lags,). `own` (n, n_groups, n_groups)
    are the products of the groups, `shared` (n, n_groups, 1 + n_pv + n_op) those with a constant, with lags n_pv - 1
    to 0 of `pv` and lags n_op to 1 of `op`. `first_products` (n, ...) are those of lag 1 with the lags of `pv` and
    `op`, of the other lags with lag 0 of `pv`, and of these with lag 1 of `op`. The products of lags i + 1 and j + 1
    are those of i and j but for one sample at each end; `now` (2 n_x_lags + n_pv + n_op,) is room for those of one lag.
    """
    n, longest, n_op = x.shape[1], groups.size, shared.shape[2] - 1 - n_pv
    by_op, end = longest + n_pv, longest + n_pv + n_op
    for v in range(x.shape[0]):
        row, given = x[v], first_products[v]
        total = 0.0
        for k in range(first - 1, n - 1):
            total += row[k]
        for i in range(longest):
            now[i] = 0.0
        for i in range(longest, end):
            now[i] = given[i - longest]
        _add_correlation(row[first - 1 : n - 1], row[first - longest :], now, longest)
        for i in range(longest):
            now[end + i] = now[longest - 1 - i]
        for i in range(longest):
            g, begins, ends = groups[i], row[first - 2 - i], row[n - 2 - i]
            for j in range(longest):
                own[v, g, groups[longest - 1 - j]] += now[j]
            shared[v, g, 0] += total
            for j in range(longest, end):
                shared[v, g, 1 + j - longest] += now[j]
            if i + 1 < longest:
                total += begins - ends
                _to_next_lags(now, 0, longest, begins, ends, row, first - longest, n - longest, now[end + i + 1])
                k = end - longest + i
                _to_next_lags(now, longest, n_pv, begins, ends, pv, first - n_pv + 1, n - n_pv + 1, given[k])
                _to_next_lags(now, by_op, n_op, begins, ends, op, first - n_op, n - n_op, given[k + longest - 1])


@kernel
def process_products(u, keep_slow, keep_fast, dead_time, target, first, last):
    """Products of the answer of a process to `u` with itself and with `target`, summed from `first` to `last`.

    The process has unit gain, two lags which keep a share of their state from sample to sample (1 for an integrator)
    and a dead time, which need not be whole [samples]. The answer is taken about its mean over the record.
    """
    whole = int(dead_time)
    part = dead_time - whole
    slow, fast = 0.0, 0.0
    now = (1.0 - keep_fast) * (u[0] if keep_slow == 1.0 else (1.0 - keep_slow) * u[0])
    before = now
    total, in_part, square, cross, of_target = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(u.size):
        if k >= whole:
            x = u[k - whole]
            slow = slow + x if keep_slow == 1.0 else keep_slow * slow + (1.0 - keep_slow) * x
            fast = keep_fast * fast + (1.0 - keep_fast) * slow
            before = now
            now = fast
        answer = now + part * (before - now)
        total += answer
        if first <= k < last:
            in_part += answer
            square += answer * answer
            cross += answer * target[k]
            of_target += target[k]
    mean = total / u.size
    return square - 2.0 * mean * in_part + (last - first) * mean * mean, cross - mean * of_target


def as_valve_arrays(valves: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Split candidate rows (S, J / S, rests, start) into the arrays that `valve_positions` takes."""
    S, ratio, rests, start = (np.ascontiguousarray(column) for column in valves.T)
    return S, S * ratio, rests > 0.0, start


def whole_position(op: np.ndarray, valve: tuple[float, float, float, float]) -> np.ndarray:
    """Position of a valve over the whole record, shape of `op` [% of span]."""
    out = np.empty((1, op.size))
    valve_positions(np.ascontiguousarray(op), 1, *as_valve_arrays(np.array([valve])), out)
    return out[0]


def first_order_lags(x: np.ndarray, lag: float, *, settled: bool, out: np.ndarray | None = None) -> np.ndarray:
    """A signal, or one in each row, behind a lag [samples] of unit gain: at rest at its first value, or at 0.

    It is written to `out` where memory is given.
    """
    if lag <= 0.0:
        return x
    rows = np.ascontiguousarray(np.atleast_2d(x))
    out = np.empty_like(rows) if out is None else out
    _first_order_lags(rows, float(np.exp(-1.0 / max(lag, 1e-3))), settled, out)
    return out.reshape(x.shape)
