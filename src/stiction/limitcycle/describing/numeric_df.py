"""Describing function of any valve: drive its compiled step with a sampled sine until periods repeat.

A slip that happens between two samples is placed half a sample late at most, so the error is bounded by
h TV(x) / (2 pi A), with h the phase between samples and TV(x) the stem's travel in a period; times the periods run,
as a staircase keeps the overshoot of earlier slips. The number of samples is doubled until that bound and the change
by the last doubling both meet the tolerance.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import ConvergenceError
from stiction.models.dispatch import valve_at_rest, valve_step
from stiction.models.numba_compile import kernel

if TYPE_CHECKING:
    from stiction.models import Valve

__all__ = ["numeric_df"]

_MIN_SAMPLES = 1 << 10
"""Samples in a period at first [-]."""
_MAX_SAMPLES = 1 << 22
"""Samples in a period at most [-]."""
_MAX_PERIODS = 40
"""Periods within which two in succession must agree [-]."""


@kernel
def _stroke_sine(model, p, n, amplitude, centre, start, lead_in, agree, most):
    """N by sums over one period of n samples, the travel in it, and the number of periods; -1 when it did not settle.

    The input starts at its lowest point, where the stem of an established staircase rests on its lowest level.
    """
    s = valve_at_rest(model, centre - amplitude, start, p)
    real, imag, travel, period = 0.0, 0.0, 0.0, 0
    step = 2.0 * math.pi / n
    while period < most:
        inphase, quadrature, travel, before = 0.0, 0.0, 0.0, s.position
        for k in range(n):
            size = amplitude
            if period < lead_in:
                size *= 1.0 + (lead_in - period - k / n) / lead_in
            wave = -math.cos(k * step)
            s = valve_step(model, centre + size * wave, s, p)
            x = min(max(s.position, p[0]), p[1])
            inphase += (x - centre) * wave
            quadrature += (x - centre) * math.sin(k * step)
            travel += abs(x - before)
            before = x
        old_real, old_imag = real, imag
        real, imag = 2.0 * inphase / (n * amplitude), 2.0 * quadrature / (n * amplitude)
        period += 1
        if period > lead_in + 1 and math.hypot(real - old_real, imag - old_imag) <= agree:
            return real, imag, travel, period
    return real, imag, travel, -1


def numeric_df(
    valve: Valve, amplitude: float, omega: float | None, start: float | None, tolerance: float, centre: float = 0.0
) -> complex:
    """N at one amplitude, to within `tolerance`.

    Parameters
    ----------
    valve : Valve
        Any valve.
    amplitude : float
        Amplitude of its input [% of span].
    omega : float or None
        Frequency of its input [rad/s]; None for a rate-independent valve.
    start : float or None
        Rest position of the stem before the first sample [% of span]; None starts with two periods of falling
        amplitude, which lead to the established oscillation.
    tolerance : float
        Largest error allowed [-].
    centre : float
        Mean of the sine [% of span].

    Raises
    ------
    ConvergenceError
        When successive periods do not agree, or the finest sampling does not meet the tolerance.
    """
    n, last = _MIN_SAMPLES, math.nan
    period = 2.0 * math.pi / (omega or 1.0)
    lead_in = 2 if start is None else 0
    while n <= _MAX_SAMPLES:
        packed = valve.pack(period / n)
        real, imag, travel, periods = _stroke_sine(
            valve.code, packed, n, amplitude, centre, centre + (start or 0.0), lead_in, tolerance / 4.0, _MAX_PERIODS
        )
        if periods < 0 and n < _MAX_SAMPLES >> 4:
            n *= 4
            continue
        if periods < 0:
            raise ConvergenceError(
                f"the valve motion for a sine of {amplitude:g} % did not become periodic within {tolerance / 4:g} in "
                f"{_MAX_PERIODS} periods; give a larger tolerance."
            )
        value = complex(real, imag)
        bound = periods * travel / (n * amplitude)
        if bound <= tolerance and abs(value - last) <= tolerance:
            return value
        last = value
        n *= 2
        while n < _MAX_SAMPLES and periods * travel / (2 * n * amplitude) > tolerance:
            n *= 2
    raise ConvergenceError(
        f"N at an amplitude of {amplitude:g} % does not meet the tolerance {tolerance:g} with {_MAX_SAMPLES} samples "
        "in a period; give a larger tolerance."
    )


def numeric_dfs(valve: Valve, amplitude, omega, start, tolerance: float, centre: float = 0.0):
    """`numeric_df` over arrays of equal shape (n,); `omega` and `start` may be None."""
    return np.array(
        [
            numeric_df(
                valve,
                float(a),
                None if omega is None else float(omega[k]),
                None if start is None else float(start[k]),
                tolerance,
                centre,
            )
            for k, a in enumerate(amplitude)
        ],
        dtype=complex,
    )
