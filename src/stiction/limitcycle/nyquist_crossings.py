"""Crossings of L(j omega) and -1/N(A) in the plane of log magnitude and phase."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.models.numba_compile import kernel

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from stiction.limitcycle.linear import LinearPart

__all__ = ["find_crossings", "frequency_grid", "refine_crossing"]


@kernel
def _segments_meet(px, py, qx, qy, places):
    """Write crossing segments, modulo whole turns, as rows (i + s, j + t) to `places`; returns their number."""
    n = 0
    turn = 2.0 * math.pi
    for j in range(qx.shape[0] - 1):
        q_low, q_high = min(qx[j], qx[j + 1]), max(qx[j], qx[j + 1])
        dqx, dqy = qx[j + 1] - qx[j], qy[j + 1] - qy[j]
        middle = 0.5 * (qy[j] + qy[j + 1])
        for i in range(px.shape[0] - 1):
            if px[i] > q_high and px[i + 1] > q_high:
                continue
            if px[i] < q_low and px[i + 1] < q_low:
                continue
            dpx, dpy = px[i + 1] - px[i], py[i + 1] - py[i]
            shift = turn * math.floor((middle - 0.5 * (py[i] + py[i + 1])) / turn + 0.5)
            det = dpx * dqy - dpy * dqx
            if det == 0.0:
                continue
            rx, ry = qx[j] - px[i], qy[j] - py[i] - shift
            s = (rx * dqy - ry * dqx) / det
            t = (rx * dpy - ry * dpx) / det
            if -0.01 <= s <= 1.01 and -0.01 <= t <= 1.01 and n < places.shape[0]:
                places[n, 0] = i + s
                places[n, 1] = j + t
                n += 1
    return n


def frequency_grid(linear: LinearPart, largest_n: float, points: int = 2000) -> NDArray[np.float64]:
    """Frequencies [rad/s] that resolve L where |L| N can reach 1: log spaced, with phase steps below 0.1 rad.

    `largest_n`: largest |N| [-].
    """
    corners = np.abs(
        np.concatenate([linear.poles, linear.zeros(), [1.0 / linear.dead_time] if linear.dead_time else []])
    )
    corners = corners[corners > 1e-12 * np.max(corners, initial=1e-300)]
    if corners.size == 0:
        corners = np.ones(1)
    grid = np.geomspace(1e-4 * corners.min(), 1e4 * corners.max(), points)
    enough = np.nonzero(np.abs(linear.at(1j * grid)) * largest_n >= 0.5)[0]
    if enough.size == 0:
        return grid[:0]
    grid = grid[max(enough[0] - 1, 0) : enough[-1] + 2]
    if grid.size < points // 2:
        grid = np.geomspace(grid[0], grid[-1], points)
    for _ in range(12):
        value = linear.at(1j * grid)
        phase_step = np.maximum(np.abs(np.angle(value[1:] / value[:-1])), np.diff(grid) * linear.dead_time)
        coarse = np.nonzero(phase_step > 0.1)[0]
        if coarse.size == 0 or grid.size > 200_000:
            break
        grid = np.sort(np.concatenate([grid, np.sqrt(grid[coarse] * grid[coarse + 1])]))
    return grid


def find_crossings(curves, omega, response) -> list[tuple[int, float, float]]:
    """First guesses of 1 + L N = 0 along several curves N(a) and the response L(omega).

    `curves`: parameter and N of each curve, shapes (n_points,); points with N = 0 are ignored. `omega`, `response`, of
    shape (n_frequencies,): frequencies [rad/s] and L there. Returns index of the curve, its parameter and the frequency
    [rad/s].
    """
    if omega.size < 2 or not curves:
        return []
    a, x, y, owner = [], [], [], []
    for index, (parameter, n) in enumerate(curves):
        moving = np.abs(n) > 0.0
        p = np.log(-1.0 / n[moving])
        a += [parameter[moving], [np.nan]]
        x += [p.real, [np.nan]]
        y += [np.unwrap(p.imag), [np.nan]]
        owner += [np.full(p.size + 1, index)]
    a, x, y, owner = np.concatenate(a), np.concatenate(x), np.concatenate(y), np.concatenate(owner)
    q = np.log(response)
    places = np.empty((4096, 2))
    count = _segments_meet(x, y, q.real.copy(), np.unwrap(q.imag), places)
    out = []
    for place_a, place_w in places[:count]:
        i, j = math.floor(place_a), min(max(math.floor(place_w), 0), omega.size - 2)
        i = i if i >= 0 and math.isfinite(a[i]) and math.isfinite(a[i + 1]) else i + 1
        if i + 1 >= a.size or not math.isfinite(a[i + 1]):
            i -= 1
        s, t = place_a - i, place_w - j
        out.append((int(owner[i]), float(a[i] + s * (a[i + 1] - a[i])), omega[j] * (omega[j + 1] / omega[j]) ** t))
    return out


def refine_crossing(
    describe: Callable[[float, float], complex], linear: LinearPart, a: float, omega: float, low: float, high: float
) -> tuple[float, float] | None:
    """Newton on log(-L N) = 0 in (a, log omega), limited to low..high; None when it does not converge."""

    def error(a: float, logw: float) -> complex:
        w = math.exp(logw)
        value = -complex(linear.at(1j * w)) * describe(a, w)
        return complex(np.log(value)) if value else complex(math.inf, 0.0)

    logw = math.log(omega)
    span = high - low
    a = min(max(a, low + 1e-9 * min(span, low or span)), high)
    f = error(a, logw)
    for _ in range(40):
        step_a = 1e-6 * max(abs(a), 1e-300)
        if a + step_a > high or not math.isfinite(abs(error(a + step_a, logw))):
            step_a = -step_a
        fa = (error(a + step_a, logw) - f) / step_a
        fw = (error(a, logw + 1e-6) - error(a, logw - 1e-6)) / 2e-6
        det = fa.real * fw.imag - fa.imag * fw.real
        if det == 0.0 or not math.isfinite(det):
            return None
        da = (f.imag * fw.real - f.real * fw.imag) / det
        dw = (f.real * fa.imag - f.imag * fa.real) / det
        scale = 1.0
        while scale > 1e-4:
            trial_a = min(max(a + scale * da, low), high)
            trial = error(trial_a, logw + scale * dw)
            if abs(trial) < abs(f) or abs(trial) < 1e-12:
                break
            scale /= 2.0
        else:
            break
        a, logw, f = trial_a, logw + scale * dw, trial
        if abs(f) < 1e-13:
            break
    return (a, math.exp(logw)) if abs(f) < 1e-8 else None
