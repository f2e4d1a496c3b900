"""Many valves at once: what the search needs of each, computed side by side so that the processor's lanes are full.

The sum of products of the target with a process's answer to a stem is the sum of products of the stem with the
target filtered backwards (the adjoint). The backward filter does not know the valve: it runs once for each
process, and each valve then costs one product per process. Only the answer's own square needs the answer, and
it does not know the dead time but for the edges of the window.
"""

from __future__ import annotations

import math

from stiction.models.compiled import inlined, kernel, summing
from stiction.models.component import TIE

__all__ = [
    "about_mean",
    "answer_lanes",
    "backwards",
    "follow_lanes",
    "products",
    "resting_in_lane",
    "squares",
    "stem_in_lane",
]


@inlined
def stem_in_lane(u, du, x, moving, reach, edge, jump, K, goes_on):
    """Which way a stem at `x` moves when OP comes to `u` by `du`, and where it is then: Kano's rule.

    One that rests moves when OP is more than `reach` away, a tie being none, which is `edge`: by `jump`, and `K` times
    what OP is further away. One that moves goes on while OP does, by the same with a K of 1, which leaves it `reach` -
    `jump` behind OP; with a `goes_on` of 0 rather than 1 none does.
    """
    e = u - x
    goes = du * moving > 0.0
    way = moving if goes else math.copysign(1.0, e)
    moves = goes | (abs(e) > edge)
    # Without a branch, lest only the lanes that move be stored, which is slow on some processors.
    return way * goes_on if moves else 0.0, x + way * jump + K * (e - way * reach) if moves else x


@inlined
def resting_in_lane(u, x, reach, edge, jump, K):
    """The same of a stem that rests again after every sample: where it is, at half the price."""
    e = u - x
    return x + math.copysign(jump, e) + K * (e - math.copysign(reach, e)) if abs(e) > edge else x


@kernel
def follow_lanes(op, S, J, width, x, moving, mv):
    """Fill `mv` (n_blocks, n_lanes) with the mean stem position of each valve (S, J) over blocks of `width` samples.

    Kano's rule in the play e = op - x: a stem that moves goes on while OP does, (S - J) / 2 behind it; one that
    rests moves when e leaves (S + J) / 2. It begins in the middle of its band. `x` and `moving` (n_lanes,) are work
    space, and `S` is lost: half of S + J takes its place.
    """
    n, lanes = mv.shape
    share = 1.0 / width
    before = op[0]
    for v in range(lanes):
        x[v] = before
        moving[v] = 0.0
        S[v] = 0.5 * (S[v] + J[v])
    for k in range(n):
        row = mv[k]
        for v in range(lanes):
            row[v] = 0.0
        for i in range(k * width, (k + 1) * width):
            u = op[i]
            du = u - before
            before = u
            for v in range(lanes):
                way, now = stem_in_lane(u, du, x[v], moving[v], S[v], S[v] * (1.0 + TIE), J[v], 1.0, 1.0)
                x[v] = now
                moving[v] = way
                row[v] += share * now


@kernel
def backwards(target, half, first, second, delays, begin, end, w, process, Z):
    """Fill `Z` (n_samples, n_lags * n_delays): sum(Z[:, p] * mv) is the product of target and answer of process p.

    Over the window begin <= k < end, the answer about its local mean as `remove_local_mean` takes it. `w`
    (n_samples,) and `process` (5, n_lags * n_delays) are work space.
    """
    n = target.shape[0]
    n_delays = delays.shape[0]
    scale = 1.0 / (2 * half + 1) if half > 0 else 1.0 / n
    a, b, g, late, soon = process[0], process[1], process[2], process[3], process[4]
    for d in range(n_delays):
        shift = 1 + delays[d]
        for i in range(n):
            k = i + shift
            w[i] = target[k] if begin <= k < end and half <= i < n - half else 0.0
        total = 0.0
        for i in range(n if half == 0 else half):
            total += w[i]
        for i in range(n):
            if half > 0:
                total += w[i + half] if i + half < n else 0.0
                total -= w[i - half - 1] if i > half else 0.0
            z = w[i] - total * scale
            row = Z[i]
            for q in range(first.shape[0]):
                row[q * n_delays + d] = z
    for q in range(first.shape[0]):
        for p in range(q * n_delays, (q + 1) * n_delays):
            a[p] = first[q]
            b[p] = second[q]
            g[p] = (1.0 - a[p] if a[p] < 1.0 else 1.0) * (1.0 - b[p])
            late[p] = soon[p] = 0.0
    for k in range(n):
        row = Z[n - 1 - k]
        for p in range(row.shape[0]):
            late[p] = row[p] + b[p] * late[p]
            soon[p] = late[p] + a[p] * soon[p]
            row[p] = g[p] * soon[p]


@summing
def products(mv, Z, lanes, out):
    """Fill the first `lanes` rows of `out` (n_lanes, n_processes) with the sums of mv[:, lane] * Z[:, process].

    Eight samples at once, so that the sums are loaded and stored once for eight.
    """
    n = mv.shape[0]
    n_processes = Z.shape[1]
    for v in range(lanes):
        for p in range(n_processes):
            out[v, p] = 0.0
    k = 0
    while k + 7 < n:
        z0, z1, z2, z3, z4, z5, z6, z7 = Z[k], Z[k + 1], Z[k + 2], Z[k + 3], Z[k + 4], Z[k + 5], Z[k + 6], Z[k + 7]
        for v in range(lanes):
            m0, m1, m2, m3 = mv[k, v], mv[k + 1, v], mv[k + 2, v], mv[k + 3, v]
            m4, m5, m6, m7 = mv[k + 4, v], mv[k + 5, v], mv[k + 6, v], mv[k + 7, v]
            sums = out[v]
            for p in range(n_processes):
                sums[p] += (
                    m0 * z0[p] + m1 * z1[p] + m2 * z2[p] + m3 * z3[p]
                    + m4 * z4[p] + m5 * z5[p] + m6 * z6[p] + m7 * z7[p]
                )  # fmt: skip
        k += 8
    while k < n:
        for v in range(lanes):
            m0 = mv[k, v]
            for p in range(n_processes):
                out[v, p] += m0 * Z[k, p]
        k += 1


@kernel
def about_mean(mv, half, total, out):
    """Fill `out` (n_samples, n_lanes) with each column of `mv` about its centred mean over 2 half + 1 samples.

    Row i of `out` belongs to row i - half of `mv`, which counts as zero before its first sample. A `half` of 0 takes
    nothing off. `total` (n_lanes,) is work space.
    """
    n, lanes = mv.shape
    scale = 1.0 / (2 * half + 1) if half > 0 else 0.0
    for v in range(lanes):
        total[v] = 0.0
    for i in range(n):
        new, row = mv[i], out[i]
        for v in range(lanes):
            total[v] += new[v]
            row[v] = -total[v] * scale
        if i >= half:
            here = mv[i - half]
            for v in range(lanes):
                row[v] += here[v]
        if i >= 2 * half:
            gone = mv[i - 2 * half]
            for v in range(lanes):
                total[v] -= gone[v]


@kernel
def answer_lanes(mv, decay, out):
    """Fill `out` (n_samples, n_lanes) with the answer of one lag to each column of `mv`; a decay of 1 integrates."""
    n, lanes = mv.shape
    enters = 1.0 - decay if decay < 1.0 else 1.0
    for v in range(lanes):
        out[0, v] = enters * mv[0, v]
    for k in range(1, n):
        new, before, row = mv[k], out[k - 1], out[k]
        for v in range(lanes):
            row[v] = decay * before[v] + enters * new[v]


@summing
def squares(mv, decay, half, marks, u, mean, last, power, mixed, out):
    """Fill `out` (n_marks, 2, n_lanes): sums of z[k]**2 and of z[k] z[k - 1] over half <= k < mark.

    z is the answer of one lag, of this decay, to the column of `mv`, as `about_mean` leaves it: taking the local mean
    off before the lag or after it is the same. With a `half` of 0 the mean of all samples is taken off z. Four samples
    at once, so that the vectors (n_lanes,), which are work space, are loaded and stored once for four; what the lag
    takes of its input is left to the sums.
    """
    n, lanes = mv.shape
    enters = 1.0 - decay if decay < 1.0 else 1.0
    for v in range(lanes):
        last[v] = power[v] = mixed[v] = 0.0
        u[v] = mean[v] = 0.0
    if half == 0:
        for k in range(n):
            m = mv[k]
            for v in range(lanes):
                u[v] = decay * u[v] + m[v]
                mean[v] += u[v]
        for v in range(lanes):
            mean[v] = mean[v] / n
            u[v] = 0.0
    k = 0
    while k < min(2 * half, n):
        m = mv[k]
        for v in range(lanes):
            u[v] = decay * u[v] + m[v]
        k += 1
    for s in range(marks.shape[0]):
        while k + 3 < marks[s] + half:
            m0, m1, m2, m3 = mv[k], mv[k + 1], mv[k + 2], mv[k + 3]
            for v in range(lanes):
                u0 = decay * u[v] + m0[v]
                u1 = decay * u0 + m1[v]
                u2 = decay * u1 + m2[v]
                u3 = decay * u2 + m3[v]
                u[v] = u3
                z0, z1, z2, z3 = u0 - mean[v], u1 - mean[v], u2 - mean[v], u3 - mean[v]
                power[v] += z0 * z0 + z1 * z1 + z2 * z2 + z3 * z3
                mixed[v] += z0 * last[v] + z1 * z0 + z2 * z1 + z3 * z2
                last[v] = z3
            k += 4
        while k < marks[s] + half:
            m = mv[k]
            for v in range(lanes):
                u[v] = decay * u[v] + m[v]
                z = u[v] - mean[v]
                power[v] += z * z
                mixed[v] += z * last[v]
                last[v] = z
            k += 1
        for v in range(lanes):
            out[s, 0, v] = enters * enters * power[v]
            out[s, 1, v] = enters * enters * mixed[v]
