"""Regressions of many stems side by side, from sums of products: what each leaves of the PV, in all and block by block.

Stems stand in lanes, the last axis of every table, so that a step of the algebra is one step of all. What the lags of
PV and OP, the past, have to do with one another no stem changes: they are factored once.
"""

from __future__ import annotations

import math

from stiction.models.compiled import fused, inlined, summing

__all__ = ["group_rows", "left_over", "past", "shifted", "solve"]

NUGGET = 1e-9
"""Added to the diagonal of normal equations whose columns have unit length [-]: far above the rounding of their
products, far below what a column must add to matter."""
EXPLAINED = 1e-8
"""Share of a column's square that those before it must leave for it to get a weight [-]: of one that they explain the
nugget is left, a tenth of this."""
EMPTY = 1e-12
"""Mean square up to which a column is none: that of signals is 1, but that of a stem or an OP that rests."""


@summing
def past(pv, op, order, op_order, begin, shocks, own):
    """Fill `own` with the factored normal equations of the PV on a constant, its own lags and OP's; what they leave.

    Columns 0 to `order` + `op_order` of `own`, as many rows and two more columns, hold the triangular root, 1 over it
    on the diagonal; then come the right side, solved for, and the scale that brings each column to unit length.
    """
    n, last = pv.shape[0], order + op_order + 1
    samples = n - begin - shocks.shape[0]
    own[0, 0], own[0, last] = samples, _sum(pv, 0, begin, shocks)
    for i in range(1, last):
        x, lag = (pv, i) if i <= order else (op, i - order)
        own[i, 0], own[i, last] = _sum(x, lag, begin, shocks), _product(x, lag, pv, 0, begin, shocks)
        for j in range(1, i + 1):
            y, other = (pv, j) if j <= order else (op, j - order)
            own[i, j] = _product(x, lag, y, other, begin, shocks)
    left = _product(pv, 0, pv, 0, begin, shocks)
    for i in range(last):
        row = own[i]
        scale = 1.0 / math.sqrt(row[i]) if row[i] > EMPTY * samples else 0.0
        rest, right = 1.0 + NUGGET, row[last] * scale
        for j in range(i):
            total = row[j] * scale * own[j, last + 1]
            for p in range(j):
                total -= row[p] * own[j, p]
            row[j] = total * own[j, j]
            rest -= row[j] * row[j]
            right -= row[j] * own[j, last]
        row[i] = 1.0 / math.sqrt(rest) if rest > EXPLAINED else 0.0
        row[last], row[last + 1] = right * row[i], scale
        left -= row[last] * row[last]
    return left


@summing
def _sum(x, lag, begin, shocks):
    """Sum of a signal's lag."""
    n = x.shape[0]
    one = x[begin - lag : n - lag]
    total = 0.0
    for k in range(n - begin):
        total += one[k]
    for k in shocks:
        total -= x[k - lag]
    return total


@summing
def _product(x, lag, y, other, begin, shocks):
    """Sum of products of two signals' lags."""
    n = x.shape[0]
    one, two = x[begin - lag : n - lag], y[begin - other : n - other]
    total = 0.0
    for k in range(n - begin):
        total += one[k] * two[k]
    for k in shocks:
        total -= x[k - lag] * y[k - other]
    return total


@summing
def left_over(pv, op, lanes, order, op_order, edges, begin, shocks, floor, energy, ends, base, left, blocks, work):
    """Fill `left` from `base` on with the sum of squares that each of `lanes` stems leaves, `blocks` with its parts.

    The stems are those of `work.mv`, whose means are taken off in place; `work.own` is known, and `energy` what it
    leaves.
    """
    samples = pv.shape[0] - begin - shocks.shape[0]
    lags, groups = edges[edges.shape[0] - 1] - 1, edges.shape[0] - 1
    cross, stem, rows, weights = work.cross, work.stem, work.rows, work.weights
    n = pv.shape[0]
    for v in range(lanes):
        mv = work.mv[v, :n]
        _centre(mv)
        _products(pv, op, mv, v, order, op_order, lags, begin, cross, stem, work.edge)
    shifted(pv, op, lanes, order, op_order, lags, begin, work.edge, cross, stem)
    _without(pv, op, work.mv, lanes, order, op_order, lags, shocks, cross, stem)
    before = order + op_order
    group_rows(lanes, before, edges, cross, stem, work.group, rows, weights)
    solve(lanes, samples, before, groups, work.own, rows, weights, work.left)
    for v in range(lanes):
        left[base + v] = max(energy - work.left[v], 0.0) + floor * samples
    if ends.shape[0] > 0:
        _weights(lanes, before, groups, work.own, rows, weights)
        for v in range(lanes):
            _residual(pv, op, work.mv[v, :n], v, order, op_order, edges, begin, weights, work.share, work.residual)
            for k in shocks:
                work.residual[k] = 0.0
            _by_block(work.residual, begin, floor, ends, blocks[base + v])


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
def _products(pv, op, mv, v, order, op_order, lags, begin, cross, stem, edge):
    """Sums over the window: PV now, stem and OP one ago by stem then, PV and OP then by stem one ago, and the stem.

    Three lags at once, so that what they share is loaded once and the sums stay in registers; past the last lag that
    one is done again. `edge` gets the stem before the window's first sample and before the one past its last.
    """
    n = mv.shape[0]
    # Without lags of OP their sums go where those of the PV's last lag, which come later, replace them.
    size, at = n - begin, order + min(op_order, 1)
    now, one, first = pv[begin:n], mv[begin - 1 : n - 1], op[begin - 1 : n - 1]
    for lag in range(1, lags + 1, 3):
        second, third = min(lag + 1, lags), min(lag + 2, lags)
        m0, m1, m2 = mv[begin - lag : n - lag], mv[begin - second : n - second], mv[begin - third : n - third]
        a0 = a1 = a2 = 0.0
        b0 = b1 = b2 = 0.0
        c0 = c1 = c2 = 0.0
        for k in range(size):
            a0 += now[k] * m0[k]
            a1 += now[k] * m1[k]
            a2 += now[k] * m2[k]
            b0 += one[k] * m0[k]
            b1 += one[k] * m1[k]
            b2 += one[k] * m2[k]
            c0 += first[k] * m0[k]
            c1 += first[k] * m1[k]
            c2 += first[k] * m2[k]
        cross[lag, 0, v], cross[second, 0, v], cross[third, 0, v] = a0, a1, a2
        stem[lag, 1, v], stem[second, 1, v], stem[third, 1, v] = b0, b1, b2
        cross[lag, at, v], cross[second, at, v], cross[third, at, v] = c0, c1, c2
    for i in range(2, op_order + 1):
        then = op[begin - i : n - i]
        total = 0.0
        for k in range(size):
            total += then[k] * one[k]
        cross[1, order + i, v] = total
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
        cross[1, i, v], cross[1, second, v], cross[1, third, v], cross[1, fourth, v] = a0, a1, a2, a3
    total = 0.0
    for k in range(size):
        total += one[k]
    stem[1, 0, v] = total
    for lag in range(1, lags + 1):
        edge[0, lag, v], edge[1, lag, v] = mv[begin - lag], mv[n - lag]


@summing
def shifted(pv, op, lanes, order, op_order, lags, begin, edge, cross, stem):
    """Products of all pairs of lags from those of `_products`: shifting both costs only the edges of the window."""
    n = pv.shape[0]
    for lag in range(2, lags + 1):
        enter, leave = edge[0, lag], edge[1, lag]
        row, before = stem[lag, 0], stem[lag - 1, 0]
        for v in range(lanes):
            row[v] = before[v] + enter[v] - leave[v]
        for other in range(2, lag + 1):
            row, before = stem[lag, other], stem[lag - 1, other - 1]
            first, last = edge[0, other], edge[1, other]
            for v in range(lanes):
                row[v] = before[v] + enter[v] * first[v] - leave[v] * last[v]
        for i in range(1, order + 1):
            row, before = cross[lag, i], cross[lag - 1, i - 1]
            came, went = pv[begin - i], pv[n - i]
            for v in range(lanes):
                row[v] = before[v] + came * enter[v] - went * leave[v]
        for i in range(2, op_order + 1):
            row, before = cross[lag, order + i], cross[lag - 1, order + i - 1]
            came, went = op[begin - i], op[n - i]
            for v in range(lanes):
                row[v] = before[v] + came * enter[v] - went * leave[v]


@summing
def _without(pv, op, mv, lanes, order, op_order, lags, shocks, cross, stem):
    """Take what the samples `shocks` add out of the products."""
    for k in shocks:
        for lag in range(1, lags + 1):
            for v in range(lanes):
                stem[lag, 0, v] -= mv[v, k - lag]
            for other in range(1, lag + 1):
                for v in range(lanes):
                    stem[lag, other, v] -= mv[v, k - lag] * mv[v, k - other]
            for i in range(order + 1):
                for v in range(lanes):
                    cross[lag, i, v] -= mv[v, k - lag] * pv[k - i]
            for i in range(1, op_order + 1):
                for v in range(lanes):
                    cross[lag, order + i, v] -= mv[v, k - lag] * op[k - i]


@summing
def group_rows(lanes, order, edges, cross, stem, group, rows, weights):
    """Normal equations of the groups of the stem's lags: with the constant, the past, and the groups up to each.

    The right side goes into `weights`.
    """
    for g in range(edges.shape[0] - 1):
        first, last = edges[g], edges[g + 1]
        row, right = rows[g], weights[1 + order + g]
        for v in range(lanes):
            row[0, v] = stem[first, 0, v]
            right[v] = cross[first, 0, v]
        for i in range(1, order + 1):
            for v in range(lanes):
                row[i, v] = cross[first, i, v]
        for then in range(1, last):
            total, there = group[then], stem[max(first, then), min(first, then)]
            for v in range(lanes):
                total[v] = there[v]
        for lag in range(first + 1, last):
            for v in range(lanes):
                row[0, v] += stem[lag, 0, v]
                right[v] += cross[lag, 0, v]
            for i in range(1, order + 1):
                for v in range(lanes):
                    row[i, v] += cross[lag, i, v]
            for then in range(1, last):
                total, there = group[then], stem[max(lag, then), min(lag, then)]
                for v in range(lanes):
                    total[v] += there[v]
        for other in range(g + 1):
            total = row[1 + order + other]
            for v in range(lanes):
                total[v] = group[edges[other], v]
            for then in range(edges[other] + 1, edges[other + 1]):
                for v in range(lanes):
                    total[v] += group[then, v]


@summing
def solve(lanes, samples, order, groups, own, rows, weights, left):
    """Fill `left` with what the groups take of the energy that the PV's past leaves.

    By Cholesky, in place, the right side along with it; a column that the ones before it explain gets no weight.
    """
    last = order + 1
    for v in range(lanes):
        left[v] = 0.0
    for i in range(order + 1):
        for v in range(lanes):
            weights[i, v] = own[i, last]
    for g in range(groups):
        row, at = rows[g], 1 + order + g
        scale, root, right = row[at + 1], row[at], weights[at]
        for v in range(lanes):
            scale[v] = 1.0 / math.sqrt(root[v]) if root[v] > EMPTY * samples else 0.0
            root[v] = 1.0 + NUGGET
            right[v] *= scale[v]
        for j in range(at):
            total = row[j]
            if j <= order:
                for v in range(lanes):
                    total[v] *= scale[v] * own[j, last + 1]
                for p in range(j):
                    share, to = own[j, p], row[p]
                    for v in range(lanes):
                        total[v] -= share * to[v]
                for v in range(lanes):
                    total[v] *= own[j, j]
            else:
                other = rows[j - last]
                for v in range(lanes):
                    total[v] *= scale[v] * other[j + 1, v]
                for p in range(j):
                    one, to = other[p], row[p]
                    for v in range(lanes):
                        total[v] -= one[v] * to[v]
                for v in range(lanes):
                    total[v] *= other[j, v]
            done = weights[j]
            for v in range(lanes):
                root[v] -= total[v] * total[v]
                right[v] -= total[v] * done[v]
        for v in range(lanes):
            root[v] = 1.0 / math.sqrt(root[v]) if root[v] > EXPLAINED else 0.0
            right[v] *= root[v]
            left[v] += right[v] * right[v]


@summing
def _weights(lanes, order, groups, own, rows, weights):
    """Go on from `solve` to the weights, in place of the right side."""
    last = order + 1
    for back in range(groups):
        g = groups - 1 - back
        row, at = rows[g], last + g
        done = weights[at]
        for v in range(lanes):
            done[v] *= row[at, v]
        for j in range(at):
            for v in range(lanes):
                weights[j, v] -= row[j, v] * done[v]
        for v in range(lanes):
            done[v] *= row[at + 1, v]
    for back in range(last):
        i = order - back
        done = weights[i]
        for v in range(lanes):
            done[v] *= own[i, i]
        for j in range(i):
            for v in range(lanes):
                weights[j, v] -= own[i, j] * done[v]
        for v in range(lanes):
            done[v] *= own[i, last + 1]


@fused
def _residual(pv, op, mv, v, order, op_order, edges, begin, weights, share, out):
    """Fill `out` (n_samples,) from `begin` on with what the regression of lane `v` leaves of the PV.

    Four lags at once, so that what is left is loaded and stored once for four; `share` (n_lags,) is work space.
    """
    n, past = pv.shape[0], order + op_order
    now, last = out[begin:n], past + edges[edges.shape[0] - 1] - 1
    for i in range(past + 1):
        share[i] = weights[i, v]
    for g in range(edges.shape[0] - 1):
        for lag in range(edges[g], edges[g + 1]):
            share[past + lag] = weights[1 + past + g, v]
    for k in range(n - begin):
        now[k] = pv[begin + k] - share[0]
    i = 1
    while i + 3 <= last:
        s0, s1, s2, s3 = share[i], share[i + 1], share[i + 2], share[i + 3]
        x0 = _lagged(pv, op, mv, order, op_order, begin, i)
        x1 = _lagged(pv, op, mv, order, op_order, begin, i + 1)
        x2 = _lagged(pv, op, mv, order, op_order, begin, i + 2)
        x3 = _lagged(pv, op, mv, order, op_order, begin, i + 3)
        for k in range(n - begin):
            now[k] = now[k] - s0 * x0[k] - s1 * x1[k] - s2 * x2[k] - s3 * x3[k]
        i += 4
    while i <= last:
        s0, x0 = share[i], _lagged(pv, op, mv, order, op_order, begin, i)
        for k in range(n - begin):
            now[k] -= s0 * x0[k]
        i += 1


@inlined
def _lagged(pv, op, mv, order, op_order, begin, i):
    """The `i`th lag from `begin` on: first those of the PV, then of OP, then of the stem."""
    x, lag = (op, i - order) if i > order else (pv, i)
    x, lag = (mv, lag - op_order) if i > order + op_order else (x, lag)
    return x[begin - lag : x.shape[0] - lag]


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
