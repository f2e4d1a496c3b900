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

from stiction.models.compiled import kernel, summing

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
    the same. `floor` is the square that no sample falls below. `ends` (n_blocks,) are the samples at which blocks of time end, `blocks` (n, n_blocks) what is left in each; both may
    be empty. `S`, `J`, `stops`, `place` and `keep` (n,) are those of `stems`.
    """
    mv, valve = work.mv, work.valve
    lanes = mv.shape[0]
    _past(pv, order, begin, shocks, work.past)
    for base in range(0, S.shape[0], lanes):
        filled = min(lanes, S.shape[0] - base)
        for v in range(lanes):
            i = base + min(v, filled - 1)
            valve[0, v], valve[1, v], valve[2, v], valve[3, v], valve[4, v] = S[i], J[i], stops[i], place[i], keep[i]
        stems(op, width, valve[0], valve[1], valve[2], valve[3], valve[4], valve[5], valve[6], valve[7], valve[8], mv)
        for v in range(filled):
            left[base + v] = _error(pv, mv[v], order, edges, begin, shocks, floor, ends, blocks[base + v], work)


@kernel
def errors_of_stems(mv, pv, order, edges, begin, shocks, floor, ends, left, blocks, work):
    """Fill `left` and `blocks` as `prediction_errors` does, of stems `mv` (n, n_samples) that are known.

    Their means are taken off in place.
    """
    _past(pv, order, begin, shocks, work.past)
    for v in range(mv.shape[0]):
        left[v] = _error(pv, mv[v], order, edges, begin, shocks, floor, ends, blocks[v], work)


@summing
def _past(pv, order, begin, shocks, past):
    """Products of the PV's lags."""
    n = pv.shape[0]
    for i in range(order + 1):
        total = 0.0
        for k in range(begin, n):
            total += pv[k - i]
        for k in shocks:
            total -= pv[k - i]
        past[i, order + 1] = total
        for j in range(i + 1):
            total = 0.0
            for k in range(begin, n):
                total += pv[k - i] * pv[k - j]
            for k in shocks:
                total -= pv[k - i] * pv[k - j]
            past[i, j] = past[j, i] = total


@summing
def _error(pv, mv, order, edges, begin, shocks, floor, ends, blocks, work):
    """Sum of squares that one stem leaves, and what is left in each block; `work.past` is known."""
    samples = pv.shape[0] - begin - shocks.shape[0]
    lags = edges[edges.shape[0] - 1] - 1
    past, cross, stem = work.past, work.cross, work.stem
    _centre(mv)
    _products(pv, mv, order, lags, begin, cross, stem)
    _shifted(pv, mv, order, lags, begin, cross, stem)
    _without(pv, mv, order, lags, shocks, cross, stem)
    _normal(samples, order, edges, past, cross, stem, work.group, work.normal, work.weights)
    left = _solve(past[0, 0], work.normal, work.weights) + floor * samples
    if ends.shape[0] > 0:
        _weights(work.normal, work.weights)
        _residual(pv, mv, order, edges, begin, work.weights[0], work.residual)
        for k in shocks:
            work.residual[k] = 0.0
        _by_block(work.residual, begin, floor, ends, blocks)
    return left


@summing
def _centre(mv):
    """Take the mean off."""
    n = mv.shape[0]
    total = 0.0
    for k in range(n):
        total += mv[k]
    for k in range(n):
        mv[k] -= total / n


@summing
def _products(pv, mv, order, lags, begin, cross, stem):
    """Sums over the window: PV now by stem then, stem one ago by stem then, PV then by stem one ago, and the stem.

    Four lags at once, so that what they share is loaded once; past the last lag that one is done again.
    """
    n = mv.shape[0]
    size = n - begin
    now, one = pv[begin:n], mv[begin - 1 : n - 1]
    for lag in range(1, lags + 1, 4):
        second, third, fourth = min(lag + 1, lags), min(lag + 2, lags), min(lag + 3, lags)
        m0, m1 = mv[begin - lag : n - lag], mv[begin - second : n - second]
        m2, m3 = mv[begin - third : n - third], mv[begin - fourth : n - fourth]
        a0 = a1 = a2 = a3 = 0.0
        b0 = b1 = b2 = b3 = 0.0
        for k in range(size):
            a0 += now[k] * m0[k]
            a1 += now[k] * m1[k]
            a2 += now[k] * m2[k]
            a3 += now[k] * m3[k]
            b0 += one[k] * m0[k]
            b1 += one[k] * m1[k]
            b2 += one[k] * m2[k]
            b3 += one[k] * m3[k]
        cross[lag, 0], cross[second, 0], cross[third, 0], cross[fourth, 0] = a0, a1, a2, a3
        stem[lag, 1], stem[second, 1], stem[third, 1], stem[fourth, 1] = b0, b1, b2, b3
    for i in range(1, order + 1, 4):
        second, third, fourth = min(i + 1, order), min(i + 2, order), min(i + 3, order)
        y0, y1 = pv[begin - i : n - i], pv[begin - second : n - second]
        y2, y3 = pv[begin - third : n - third], pv[begin - fourth : n - fourth]
        a0 = a1 = a2 = a3 = 0.0
        for k in range(size):
            a0 += y0[k] * one[k]
            a1 += y1[k] * one[k]
            a2 += y2[k] * one[k]
            a3 += y3[k] * one[k]
        cross[1, i], cross[1, second], cross[1, third], cross[1, fourth] = a0, a1, a2, a3
    total = 0.0
    for k in range(size):
        total += one[k]
    stem[1, 0] = total


@summing
def _shifted(pv, mv, order, lags, begin, cross, stem):
    """Products of all pairs of lags from those of `_products`: shifting both costs only the edges of the window."""
    n = mv.shape[0]
    for lag in range(2, lags + 1):
        row, before = stem[lag], stem[lag - 1]
        enter, leave = mv[begin - lag : begin], mv[n - lag : n]
        row[0] = before[0] + enter[0] - leave[0]
        for other in range(2, lag + 1):
            row[other] = before[other - 1] + enter[0] * enter[lag - other] - leave[0] * leave[lag - other]
        for i in range(1, order + 1):
            cross[lag, i] = cross[lag - 1, i - 1] + pv[begin - i] * enter[0] - pv[n - i] * leave[0]


@summing
def _without(pv, mv, order, lags, shocks, cross, stem):
    """Take what the samples `shocks` add out of the products."""
    for k in shocks:
        for lag in range(1, lags + 1):
            then, row = mv[k - lag], stem[lag]
            row[0] -= then
            for other in range(1, lag + 1):
                row[other] -= then * mv[k - other]
            for i in range(order + 1):
                cross[lag, i] -= then * pv[k - i]


@summing
def _normal(samples, order, edges, past, cross, stem, group, normal, weights):
    """Normal equations: constant, lags of the PV, groups of the stem's lags; columns scaled to unit length."""
    groups = edges.shape[0] - 1
    size = 1 + order + groups
    right, scale = weights[0], weights[1]
    normal[0, 0] = samples
    right[0] = past[0, order + 1]
    for i in range(1, order + 1):
        normal[i, 0] = past[i, order + 1]
        right[i] = past[0, i]
        for j in range(1, i + 1):
            normal[i, j] = past[i, j]
    for g in range(groups):
        row, first, last = normal[1 + order + g], edges[g], edges[g + 1]
        for then in range(1, last):
            group[then] = 0.0
        for i in range(order + 1):
            row[i] = 0.0
        right[1 + order + g] = 0.0
        for lag in range(first, last):
            row[0] += stem[lag, 0]
            right[1 + order + g] += cross[lag, 0]
            for i in range(1, order + 1):
                row[i] += cross[lag, i]
            for then in range(1, lag + 1):
                group[then] += stem[lag, then]
            # The table holds each pair of lags once; within a group both of its halves count.
            for then in range(first, lag):
                group[then] += stem[lag, then]
        for other in range(g + 1):
            total = 0.0
            for then in range(edges[other], edges[other + 1]):
                total += group[then]
            row[1 + order + other] = total
    for i in range(size):
        scale[i] = 1.0 / math.sqrt(normal[i, i]) if normal[i, i] > 1e-12 * samples else 0.0
    for i in range(size):
        for j in range(i):
            normal[i, j] *= scale[i] * scale[j]
        normal[i, i] = 1.0 + 1e-9
        right[i] *= scale[i]


@summing
def _solve(energy, normal, weights):
    """What the regression leaves of `energy`.

    By Cholesky, in place, the right side along with it; a column that the ones before it explain gets no weight.
    """
    size = weights.shape[1]
    right = weights[0]
    left = energy
    for i in range(size):
        row = normal[i]
        for j in range(i + 1):
            total = row[j]
            for p in range(j):
                total -= row[p] * normal[j, p]
            if j < i:
                row[j] = total * normal[j, j]
            else:
                row[i] = 1.0 / math.sqrt(total) if total > 1e-8 else 0.0
        total = right[i]
        for p in range(i):
            total -= row[p] * right[p]
        right[i] = total * row[i]
        left -= right[i] * right[i]
    return max(left, 0.0)


@summing
def _weights(normal, weights):
    """Go on from `_solve` to the weights, in place of the right side."""
    size = weights.shape[1]
    right, scale = weights[0], weights[1]
    for back in range(size):
        i = size - 1 - back
        total = right[i]
        for p in range(i + 1, size):
            total -= normal[p, i] * right[p]
        right[i] = total * normal[i, i]
    for i in range(size):
        right[i] *= scale[i]


@summing
def _residual(pv, mv, order, edges, begin, weights, out):
    """Fill `out` (n_samples,) from `begin` on with what the regression leaves of the PV, a lag at a time."""
    n = pv.shape[0]
    now = out[begin:n]
    for k in range(n - begin):
        now[k] = pv[begin + k] - weights[0]
    for i in range(1, order + 1):
        then = pv[begin - i : n - i]
        for k in range(n - begin):
            now[k] -= weights[i] * then[k]
    for g in range(edges.shape[0] - 1):
        share = weights[1 + order + g]
        for lag in range(edges[g], edges[g + 1]):
            then = mv[begin - lag : n - lag]
            for k in range(n - begin):
                now[k] -= share * then[k]


@summing
def _by_block(residual, begin, floor, ends, out):
    """Fill `out` (n_blocks,) with the sums of squares left up to each of `ends`."""
    first = begin
    for b in range(ends.shape[0]):
        total = 0.0
        for k in range(first, ends[b]):
            total += residual[k] * residual[k]
        out[b] = total + floor * (ends[b] - first)
        first = ends[b]


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
