"""Many valves at once: what the search needs of each, computed side by side so that the processor's lanes are full.

The sum of products of the target with a process's answer to a stem is the sum of products of the stem with the
target filtered backwards (the adjoint). The backward filter does not know the valve: it runs once for each
process, and each valve then costs one product per process. Only the answer's own square needs the answer, and
it does not know the dead time but for the edges of the window.
"""

from __future__ import annotations

from stiction.models.compiled import kernel

__all__ = ["backwards", "follow_lanes", "products", "squares"]


@kernel
def follow_lanes(op, S, J, start, direction, width, x, moving, mv):
    """Fill `mv` (n_blocks, n_lanes) with the mean stem position of each valve (S, J) over blocks of `width` samples.

    Kano's rule in the play e = op - x: a stem that moves goes on while OP does, (S - J) / 2 behind it; one that
    rests moves when e leaves (S + J) / 2. `start` and `direction` are those of `follow`. `x` and `moving`
    (n_lanes,) are work space.
    """
    n, lanes = mv.shape
    share = 1.0 / width
    before = op[start]
    for v in range(lanes):
        x[v] = before - direction * 0.5 * (S[v] - J[v])
        moving[v] = 0.0
    for k in range(n):
        row = mv[k]
        for v in range(lanes):
            row[v] = 0.0
        for i in range(k * width, (k + 1) * width):
            if i > start:
                u = op[i]
                du = u - before
                before = u
                for v in range(lanes):
                    e = u - x[v]
                    way = 1.0 if e > 0.0 else -1.0
                    way = way if abs(e) > 0.5 * (S[v] + J[v]) * (1.0 + 1e-9) else 0.0
                    way = moving[v] if du * moving[v] > 0.0 else way
                    x[v] = u - way * 0.5 * (S[v] - J[v]) if way != 0.0 else x[v]
                    moving[v] = way
            for v in range(lanes):
                row[v] += share * x[v]


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


@kernel
def products(mv, Z, out):
    """Fill `out` (n_lanes, n_processes) with the sums of mv[:, lane] * Z[:, process]."""
    n, lanes = mv.shape
    n_processes = Z.shape[1]
    for v in range(lanes):
        for p in range(n_processes):
            out[v, p] = 0.0
    k = 0
    while k + 3 < n:
        z0, z1, z2, z3 = Z[k], Z[k + 1], Z[k + 2], Z[k + 3]
        for v in range(lanes):
            m0, m1, m2, m3 = mv[k, v], mv[k + 1, v], mv[k + 2, v], mv[k + 3, v]
            sums = out[v]
            for p in range(n_processes):
                sums[p] += m0 * z0[p] + m1 * z1[p] + m2 * z2[p] + m3 * z3[p]
        k += 4
    while k < n:
        for v in range(lanes):
            m0 = mv[k, v]
            for p in range(n_processes):
                out[v, p] += m0 * Z[k, p]
        k += 1


@kernel
def squares(mv, a, b, half, marks, u, y, total, last, power, mixed, ring, out):
    """Fill `out` (n_marks, 2, n_lanes): sums of z[k]**2 and of z[k] z[k - 1] over k < mark, z about the local mean.

    z is the answer of two lags in series (decays `a` and `b`) to each column of `mv`. `ring`
    (2 half + 1, n_lanes) and the six vectors (n_lanes,) are work space; with a `half` of 0 the mean of all
    samples is taken off.
    """
    n, lanes = mv.shape
    g = 1.0 - a if a < 1.0 else 1.0
    h = 1.0 - b
    width = 2 * half + 1
    for v in range(lanes):
        last[v] = power[v] = mixed[v] = 0.0
        u[v] = y[v] = total[v] = 0.0
    if half == 0:
        for k in range(n):
            m = mv[k]
            for v in range(lanes):
                u[v] = a * u[v] + g * m[v]
                y[v] = b * y[v] + h * u[v]
                total[v] += y[v]
        for v in range(lanes):
            total[v] = total[v] / n
            u[v] = y[v] = 0.0
    scale = 1.0 / width
    for i in range(width):
        for v in range(lanes):
            ring[i, v] = 0.0
    new, middle, oldest = 0, half + 1 if half > 0 else 0, 1 if half > 0 else 0
    k = 0
    for s in range(marks.shape[0]):
        while k < marks[s] + half:
            m, at, centre, gone = mv[k], ring[new], ring[middle], ring[oldest]
            for v in range(lanes):
                u[v] = a * u[v] + g * m[v]
                y[v] = b * y[v] + h * u[v]
                at[v] = y[v]
            if half > 0:
                whole = 1.0 if k >= 2 * half else 0.0
                for v in range(lanes):
                    total[v] += y[v]
                    z = whole * (centre[v] - total[v] * scale)
                    total[v] -= gone[v]
                    power[v] += z * z
                    mixed[v] += z * last[v]
                    last[v] = z
                new = new + 1 if new + 1 < width else 0
                middle = middle + 1 if middle + 1 < width else 0
                oldest = oldest + 1 if oldest + 1 < width else 0
            else:
                for v in range(lanes):
                    z = centre[v] - total[v]
                    power[v] += z * z
                    mixed[v] += z * last[v]
                    last[v] = z
            k += 1
        for v in range(lanes):
            out[s, 0, v] = power[v]
            out[s, 1, v] = mixed[v]
