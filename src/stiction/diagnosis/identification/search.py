"""The search: every (S, J) with every process candidate, by simulation error, in one kernel.

Each valve is stroked over the recorded OP; the products of the target with all processes' answers, and the answers'
own squares, then give each process's least-squares gain and what it leaves (see `lanes`). Slow disturbances are
kept out by comparing deviations from the moving average over one period, of the record and of the simulation
alike: the oscillation passes unchanged, constants and ramps vanish, so that neither the process's start nor a
slowly varying load matters.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.diagnosis.identification.lanes import about_mean, answer_lanes, backwards, follow_lanes, products, squares
from stiction.models.compiled import inlined, kernel
from stiction.models.component import TIE

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "Work",
    "best_dead_time",
    "follow",
    "lag_pair",
    "remove_local_mean",
    "search",
    "shares",
    "windows",
    "work_space",
]

LANES = 32
"""Valves handled side by side [-]: four vectors of eight numbers, or eight of four, whose sums wait for none."""


class Work(NamedTuple):
    """Work space of the search, one for each thread."""

    mv: NDArray[np.float64]
    """Stem positions, shape (n_samples, n_lanes)."""
    Z: NDArray[np.float64]
    """The target filtered backwards, shape (n_samples, n_lags * n_delays)."""
    cross: NDArray[np.float64]
    """Products of target and answers, shape (n_lanes, n_lags * n_delays)."""
    square: NDArray[np.float64]
    """Squares and neighbours' products of the answers up to the marks, shape (n_marks, 2, n_lanes)."""
    about: NDArray[np.float64]
    """Stem positions about their local mean, shape (n_samples, n_lanes)."""
    lagged: NDArray[np.float64]
    """The same behind the first of two lags, shape (n_samples, n_lanes)."""
    lane: NDArray[np.float64]
    """Vectors, shape (7, n_lanes)."""
    column: NDArray[np.float64]
    """A signal, shape (n_samples,)."""
    process: NDArray[np.float64]
    """Vectors, shape (5, n_lags * n_delays)."""
    marks: NDArray[np.int64]
    """Ends of the windows as the answers see them, increasing, shape (n_marks,)."""
    opens: NDArray[np.int64]
    """Which mark opens the window of each dead time, shape (n_delays,)."""
    closes: NDArray[np.int64]
    """Which mark closes it, shape (n_delays,)."""


def work_space(n_samples: int, half: int, n_lags: int, delays: NDArray[np.int64], begin: int, n_valves: int) -> Work:
    """Allocate what `search` works in.

    Parameters
    ----------
    n_samples : int
        Length of the target [samples].
    half : int
        Half width of the local mean [samples].
    n_lags : int
        Number of lag pairs.
    delays : ndarray, shape (n_delays,)
        Dead times [samples].
    begin : int
        First sample compared.
    n_valves : int
        Number of valves.

    Returns
    -------
    Work
        Arrays without content, and the marks of the windows.
    """
    lanes = min(LANES, -(-n_valves // 8) * 8)
    marks, opens, closes = windows(n_samples, half, delays, begin)
    processes = n_lags * delays.size
    return Work(
        mv=np.empty((n_samples, lanes)),
        Z=np.empty((n_samples, processes)),
        cross=np.empty((lanes, processes)),
        square=np.empty((marks.size, 2, lanes)),
        about=np.empty((n_samples, lanes)),
        lagged=np.empty((n_samples, lanes)),
        lane=np.empty((7, lanes)),
        column=np.empty(n_samples),
        process=np.empty((5, processes)),
        marks=marks,
        opens=opens,
        closes=closes,
    )


def windows(
    n_samples: int, half: int, delays: NDArray[np.int64], begin: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Where the window of each dead time opens and closes as an answer sees it, which the dead time makes late.

    Parameters
    ----------
    n_samples : int
        Length of the target [samples].
    half : int
        Half width of the local mean [samples].
    delays : ndarray, shape (n_delays,)
        Dead times, increasing [samples].
    begin : int
        First sample compared.

    Returns
    -------
    marks : ndarray, shape (n_marks,)
        All ends of the windows, increasing [samples].
    opens, closes : ndarray, shape (n_delays,)
        Which mark opens the window of each dead time, and which closes it.
    """
    marks, which = np.empty(2 * delays.size, dtype=np.int64), np.empty((2, delays.size), dtype=np.int64)
    count = merged(delays, begin - 1, n_samples - half - 1, marks, which)
    return marks[:count], which[0], which[1]


@kernel
def merged(delays, opening, closing, marks, which):
    """Fill `marks` with `opening` and `closing` less each of `delays` (n_delays,), increasing and none twice; how many.

    `which` (2, n_delays) tells where among them each is.
    """
    n = delays.shape[0]
    count, i, j = 0, n - 1, n - 1
    while i >= 0 or j >= 0:
        mark = closing - delays[j] if i < 0 else opening - delays[i]
        if j >= 0:
            mark = min(mark, closing - delays[j])
        if i >= 0 and opening - delays[i] == mark:
            which[0, i] = count
            i -= 1
        if j >= 0 and closing - delays[j] == mark:
            which[1, j] = count
            j -= 1
        marks[count] = mark
        count += 1
    return count


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
    """Stroke Kano's valve over `op`, from the middle of its band."""
    behind = 0.5 * (S - J)
    reach = 0.5 * (S + J) * (1.0 + TIE)
    before = x = mv[0] = op[0]
    moving = 0.0
    for k in range(1, op.shape[0]):
        u = op[k]
        if not (u - before) * moving > 0.0:
            moving = 0.0
            if abs(u - x) > reach:
                moving = 1.0 if u > x else -1.0
        if moving != 0.0:
            x = u - moving * behind
        before = u
        mv[k] = x


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
def search(op, width, target, half, S, J, first, second, delays, begin, sign, error, gain, best, by_delay, work):
    """Fill `error`, `gain` (n,), `best` (n, 3) and `by_delay` (n, n_delays) for each valve (S, J) (n,).

    `op` holds `width` samples for each one of `target` (n_samples,), the PV without its local mean; the stem is
    averaged alike.
    `first`, `second` (n_lags,) are decays per sample, `delays` (n_delays,) increasing whole samples, -1 meaning
    that the PV sees the stem within the sample. Between neighbouring whole delays the best fraction is found in
    closed form: the answer is then a weighted mean of two shifts, and the two weights a least-squares problem of
    two unknowns. `error` is the sum of squares left by the best process, `gain` its least-squares gain,
    constrained to the sign of `sign` where that is not 0; `best` its lag pair, its delay and the
    fraction of a sample to add; `by_delay` what the best lag pair leaves at each whole delay. `work` is work space.
    """
    n, lanes = work.mv.shape
    end = n - half
    energy = 0.0
    for k in range(begin, end):
        energy += target[k] * target[k]
    backwards(target, half, first, second, delays, begin, end, work.column, work.process, work.Z)
    lane = work.lane
    band, jump, u, total, last, power, mixed = lane[0], lane[1], lane[2], lane[3], lane[4], lane[5], lane[6]
    for base in range(0, S.shape[0], lanes):
        filled = min(lanes, S.shape[0] - base)
        for v in range(lanes):
            i = base + min(v, filled - 1)
            band[v] = S[i]
            jump[v] = J[i]
        follow_lanes(op, band, jump, width, u, total, work.mv)
        for v in range(lanes):
            total[v] = 0.0
        for k in range(n):
            row = work.mv[k]
            for v in range(lanes):
                total[v] += row[v]
        for k in range(n):
            row = work.mv[k]
            for v in range(lanes):
                row[v] -= total[v] / n
        products(work.mv, work.Z, filled, work.cross)
        about_mean(work.mv, half, total, work.about)
        for v in range(filled):
            i = base + v
            error[i] = energy
            gain[i] = 0.0
            best[i, 0] = -1.0
            best[i, 1] = 0.0
            best[i, 2] = 0.0
            for d in range(delays.shape[0]):
                by_delay[i, d] = energy
        for q in range(first.shape[0]):
            if second[q] > 0.0:
                if q == 0 or second[q - 1] == 0.0 or first[q] != first[q - 1]:
                    answer_lanes(work.about, first[q], work.lagged)
                squares(work.lagged, second[q], half, work.marks, u, total, last, power, mixed, work.square)
            else:
                squares(work.about, first[q], half, work.marks, u, total, last, power, mixed, work.square)
            for v in range(filled):
                best_dead_time(
                    v, base + v, q, delays, sign, energy, 1e-12 * (end - begin) * S[base + v] ** 2, error, gain, best,
                    by_delay, work.cross[v, q * delays.shape[0] : (q + 1) * delays.shape[0]], work.square, work.opens,
                    work.closes,
                )  # fmt: skip


@inlined
def shares(c, next_c, power, next_power, mixed, sign):
    """Gains of an answer and of the same a sample later that leave least of a target; 0 and 0 where one alone does.

    `c`, `next_c` are their products with the target, `power`, `next_power` their squares, `mixed` that of one with the
    other. The dead time between the two is the first's and next_gain / (gain + next_gain) of a sample.
    """
    determinant = power * next_power - mixed * mixed
    if determinant <= 1e-12 * power * next_power:
        return 0.0, 0.0
    gain = (c * next_power - next_c * mixed) / determinant
    next_gain = (next_c * power - c * mixed) / determinant
    if gain * next_gain <= 0.0 or gain * sign < 0.0:
        return 0.0, 0.0
    return gain, next_gain


@kernel
def best_dead_time(v, i, q, delays, sign, energy, rounding, error, gain, best, by_delay, cross, square, opens, closes):
    """Keep the best dead time of lag pair `q` for valve `i` if it beats what was found before, and each dead time's.

    Its squares are in lane `v`, its products with the target in `cross` (n_delays,). A power up to `rounding` is no
    answer.
    """
    n_delays = delays.shape[0]
    # A stem that rests throughout the window leaves rounding, not a response.
    least = max(1e-8 * (square[closes[0], 0, v] - square[opens[0], 0, v]), rounding)
    for d in range(n_delays):
        power = square[closes[d], 0, v] - square[opens[d], 0, v]
        c = cross[d]
        least = max(least, 1e-8 * power)
        if power <= least:
            continue
        if c * sign >= 0.0:
            left = energy - c * c / power
            by_delay[i, d] = min(by_delay[i, d], left)
            if left < error[i]:
                error[i] = left
                gain[i] = c / power
                best[i, 0] = q
                best[i, 1] = delays[d]
                best[i, 2] = 0.0
        if d + 1 == n_delays or delays[d + 1] != delays[d] + 1:
            continue
        next_c = cross[d + 1]
        next_power = square[closes[d + 1], 0, v] - square[opens[d + 1], 0, v]
        if (c * c / power < 0.98 * (energy - error[i])) or next_power <= least:
            continue
        mixed = square[closes[d], 1, v] - square[opens[d], 1, v]
        w0, w1 = shares(c, next_c, power, next_power, mixed, sign)
        left = energy - w0 * c - w1 * next_c
        if left < error[i]:
            error[i] = left
            gain[i] = w0 + w1
            best[i, 0] = q
            best[i, 1] = delays[d]
            best[i, 2] = w1 / (w0 + w1)
