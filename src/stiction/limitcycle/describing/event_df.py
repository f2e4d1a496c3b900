"""Describing function event by event: exact for every valve that rests, slips and follows.

Between events the stem rests (constant) or follows (its input less a lag), so both Fourier integrals are sums of
closed forms and nothing is sampled. This is the only exact form for Srinivasan's valve with a finite rate, and
the independent check of the closed forms.
"""

from __future__ import annotations

import math

import numpy as np

from stiction.models.numba_compile import kernel

__all__ = ["continuous_form_df"]


@kernel
def _constant_integrals(level, a, b):
    """Fourier integrals of a constant over phases a..b: against sin and cos."""
    return level * (math.cos(a) - math.cos(b)), level * (math.sin(b) - math.sin(a))


@kernel
def _sine_integrals(amplitude, a, b):
    """Fourier integrals of A sin(phase) over phases a..b: against sin and cos."""
    half = (b - a) / 2.0
    return (
        amplitude * (half - (math.sin(2.0 * b) - math.sin(2.0 * a)) / 4.0),
        amplitude * (math.sin(b) ** 2 - math.sin(a) ** 2) / 2.0,
    )


@kernel
def _half_period(sb, lag, slow, amplitude, x):
    """Drive the stem from x while A sin goes from -A to A; `slow` is r / (A omega). Returns x and both integrals."""
    phase, end = -math.pi / 2.0, math.pi / 2.0
    until = math.acos(min(slow, 1.0)) if slow <= 1.0 else -math.pi
    inphase, quadrature = 0.0, 0.0
    while phase < end:
        ratio = (x + sb) / amplitude
        if ratio > 1.0 + 1e-12:
            break
        slip = math.asin(min(max(ratio, -1.0), 1.0))
        s, c = _constant_integrals(x, phase, slip)
        inphase += s
        quadrature += c
        phase = slip
        x = amplitude * math.sin(phase) - lag
        if -until <= phase < until:
            s, c = _sine_integrals(amplitude, phase, until)
            s2, c2 = _constant_integrals(-lag, phase, until)
            inphase += s + s2
            quadrature += c + c2
            phase = until
            x = amplitude * math.sin(phase) - lag
    s, c = _constant_integrals(x, phase, max(phase, end))
    return x, inphase + s, quadrature + c


@kernel
def _sine_response(sb, lag, slow, amplitude, x):
    """N of one valve from the position x when two successive periods agree, and the number of periods."""
    real, imag = 0.0, 0.0
    for turn in range(64):
        top, s_up, c_up = _half_period(sb, lag, slow, amplitude, x)
        down, s_down, c_down = _half_period(sb, lag, slow, amplitude, -top)
        bottom = -down
        real = (s_up + s_down) / (math.pi * amplitude)
        imag = (c_up + c_down) / (math.pi * amplitude)
        if abs(bottom - x) <= 1e-13 * amplitude:
            return real, imag, turn
        x = bottom
    return real, imag, 64


@kernel
def _sine_responses(sb, lag, slow, amplitude, start, real, imag, turns):
    for k in range(amplitude.shape[0]):
        real[k], imag[k], turns[k] = _sine_response(sb, lag, slow[k], amplitude[k], start[k])


def continuous_form_df(sb: float, lag: float, rate: float, amplitude, omega, start):
    """N(A, omega) by events, and the turns until the motion repeated.

    `sb`, `lag`, `rate`: the valve, see `ContinuousValve` [% of span, % of span, % of span / s]. `amplitude`, `omega`,
    `start`, of shape (n,): amplitude [% of span] and frequency [rad/s] of the input, and the stem's rest position
    before [% of span]. Returns `value`: N; `turns`: periods until two successive ones agreed; 64 when they never did.
    """
    n = amplitude.shape[0]
    real, imag, turns = np.empty(n), np.empty(n), np.empty(n, dtype=np.int64)
    slow = np.full(n, np.inf) if math.isinf(rate) else rate / (amplitude * omega)
    _sine_responses(sb, lag, slow, amplitude, start, real, imag, turns)
    return real + 1j * imag, turns
