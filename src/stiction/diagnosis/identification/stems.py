"""Valve positions of many candidate valves over one OP signal: the compiled part of the search."""

from __future__ import annotations

import numpy as np

from stiction.models.component import TIE_TOLERANCE
from stiction.models.numba_compile import kernel

__all__ = ["as_valve_arrays", "relay_signals", "valve_positions", "whole_position"]


@kernel
def valve_positions(op, per_block, S, J, rests, start, out):
    """Fill `out` (n_valves, n_blocks) with the mean valve position over blocks of `per_block` samples of `op`.

    The rule is Kano's. A resting stem moves when OP is more than (S + J) / 2 away from it; a moving one stays
    (S - J) / 2 behind OP while OP goes on in its direction. Where `rests` is true the stem rests again after every
    sample, as in the models of Stenman and of He. `start` is the first position, in units of (S + J) / 2 from OP.
    """
    for v in range(out.shape[0]):
        half = 0.5 * (S[v] + J[v])
        edge = half * (1.0 + TIE_TOLERANCE)
        gap = 0.5 * (S[v] - J[v])
        position = op[0] + start[v] * half
        direction = 0.0
        previous = op[0]
        for k in range(out.shape[1]):
            total = 0.0
            for i in range(k * per_block, (k + 1) * per_block):
                u = op[i]
                error = u - position
                if (u - previous) * direction > 0.0:
                    position = u - direction * gap
                elif error > edge:
                    position = u - gap
                    direction = 0.0 if rests[v] else 1.0
                elif error < -edge:
                    position = u + gap
                    direction = 0.0 if rests[v] else -1.0
                else:
                    direction = 0.0
                previous = u
                total += position
            out[v, k] = total / per_block


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


def as_valve_arrays(valves: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Split candidate rows (S, J / S, rests, start) into the arrays that `valve_positions` takes."""
    S, ratio, rests, start = (np.ascontiguousarray(column) for column in valves.T)
    return S, S * ratio, rests > 0.0, start


def whole_position(op: np.ndarray, valve: tuple[float, float, float, float]) -> np.ndarray:
    """Position of a valve over the whole record, shape of `op` [% of span]."""
    out = np.empty((1, op.size))
    valve_positions(np.ascontiguousarray(op), 1, *as_valve_arrays(np.array([valve])), out)
    return out[0]
