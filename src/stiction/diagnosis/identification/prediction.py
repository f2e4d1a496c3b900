"""Prediction error of many valves at once: how well each stem, together with the PV's own past, foretells the PV.

A regression with lags of the PV and of the stem (ARX) takes process and disturbance together: what a load, a wave
from outside or a drift leave in a simulation is foretold from the PV's past, and what is left is the part of the PV
that is new in each sample. Slips are new. The regression is solved for each valve from sums of products, which are
those of neighbouring lags but for the edges of the window, so that a valve costs two products for each lag and sample.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.models.compiled import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Desk", "desk", "prediction_errors", "stems"]

LANES = 32
"""Valves handled side by side."""


class Desk(NamedTuple):
    """Work space of `prediction_errors`, one for each thread."""

    mv: NDArray[np.float64]
    """Stem positions, shape (n_samples, n_lanes)."""
    valve: NDArray[np.float64]
    """Vectors: S, J, rule, place, position, direction, sum; shape (7, n_lanes)."""
    products: NDArray[np.float64]
    """Sums of products by lag, shape (2 lags + order + 1, n_lanes)."""
    past: NDArray[np.float64]
    """Products of the PV's lags with one another, shape (order + 1, order + 1)."""
    cross: NDArray[np.float64]
    """Products of the PV's lags with the stem's, shape (order + 1, lags + 1)."""
    stem: NDArray[np.float64]
    """Products of the stem's lags with one another; row 0 their sums. Shape (lags + 1, lags + 1)."""
    normal: NDArray[np.float64]
    """Normal equations, then their triangular root, shape (n_weights, n_weights)."""
    weights: NDArray[np.float64]
    """Right side, then weights; and the scales of the columns, shape (2, n_weights)."""


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
        mv=np.empty((n_samples, LANES)),
        valve=np.empty((7, LANES)),
        products=np.empty((2 * lags + order + 1, LANES)),
        past=np.empty((order + 1, order + 1)),
        cross=np.empty((order + 1, lags + 1)),
        stem=np.empty((lags + 1, lags + 1)),
        normal=np.empty((weights, weights)),
        weights=np.empty((2, weights)),
    )


@kernel
def stems(op, width, S, J, stops, place, x, moving, mv):
    """Fill `mv` (n_blocks, n_lanes) with each stem's mean over blocks of `width` samples of `op`.

    The rule is Kano's of `follow`; where `stops` is 1 a stem rests again after every sample, as He's does. Each
    begins `place` half bands off the first OP. `x` and `moving` (n_lanes,) are work space.
    """
    n, lanes = mv.shape
    share = 1.0 / width
    before = op[0]
    for v in range(lanes):
        x[v] = before + place[v] * 0.5 * (S[v] + J[v])
        moving[v] = 0.0
    for k in range(n):
        row = mv[k]
        for v in range(lanes):
            row[v] = 0.0
        for i in range(k * width, (k + 1) * width):
            u = op[i]
            du = u - before
            before = u
            for v in range(lanes):
                e = u - x[v]
                way = 1.0 if e > 0.0 else -1.0
                way = way if abs(e) > 0.5 * (S[v] + J[v]) * (1.0 + 1e-9) else 0.0
                way = moving[v] if du * moving[v] > 0.0 else way
                x[v] = u - way * 0.5 * (S[v] - J[v]) if way != 0.0 else x[v]
                moving[v] = way * (1.0 - stops[v])
                row[v] += share * x[v]


@kernel
def prediction_errors(op, width, pv, order, edges, begin, floor, S, J, stops, place, ends, left, blocks, work):
    """Fill `left` (n,) with the sum of squares that each valve leaves of `pv` (n_samples,) from `begin` on.

    `op` holds `width` samples for each one of `pv`. The regression takes a constant, `order` lags of the PV, and
    sums of the stem's lags edges[g] <= lag < edges[g + 1]; a lag of at least 1 keeps the noise that the controller
    hands on to the OP out of its own prediction. `floor` is the square that no sample falls below. `ends`
    (n_blocks,) are the samples at which blocks of time end, `blocks` (n, n_blocks) what is left in each; both may
    be empty. `S`, `J`, `stops` and `place` (n,) are those of `stems`.
    """
    n = pv.shape[0]
    lanes = work.mv.shape[1]
    groups = edges.shape[0] - 1
    lags = edges[groups] - 1
    past, cross, stem, mv = work.past, work.cross, work.stem, work.mv
    for i in range(order + 1):
        total = 0.0
        for k in range(begin, n):
            total += pv[k - i]
        cross[i, 0] = total
        for j in range(i + 1):
            total = 0.0
            for k in range(begin, n):
                total += pv[k - i] * pv[k - j]
            past[i, j] = past[j, i] = total
    for base in range(0, S.shape[0], lanes):
        filled = min(lanes, S.shape[0] - base)
        valve = work.valve
        for v in range(lanes):
            i = base + min(v, filled - 1)
            valve[0, v], valve[1, v], valve[2, v], valve[3, v] = S[i], J[i], stops[i], place[i]
        stems(op, width, valve[0], valve[1], valve[2], valve[3], valve[4], valve[5], mv)
        _centre(mv, valve[6])
        _products(pv, mv, order, lags, begin, work.products)
        for v in range(filled):
            _lagged(pv, mv, v, order, lags, begin, work.products, cross, stem)
            _normal(n - begin, order, edges, past, cross, stem, work.normal, work.weights)
            left[base + v] = _solve(past[0, 0], work.normal, work.weights) + floor * (n - begin)
            if ends.shape[0] > 0:
                _by_block(pv, mv, v, order, edges, begin, floor, ends, work.weights, blocks[base + v])


@kernel
def _centre(mv, total):
    """Take each lane's mean off."""
    n, lanes = mv.shape
    for v in range(lanes):
        total[v] = 0.0
    for k in range(n):
        for v in range(lanes):
            total[v] += mv[k, v]
    for k in range(n):
        for v in range(lanes):
            mv[k, v] -= total[v] / n


@kernel
def _products(pv, mv, order, lags, begin, out):
    """Sums over the window: PV now by stem then, stem one ago by stem then, PV then by stem one ago, and the stem."""
    n, lanes = mv.shape
    for p in range(out.shape[0]):
        for v in range(lanes):
            out[p, v] = 0.0
    for k in range(begin, n):
        now, one = pv[k], mv[k - 1]
        for lag in range(1, lags + 1):
            then, first, second = mv[k - lag], out[lag - 1], out[lags + lag - 1]
            for v in range(lanes):
                first[v] += now * then[v]
                second[v] += one[v] * then[v]
        for i in range(1, order + 1):
            then_pv, third = pv[k - i], out[2 * lags + i - 1]
            for v in range(lanes):
                third[v] += then_pv * one[v]
        last = out[2 * lags + order]
        for v in range(lanes):
            last[v] += one[v]


@kernel
def _lagged(pv, mv, v, order, lags, begin, sums, cross, stem):
    """Products of all pairs of lags of lane `v` from those of `_products`: shifting both costs only the edges."""
    n = mv.shape[0]
    for lag in range(1, lags + 1):
        cross[0, lag] = sums[lag - 1, v]
        stem[1, lag] = sums[lags + lag - 1, v]
    for i in range(1, order + 1):
        cross[i, 1] = sums[2 * lags + i - 1, v]
    stem[0, 1] = sums[2 * lags + order, v]
    for lag in range(2, lags + 1):
        enters, leaves = mv[begin - lag, v], mv[n - lag, v]
        stem[0, lag] = stem[0, lag - 1] + enters - leaves
        for i in range(1, order + 1):
            cross[i, lag] = cross[i - 1, lag - 1] + pv[begin - i] * enters - pv[n - i] * leaves
        for other in range(2, lag + 1):
            both = stem[other - 1, lag - 1] + enters * mv[begin - other, v] - leaves * mv[n - other, v]
            stem[other, lag] = both
    for lag in range(1, lags + 1):
        for other in range(lag + 1, lags + 1):
            stem[other, lag] = stem[lag, other]


@kernel
def _normal(samples, order, edges, past, cross, stem, normal, weights):
    """Normal equations: constant, lags of the PV, groups of the stem's lags; columns scaled to unit length."""
    groups = edges.shape[0] - 1
    size = 1 + order + groups
    right, scale = weights[0], weights[1]
    normal[0, 0] = samples
    right[0] = cross[0, 0]
    for i in range(1, order + 1):
        normal[i, 0] = cross[i, 0]
        right[i] = past[0, i]
        for j in range(1, i + 1):
            normal[i, j] = past[i, j]
    for g in range(groups):
        row = 1 + order + g
        constant = 0.0
        answer = 0.0
        for lag in range(edges[g], edges[g + 1]):
            constant += stem[0, lag]
            answer += cross[0, lag]
        normal[row, 0] = constant
        right[row] = answer
        for i in range(1, order + 1):
            total = 0.0
            for lag in range(edges[g], edges[g + 1]):
                total += cross[i, lag]
            normal[row, i] = total
        for other in range(g + 1):
            total = 0.0
            for lag in range(edges[g], edges[g + 1]):
                for then in range(edges[other], edges[other + 1]):
                    total += stem[lag, then]
            normal[row, 1 + order + other] = total
    for i in range(size):
        scale[i] = 1.0 / math.sqrt(normal[i, i]) if normal[i, i] > 1e-12 * samples else 0.0
    for i in range(size):
        for j in range(i):
            normal[i, j] *= scale[i] * scale[j]
        normal[i, i] = 1.0 + 1e-9
        right[i] *= scale[i]


@kernel
def _solve(energy, normal, weights):
    """What the regression leaves of `energy`; the weights in place of the right side.

    By Cholesky; a column that the ones before it explain gets no weight.
    """
    size = weights.shape[1]
    right, scale = weights[0], weights[1]
    left = energy
    for i in range(size):
        for j in range(i + 1):
            total = normal[i, j]
            for p in range(j):
                total -= normal[i, p] * normal[j, p]
            if j < i:
                normal[i, j] = total * normal[j, j]
            else:
                normal[i, i] = 1.0 / math.sqrt(total) if total > 1e-8 else 0.0
        total = right[i]
        for p in range(i):
            total -= normal[i, p] * right[p]
        right[i] = total * normal[i, i]
        left -= right[i] * right[i]
    for back in range(size):
        i = size - 1 - back
        total = right[i]
        for p in range(i + 1, size):
            total -= normal[p, i] * right[p]
        right[i] = total * normal[i, i]
    for i in range(size):
        right[i] *= scale[i]
    return max(left, 0.0)


@kernel
def _by_block(pv, mv, v, order, edges, begin, floor, ends, weights, out):
    """Fill `out` (n_blocks,) with the sums of squares left up to each of `ends`."""
    right = weights[0]
    k = begin
    for b in range(ends.shape[0]):
        total = 0.0
        while k < ends[b]:
            left = pv[k] - right[0]
            for i in range(1, order + 1):
                left -= right[i] * pv[k - i]
            for g in range(edges.shape[0] - 1):
                group = 0.0
                for lag in range(edges[g], edges[g + 1]):
                    group += mv[k - lag, v]
                left -= right[1 + order + g] * group
            total += left * left + floor
            k += 1
        out[b] = total
