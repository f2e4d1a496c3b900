"""Prediction error of many valves at once: how well each stem, together with the PV's own past, foretells the PV.

A regression with lags of the PV and of the stem (ARX) takes process and disturbance together: what a load, a wave
from outside or a drift leave in a simulation is foretold from the PV's past, and what is left is the part of the PV
that is new in each sample. Slips are new. The regression is solved for each valve from sums of products, which are
those of neighbouring lags but for the edges of the window, so that a valve costs two products for each lag and sample.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.regression import left_over, past_products
from stiction.models.compiled import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Desk", "apart", "desk", "errors_of_stems", "prediction_errors", "stems"]

LANES = 32
"""Valves handled side by side."""


class Desk(NamedTuple):
    """Work space of `prediction_errors`, one for each thread."""

    mv: NDArray[np.float64]
    """Stem positions, a valve a row, shape (n_lanes, n_samples)."""
    valve: NDArray[np.float64]
    """Vectors: S, J, rule, place, share kept, position, direction, air, stem; shape (9, n_lanes)."""
    past: NDArray[np.float64]
    """Products of the PV's lags with one another, their sums in the last column, shape (order + 1, order + 2)."""
    cross: NDArray[np.float64]
    """Products of the stem's lags with the PV's, shape (lags + 1, order + 1)."""
    stem: NDArray[np.float64]
    """Products of the stem's lags with those up to them; column 0 their sums. Shape (lags + 1, lags + 1)."""
    group: NDArray[np.float64]
    """Products of a group of the stem's lags with each lag, shape (lags + 1,)."""
    normal: NDArray[np.float64]
    """Normal equations, then their triangular root, shape (n_weights, n_weights)."""
    weights: NDArray[np.float64]
    """Right side, then weights; and the scales of the columns, shape (2, n_weights)."""
    residual: NDArray[np.float64]
    """What the regression leaves, shape (n_samples,)."""


def desk(n_samples: int, order: int, edges: NDArray[np.int64]) -> Desk:
    """Allocate what `prediction_errors` works in.

    Parameters
    ----------
    n_samples : int
        Length of the PV [samples].
    order : int
        Lags of the PV [-].
    edges : ndarray, shape (n_groups + 1,)
        Lags of the stem at which groups begin, and one past the last [samples].

    Returns
    -------
    Desk
        Arrays without content.
    """
    lags, weights = int(edges[-1]) - 1, order + edges.size
    return Desk(
        mv=np.empty((LANES, n_samples)),
        valve=np.empty((9, LANES)),
        past=np.empty((order + 1, order + 2)),
        cross=np.empty((lags + 1, order + 1)),
        stem=np.empty((lags + 1, lags + 1)),
        group=np.empty(lags + 1),
        normal=np.empty((weights, weights)),
        weights=np.empty((2, weights)),
        residual=np.empty(n_samples),
    )


@kernel
def stems(op, width, S, J, stops, place, keep, x, moving, air, mean, mv):
    """Fill `mv` (n_lanes, n_blocks) with each stem's mean over blocks of `width` samples of `op`.

    The rule is Kano's of `follow`, of the air, which keeps a share `keep` of its way to OP from sample to sample; where
    `stops` is 1 a stem rests again after every sample, as He's does. Each begins `place` half bands off the first OP.
    `x`, `moving`, `air` and `mean` (n_lanes,) are work space, and `S`, `J` and `stops` are lost: half of S + J, half
    of S - J and 1 - `stops` take their places.
    """
    lanes, n = mv.shape
    share = 1.0 / width
    for v in range(lanes):
        x[v] = op[0] + place[v] * 0.5 * (S[v] + J[v])
        moving[v] = 0.0
        air[v] = op[0]
        S[v], J[v] = 0.5 * (S[v] + J[v]) * (1.0 + 1e-9), 0.5 * (S[v] - J[v])
        stops[v] = 1.0 - stops[v]
    for k in range(n):
        for v in range(lanes):
            mean[v] = 0.0
        for i in range(k * width, (k + 1) * width):
            for v in range(lanes):
                u = op[i] + keep[v] * (air[v] - op[i])
                du = u - air[v]
                air[v] = u
                e = u - x[v]
                way = 1.0 if e > 0.0 else -1.0
                way = way if abs(e) > S[v] else 0.0
                way = moving[v] if du * moving[v] > 0.0 else way
                x[v] = u - way * J[v] if way != 0.0 else x[v]
                moving[v] = way * stops[v]
                mean[v] += share * x[v]
        for v in range(lanes):
            mv[v, k] = mean[v]


@kernel
def prediction_errors(
    op, width, pv, order, edges, begin, shocks, floor, S, J, stops, place, keep, ends, left, blocks, work
):
    """Fill `left` (n,) with the sum of squares that each valve leaves of `pv` (n_samples,) from `begin` on.

    `op` holds `width` samples for each one of `pv`. The regression takes a constant, `order` lags of the PV, and
    sums of the stem's lags edges[g] <= lag < edges[g + 1]; a lag of at least 1 keeps the noise that the controller
    hands on to the OP out of its own prediction. The samples `shocks` are not foretold, and are past of others all
    the same. `floor` is the square that no sample falls below. `ends` (n_blocks,) are the samples at which blocks of
    time end, `blocks` (n, n_blocks) what is left in each; both may be empty. `S`, `J`, `stops`, `place` and `keep` (n,)
    are those of `stems`.
    """
    mv, valve = work.mv, work.valve
    lanes = mv.shape[0]
    past_products(pv, order, begin, shocks, work.past)
    for base in range(0, S.shape[0], lanes):
        filled = min(lanes, S.shape[0] - base)
        for v in range(lanes):
            i = base + min(v, filled - 1)
            valve[0, v], valve[1, v], valve[2, v], valve[3, v], valve[4, v] = S[i], J[i], stops[i], place[i], keep[i]
        stems(op, width, valve[0], valve[1], valve[2], valve[3], valve[4], valve[5], valve[6], valve[7], valve[8], mv)
        for v in range(filled):
            left[base + v] = left_over(pv, mv[v], order, edges, begin, shocks, floor, ends, blocks[base + v], work)


@kernel
def errors_of_stems(mv, pv, order, edges, begin, shocks, floor, ends, left, blocks, work):
    """Fill `left` and `blocks` as `prediction_errors` does, of stems `mv` (n, n_samples) that are known.

    Their means are taken off in place.
    """
    past_products(pv, order, begin, shocks, work.past)
    for v in range(mv.shape[0]):
        left[v] = left_over(pv, mv[v], order, edges, begin, shocks, floor, ends, blocks[v], work)


@kernel
def apart(place, chosen):
    """Fill `chosen` with the first rows of `place` (n, n_axes) that lie more than 1 from all before; how many."""
    count = 0
    for i in range(place.shape[0]):
        alone = True
        for c in range(count):
            near = True
            for axis in range(place.shape[1]):
                near = near and abs(place[i, axis] - place[chosen[c], axis]) <= 1.0
            alone = alone and not near
        if alone:
            chosen[count] = i
            count += 1
            if count == chosen.shape[0]:
                break
    return count
