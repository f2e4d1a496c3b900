"""One stem's regression, from sums of products: what it leaves of the PV, in all and in blocks of time."""

from __future__ import annotations

import math

from stiction.models.compiled import summing

__all__ = ["left_over", "past_products"]


@summing
def past_products(pv, order, begin, shocks, past):
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
def left_over(pv, mv, order, edges, begin, shocks, floor, ends, blocks, work):
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
