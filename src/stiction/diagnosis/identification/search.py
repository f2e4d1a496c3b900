"""The dense search: every (S, J) with every process candidate, by simulation error, in one kernel.

For each (S, J) the valve is stroked once over the recorded OP; each pair of lags then filters the stem
position once; every dead time is a shift of the result. Slow disturbances are kept out by comparing deviations
from the moving average over one period, of the record and of the simulation alike: the oscillation passes
unchanged, constants and ramps vanish, so that neither the process's start nor a slowly varying load matters.
"""

from __future__ import annotations

from stiction.models.compiled import kernel
from stiction.models.component import ValveState
from stiction.models.valves.kano import kano_at_rest, kano_step

__all__ = ["follow", "four_lags", "four_local_means", "lag_pair", "remove_local_mean", "search"]


@kernel
def remove_local_mean(x, half, out):
    """Subtract the centred moving average over 2 half + 1 samples; zero where the window does not fit.

    A `half` of 0 subtracts the mean of all samples.
    """
    n = x.shape[0]
    width = 2 * half + 1
    if half == 0:
        total = 0.0
        for k in range(n):
            total += x[k]
        total /= n
        for k in range(n):
            out[k] = x[k] - total
        return
    for k in range(min(half, n)):
        out[k] = 0.0
        out[n - 1 - k] = 0.0
    if n < width:
        return
    total = 0.0
    for k in range(width - 1):
        total += x[k]
    scale = 1.0 / width
    for k in range(half, n - half):
        total += x[k + half]
        out[k] = x[k] - total * scale
        total -= x[k - half]


@kernel
def follow(op, S, J, start, direction, mv):
    """Stroke Kano's valve over `op`, from sample `start` on, where the stem has just stopped moving in `direction`.

    A `direction` of 0 knows nothing of it: the stem then rests in the middle of its band.
    """
    tie = 1.0 + 1e-9
    lag = 0.5 * (S - J)
    s = kano_at_rest(op[start], op[start] - direction * lag, lag)
    if direction != 0.0:
        s = ValveState(s.position, s.op, op[start], direction, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for k in range(start):
        mv[k] = s.position
    for k in range(start, op.shape[0]):
        s = kano_step(op[k], s, S * tie, J * tie, lag)
        mv[k] = s.position


@kernel
def lag_pair(mv, centre, first, second, y):
    """Two lags in series on mv - centre, decays `first` and `second` per sample; a decay of 1 integrates."""
    gain_1 = 1.0 - first if first < 1.0 else 1.0
    gain_2 = 1.0 - second
    y1 = 0.0
    y2 = 0.0
    for k in range(mv.shape[0]):
        y1 = first * y1 + gain_1 * (mv[k] - centre)
        y2 = second * y2 + gain_2 * y1
        y[k] = y2


@kernel
def four_lags(mv, centre, first, second, q, y):
    """Fill `y` (n_samples, 4) with the answers of lag pairs q..q+3 to mv - centre.

    Four at a time, since each recursion waits for itself; the lags past the last repeat it.
    """
    n = mv.shape[0]
    last = first.shape[0] - 1
    q1, q2, q3 = min(q + 1, last), min(q + 2, last), min(q + 3, last)
    a0, a1, a2, a3 = first[q], first[q1], first[q2], first[q3]
    b0, b1, b2, b3 = second[q], second[q1], second[q2], second[q3]
    g0 = 1.0 - a0 if a0 < 1.0 else 1.0
    g1 = 1.0 - a1 if a1 < 1.0 else 1.0
    g2 = 1.0 - a2 if a2 < 1.0 else 1.0
    g3 = 1.0 - a3 if a3 < 1.0 else 1.0
    h0, h1, h2, h3 = 1.0 - b0, 1.0 - b1, 1.0 - b2, 1.0 - b3
    u0 = u1 = u2 = u3 = 0.0
    v0 = v1 = v2 = v3 = 0.0
    for k in range(n):
        m = mv[k] - centre
        u0 = a0 * u0 + g0 * m
        u1 = a1 * u1 + g1 * m
        u2 = a2 * u2 + g2 * m
        u3 = a3 * u3 + g3 * m
        v0 = b0 * v0 + h0 * u0
        v1 = b1 * v1 + h1 * u1
        v2 = b2 * v2 + h2 * u2
        v3 = b3 * v3 + h3 * u3
        y[k, 0] = v0
        y[k, 1] = v1
        y[k, 2] = v2
        y[k, 3] = v3


@kernel
def four_local_means(raw, half, y):
    """`remove_local_mean` for the four columns of `raw` (n_samples, 4)."""
    n = raw.shape[0]
    t0 = t1 = t2 = t3 = 0.0
    if half == 0:
        for k in range(n):
            t0 += raw[k, 0]
            t1 += raw[k, 1]
            t2 += raw[k, 2]
            t3 += raw[k, 3]
        for k in range(n):
            y[k, 0] = raw[k, 0] - t0 / n
            y[k, 1] = raw[k, 1] - t1 / n
            y[k, 2] = raw[k, 2] - t2 / n
            y[k, 3] = raw[k, 3] - t3 / n
        return
    width = 2 * half + 1
    for k in range(min(half, n)):
        for i in range(4):
            y[k, i] = 0.0
            y[n - 1 - k, i] = 0.0
    if n < width:
        return
    for k in range(width - 1):
        t0 += raw[k, 0]
        t1 += raw[k, 1]
        t2 += raw[k, 2]
        t3 += raw[k, 3]
    scale = 1.0 / width
    for k in range(half, n - half):
        new = k + half
        old = k - half
        t0 += raw[new, 0]
        t1 += raw[new, 1]
        t2 += raw[new, 2]
        t3 += raw[new, 3]
        y[k, 0] = raw[k, 0] - t0 * scale
        y[k, 1] = raw[k, 1] - t1 * scale
        y[k, 2] = raw[k, 2] - t2 * scale
        y[k, 3] = raw[k, 3] - t3 * scale
        t0 -= raw[old, 0]
        t1 -= raw[old, 1]
        t2 -= raw[old, 2]
        t3 -= raw[old, 3]


@kernel
def four_products(y, target, shift, begin, end, out):
    """Sums of y[k - 1 - shift] target[k] over begin <= k < end, for four columns."""
    a0 = a1 = a2 = a3 = 0.0
    b0 = b1 = b2 = b3 = 0.0
    k = begin
    while k + 1 < end:
        p = target[k]
        q = target[k + 1]
        i = k - 1 - shift
        a0 += y[i, 0] * p
        a1 += y[i, 1] * p
        a2 += y[i, 2] * p
        a3 += y[i, 3] * p
        b0 += y[i + 1, 0] * q
        b1 += y[i + 1, 1] * q
        b2 += y[i + 1, 2] * q
        b3 += y[i + 1, 3] * q
        k += 2
    if k < end:
        p = target[k]
        i = k - 1 - shift
        a0 += y[i, 0] * p
        a1 += y[i, 1] * p
        a2 += y[i, 2] * p
        a3 += y[i, 3] * p
    out[0] = a0 + b0
    out[1] = a1 + b1
    out[2] = a2 + b2
    out[3] = a3 + b3


@kernel
def search(
    op, target, half, start, direction, S, J, first, second, delays, begin, error, gain, best, mv, raw, y, cross
):
    """Fill `error`, `gain` (n,) and `best` (n, 3) for each valve (S, J) (n,).

    The stem is known at sample `start`, where it stopped moving in `direction` (see `follow`).
    `target` (n_samples,) is the PV without its local mean; `first`, `second` (n_lags,) are decays per sample,
    `delays` (n_delays,) increasing whole samples, -1 meaning that the PV sees the stem within the sample.
    Between neighbouring whole delays the best fraction is found in closed form: the answer is then a weighted
    mean of two shifts, and the two weights a least-squares problem of two unknowns.
    `error` is the sum of squares left by the best process, `gain` its least-squares gain, constrained to the
    sign of `gain[i]` on entry where that is not 0; `best` its lag pair, its delay and the fraction of a sample
    to add. `mv` (n_samples,), `raw` and `y` (n_samples, 4) and `cross` (n_delays, 4) are work space.
    """
    n = op.shape[0]
    end = n - half
    n_delays = delays.shape[0]
    energy = 0.0
    for k in range(begin, end):
        energy += target[k] * target[k]
    for i in range(S.shape[0]):
        follow(op, S[i], J[i], start, direction, mv)
        centre = 0.0
        for k in range(n):
            centre += mv[k]
        centre /= n
        sign = gain[i]
        error[i] = energy
        gain[i] = 0.0
        best[i, 0] = -1.0
        best[i, 1] = 0.0
        best[i, 2] = 0.0
        for q in range(0, first.shape[0], 4):
            four_lags(mv, centre, first, second, q, raw)
            four_local_means(raw, half, y)
            for d in range(n_delays):
                four_products(y, target, delays[d], begin, end, cross[d])
            for column in range(min(4, first.shape[0] - q)):
                top = begin - 1 - delays[0]
                stop = end - 1 - delays[0]
                power = 0.0
                for k in range(top, stop):
                    power += y[k, column] * y[k, column]
                # A stem that rests throughout the window leaves rounding, not a response.
                least = max(1e-8 * power, 1e-12 * S[i] * S[i] * (end - begin))
                for d in range(n_delays):
                    while top > begin - 1 - delays[d]:
                        top -= 1
                        stop -= 1
                        power += y[top, column] * y[top, column] - y[stop, column] * y[stop, column]
                    c = cross[d, column]
                    least = max(least, 1e-8 * power)
                    if power <= least:
                        continue
                    if c * sign >= 0.0:
                        left = energy - c * c / power
                        if left < error[i]:
                            error[i] = left
                            gain[i] = c / power
                            best[i, 0] = q + column
                            best[i, 1] = delays[d]
                            best[i, 2] = 0.0
                    if d + 1 == n_delays or delays[d + 1] != delays[d] + 1:
                        continue
                    next_c = cross[d + 1, column]
                    e0 = y[top - 1, column]
                    e1 = y[stop - 1, column]
                    next_power = power + e0 * e0 - e1 * e1
                    if (c * c / power < 0.98 * (energy - error[i])) or next_power <= least:
                        continue
                    mixed = 0.0
                    for k in range(top, stop):
                        mixed += y[k, column] * y[k - 1, column]
                    determinant = power * next_power - mixed * mixed
                    if determinant <= 1e-12 * power * next_power:
                        continue
                    w0 = (c * next_power - next_c * mixed) / determinant
                    w1 = (next_c * power - c * mixed) / determinant
                    if w0 * w1 <= 0.0 or w0 * sign < 0.0:
                        continue
                    left = energy - w0 * c - w1 * next_c
                    if left < error[i]:
                        error[i] = left
                        gain[i] = w0 + w1
                        best[i, 0] = q + column
                        best[i, 1] = delays[d]
                        best[i, 2] = w1 / (w0 + w1)
