"""Half-period shapes and how far a half period lies from each: kernels shared by the shape methods.

A half period of m samples runs from one zero crossing to the next; sample i stands at (i + 1/2) / m of it.
Every misfit but the square's is the sum of squares left by the least-squares amplitude.

References
----------
Sine and triangle: he2007. Relay: rossi2005; its closed form in m/tau is derived here. Square: haegglund2011.
Area ratio: singhal2005.
"""

from __future__ import annotations

import math

from stiction.models.numba_compile import kernel

__all__ = ["area_ratio", "relay_misfit", "relay_shapes", "sine_misfit", "square_misfit", "triangle_misfit"]


@kernel
def sine_misfit(y, start, stop):
    """Misfit of half a sine."""
    m = stop - start
    fit = size = total = 0.0
    for i in range(m):
        shape = math.sin(math.pi * (i + 0.5) / m)
        fit += shape * y[start + i]
        size += shape * shape
        total += y[start + i] * y[start + i]
    return max(total - fit * fit / size, 0.0)


@kernel
def triangle_misfit(y, start, stop):
    """Misfit of the best triangle: two straight lines from the zero crossings to an apex anywhere between.

    With the apex at a, between two samples, the lines are t / a and (m - t) / (m - a). The part of the sum of squares
    that they explain, (rise + q fall)^2 / (rise_size + q^2 fall_size), depends on a through q = a / (m - a) alone and
    is largest at q = fall rise_size / (fall_size rise), or at the sample next to it.
    """
    m = stop - start
    total = fall = fall_size = 0.0
    for i in range(m):
        left = m - i - 0.5
        total += y[start + i] * y[start + i]
        fall += left * y[start + i]
        fall_size += left * left
    rise = rise_size = best = 0.0
    for i in range(m - 1):
        t = i + 0.5
        rise += t * y[start + i]
        rise_size += t * t
        fall -= (m - t) * y[start + i]
        fall_size -= (m - t) * (m - t)
        low, high = t / (m - t), (t + 1.0) / (m - t - 1.0)
        q = min(max(fall * rise_size / (fall_size * rise), low), high) if rise != 0.0 else high
        fit = rise + q * fall
        best = max(best, fit * fit / (rise_size + q * q * fall_size))
    return max(total - best, 0.0)


@kernel
def relay_shapes(m, shapes):
    """Fill `shapes` with responses of a first-order lag to a relay, from near a triangle to near a square.

    It has a row per lag: the sum of squares, then the `m` samples of a half period. In a steady cycle the response
    rises as 1 - exp(-t/tau) from its zero crossing and, when the relay turns at D, falls as
    (2 - exp(-D/tau)) exp(-(t-D)/tau) - 1. It must be zero after the half period m, so that
    D/tau = log((1 + exp(m/tau)) / 2): one free number, m/tau.
    """
    lags = 0.5
    for row in range(shapes.shape[0]):
        turn = lags + math.log(0.5 * (1.0 + math.exp(-lags)))
        top = 2.0 - math.exp(-turn)
        size = 0.0
        for i in range(m):
            t = lags * (i + 0.5) / m
            shape = 1.0 - math.exp(-t) if t < turn else top * math.exp(turn - t) - 1.0
            shapes[row, i + 1] = shape
            size += shape * shape
        shapes[row, 0] = size
        lags *= 1.6


@kernel
def relay_misfit(y, start, stop, shapes):
    """Misfit of the best of the `relay_shapes` of this length."""
    total = best = 0.0
    for i in range(start, stop):
        total += y[i] * y[i]
    for row in range(shapes.shape[0]):
        fit = 0.0
        for i in range(stop - start):
            fit += shapes[row, i + 1] * y[start + i]
        best = max(best, fit * fit / shapes[row, 0])
    return max(total - best, 0.0)


@kernel
def square_misfit(y, start, stop):
    """Misfits of the half sine and of the square that share the half period's integrated absolute error."""
    m = stop - start
    area = 0.0
    for i in range(m):
        area += y[start + i]
    level = area / m
    sine = square = 0.0
    for i in range(m):
        off = y[start + i] - 0.5 * math.pi * level * math.sin(math.pi * (i + 0.5) / m)
        sine += off * off
        off = y[start + i] - level
        square += off * off
    return sine, square


@kernel
def area_ratio(y, start, stop):
    """Area before the peak over the area after it; the peak's own sample is shared by halves."""
    peak = start
    for i in range(start, stop):
        if abs(y[i]) > abs(y[peak]):
            peak = i
    before = after = 0.5 * abs(y[peak])
    for i in range(start, peak):
        before += abs(y[i])
    for i in range(peak + 1, stop):
        after += abs(y[i])
    return before / after
