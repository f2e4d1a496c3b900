"""The dense search: every (S, J) with every process candidate, by simulation error, in one kernel.

For each (S, J) the valve is stroked once over the recorded OP; each pair of lags then filters the stem
position once; every dead time is a shift of the result. Slow disturbances are kept out by comparing deviations
from the moving average over one period, of the record and of the simulation alike: the oscillation passes
unchanged, constants and ramps vanish, so that neither the process's start nor a slowly varying load matters.
"""

from __future__ import annotations

from stiction.models.compiled import kernel
from stiction.models.valves.kano import kano_at_rest, kano_step

__all__ = ["follow", "lag_pair", "remove_local_mean", "search"]


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
def follow(op, S, J, mv):
    """Stroke Kano's valve over `op` from rest in the middle of its band."""
    tie = 1.0 + 1e-9
    lag = 0.5 * (S - J)
    s = kano_at_rest(op[0], op[0], lag)
    for k in range(op.shape[0]):
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
def search(op, target, half, S, J, first, second, delays, begin, error, gain, best, mv, raw, y):
    """Fill `error`, `gain` (n,) and `best` (n, 2) for each valve (S, J) (n,).

    `target` (n_samples,) is the PV without its local mean; `first`, `second` (n_lags,) are decays per sample,
    `delays` (n_delays,) increasing whole samples, -1 meaning that the PV sees the stem within the sample.
    `error` is the sum of squares left by the best process, `gain` its least-squares gain, constrained to the
    sign of `gain[i]` on entry where that is not 0; `best` its lag pair and delay. `mv`, `raw` and `y`
    (n_samples,) are work space.
    """
    n = op.shape[0]
    end = n - half
    energy = 0.0
    for k in range(begin, end):
        energy += target[k] * target[k]
    for i in range(S.shape[0]):
        follow(op, S[i], J[i], mv)
        centre = 0.0
        for k in range(n):
            centre += mv[k]
        centre /= n
        sign = gain[i]
        error[i] = energy
        gain[i] = 0.0
        best[i, 0] = -1
        best[i, 1] = 0
        for q in range(first.shape[0]):
            lag_pair(mv, centre, first[q], second[q], raw)
            remove_local_mean(raw, half, y)
            for d in range(delays.shape[0]):
                shift = delays[d]
                # The lags answer one sample after the hold: y[k] holds the effect of mv[k] at time k + 1.
                a0 = 0.0
                a1 = 0.0
                a2 = 0.0
                a3 = 0.0
                b0 = 0.0
                b1 = 0.0
                b2 = 0.0
                b3 = 0.0
                k = begin
                while k + 3 < end:
                    v0 = y[k - 1 - shift]
                    v1 = y[k - shift]
                    v2 = y[k + 1 - shift]
                    v3 = y[k + 2 - shift]
                    a0 += v0 * target[k]
                    a1 += v1 * target[k + 1]
                    a2 += v2 * target[k + 2]
                    a3 += v3 * target[k + 3]
                    b0 += v0 * v0
                    b1 += v1 * v1
                    b2 += v2 * v2
                    b3 += v3 * v3
                    k += 4
                while k < end:
                    v0 = y[k - 1 - shift]
                    a0 += v0 * target[k]
                    b0 += v0 * v0
                    k += 1
                cross = a0 + a1 + a2 + a3
                power = b0 + b1 + b2 + b3
                if power <= 0.0 or cross * sign < 0.0:
                    continue
                left = energy - cross * cross / power
                if left < error[i]:
                    error[i] = left
                    gain[i] = cross / power
                    best[i, 0] = q
                    best[i, 1] = d
