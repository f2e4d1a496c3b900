"""Valve positions of many candidate valves over one OP signal: the compiled part of the search."""

from __future__ import annotations

import numpy as np

from stiction.models.component import TIE_TOLERANCE
from stiction.models.numba_compile import kernel

__all__ = [
    "add_lag_products",
    "as_valve_arrays",
    "first_order_lags",
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
    half, gap = 0.5 * (S + J), 0.5 * (S - J)
    edge, goes = half * (1.0 + TIE_TOLERANCE), np.where(rests, 0.0, 1.0)
    position, direction, total = op[0] + start * half, np.zeros(n), np.zeros(n)
    previous = op[0]
    for k in range(out.shape[1]):
        total[:] = 0.0
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
def add_lag_products(x, z, first, shortest, first_products, x_groups, z_groups, out):
    """Add to `out` (n, n_x_groups, n_z_groups) the sums over t >= `first` of x[t - 1 - i] z[t - `shortest` - j].

    `first_products` (n, n_z_lags + n_x_lags - 1) are those of i = 0, then those of j = 0. `x` has n rows, `z` 1 or n.
    """
    last, n_z = x.shape[1] - 1, z_groups.size
    for v in range(x.shape[0]):
        w = v if z.shape[0] > 1 else 0
        for k in range(first_products.shape[1]):
            i, j = (0, k) if k < n_z else (k - n_z + 1, 0)
            total = first_products[v, k]
            out[v, x_groups[i], z_groups[j]] += total
            for step in range(1, min(x_groups.size - i, n_z - j)):
                p, q = i + step, j + step
                total += x[v, first - 1 - p] * z[w, first - shortest - q]
                total -= x[v, last - p] * z[w, last + 1 - shortest - q]
                out[v, x_groups[p], z_groups[q]] += total


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
