"""Products of many stems side by side, sample by sample: for short windows, where a sum by itself is hardly worth it.

`regression` takes the sums of one stem after the other, along the record. Each of them ends in adding up the
processor's lanes, which for a hundred samples takes as long as the sum. Here every lane is another stem, and no more is
looked at than the lean regressions of the searches need: no lags of OP, no samples left out, no blocks of time.
"""

from __future__ import annotations

from stiction.diagnosis.identification.regression import group_rows, shifted, solve
from stiction.models.compiled import summing

__all__ = ["LANES", "left_side_by_side"]

LANES = 32
"""Stems side by side [-]: four vectors of eight numbers, or eight of four."""
FULL = 8
"""Lanes that a processor takes at once, at most [-]."""
R1, R2, R3, R4, R5, R6, R7 = range(LANES, 8 * LANES, LANES)
"""Where the rows after the first begin."""


@summing
def left_side_by_side(pv, lanes, order, edges, begin, floor, energy, base, left, work):
    """Fill `left` from `base` on with the sum of squares that each of `lanes` stems leaves, as `left_over` does.

    The stems are the columns of `work.tall`, whose means are taken off in place; `work.own` is known, and `energy` what
    it leaves.
    """
    samples, lags, groups = pv.shape[0] - begin, edges[edges.shape[0] - 1] - 1, edges.shape[0] - 1
    # Lanes beyond are reckoned with whatever they hold, since those that a processor takes at once cost the same.
    filled = min((lanes + FULL - 1) // FULL * FULL, work.tall.shape[1])
    _centre(work.tall, filled, work.left)
    _products(pv, work.tall, filled, order, lags, begin, work.cross, work.stem)
    for lag in range(1, lags + 1):
        for v in range(filled):
            work.edge[0, lag, v] = work.tall[begin - lag, v]
            work.edge[1, lag, v] = work.tall[pv.shape[0] - lag, v]
    shifted(pv, pv, filled, order, 0, lags, begin, work.edge, work.cross, work.stem)
    group_rows(filled, order, edges, work.cross, work.stem, work.group, work.rows, work.weights)
    solve(filled, samples, order, groups, work.own, work.rows, work.weights, work.left)
    for v in range(lanes):
        left[base + v] = max(energy - work.left[v], 0.0) + floor * samples


@summing
def _centre(mv, filled, total):
    """Take the mean off each of the first columns."""
    n = mv.shape[0]
    for v in range(filled):
        total[v] = 0.0
    for k in range(n):
        row = mv[k]
        for v in range(filled):
            total[v] += row[v]
    for v in range(filled):
        total[v] /= n
    for k in range(n):
        row = mv[k]
        for v in range(filled):
            row[v] -= total[v]


@summing
def _products(pv, mv, filled, order, lags, begin, cross, stem):
    """Sums over the window: PV now and stem one ago by stem then, PV then by stem one ago, and the stem one ago.

    Eight samples at once, so that the sums are loaded and stored once for eight. They are those of one flat signal, in
    which the distances from row to row are known when the kernel is compiled (see `watched`).
    """
    n, flat = pv.shape[0], mv.reshape(-1)
    for lag in range(1, lags + 1):
        for v in range(filled):
            cross[lag, 0, v] = stem[lag, 1, v] = 0.0
    for i in range(1, order + 1):
        for v in range(filled):
            cross[1, i, v] = 0.0
    for v in range(filled):
        stem[1, 0, v] = 0.0
    k = begin
    while k + 7 < n:
        one = flat[(k - 1) * LANES : (k + 7) * LANES]
        p0, p1, p2, p3 = pv[k], pv[k + 1], pv[k + 2], pv[k + 3]
        p4, p5, p6, p7 = pv[k + 4], pv[k + 5], pv[k + 6], pv[k + 7]
        for lag in range(1, lags + 1):
            then = flat[(k - lag) * LANES : (k - lag + 8) * LANES]
            now, mixed = cross[lag, 0], stem[lag, 1]
            for v in range(filled):
                m0, m1, m2, m3 = then[v], then[R1 + v], then[R2 + v], then[R3 + v]
                m4, m5, m6, m7 = then[R4 + v], then[R5 + v], then[R6 + v], then[R7 + v]
                now[v] += p0 * m0 + p1 * m1 + p2 * m2 + p3 * m3 + p4 * m4 + p5 * m5 + p6 * m6 + p7 * m7
                mixed[v] += (
                    one[v] * m0 + one[R1 + v] * m1 + one[R2 + v] * m2 + one[R3 + v] * m3
                    + one[R4 + v] * m4 + one[R5 + v] * m5 + one[R6 + v] * m6 + one[R7 + v] * m7
                )  # fmt: skip
        for i in range(1, order + 1):
            y0, y1, y2, y3 = pv[k - i], pv[k - i + 1], pv[k - i + 2], pv[k - i + 3]
            y4, y5, y6, y7 = pv[k - i + 4], pv[k - i + 5], pv[k - i + 6], pv[k - i + 7]
            past = cross[1, i]
            for v in range(filled):
                past[v] += (
                    y0 * one[v] + y1 * one[R1 + v] + y2 * one[R2 + v] + y3 * one[R3 + v]
                    + y4 * one[R4 + v] + y5 * one[R5 + v] + y6 * one[R6 + v] + y7 * one[R7 + v]
                )  # fmt: skip
        total = stem[1, 0]
        for v in range(filled):
            total[v] += (
                one[v] + one[R1 + v] + one[R2 + v] + one[R3 + v]
                + one[R4 + v] + one[R5 + v] + one[R6 + v] + one[R7 + v]
            )  # fmt: skip
        k += 8
    while k < n:
        one = mv[k - 1]
        for lag in range(1, lags + 1):
            then, now, mixed = mv[k - lag], cross[lag, 0], stem[lag, 1]
            for v in range(filled):
                now[v] += pv[k] * then[v]
                mixed[v] += one[v] * then[v]
        for i in range(1, order + 1):
            past = cross[1, i]
            for v in range(filled):
                past[v] += pv[k - i] * one[v]
        total = stem[1, 0]
        for v in range(filled):
            total[v] += one[v]
        k += 1
