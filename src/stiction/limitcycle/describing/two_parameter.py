"""Describing function of the (S, J) valve, after Choudhury: Kano's valve for any J, Choudhury's for J <= S."""

from __future__ import annotations

import math

import numpy as np

__all__ = ["two_parameter_df"]


def two_parameter_df(S: float, J: float, amplitude):
    """N(A) of an established oscillation, shape of `amplitude`; 0 up to S / 2, where the stem rests.

    `S`, `J`: deadband plus stickband, and slip jump [% of span]. `amplitude`: amplitude of the valve's input [% of
    span].

    From rest the input must first exceed the break-away (S + J) / 2. J = 0 is the describing function of
    deadband. The form is after choudhury2005 and was confirmed by numerical integration.
    """
    amplitude = np.asarray(amplitude, dtype=float)
    moves = amplitude > S / 2.0
    x = np.where(moves, amplitude, max(S, 1.0))
    phi = np.arcsin(np.clip((x - S) / x, -1.0, 1.0))
    a = x / 2.0 * np.sin(2.0 * phi) - 2.0 * x * np.cos(phi) - x * (math.pi / 2.0 + phi) + 2.0 * (S - J) * np.cos(phi)
    b = -1.5 * x + x / 2.0 * np.cos(2.0 * phi) + 2.0 * x * np.sin(phi) - 2.0 * (S - J) * np.sin(phi)
    return np.where(moves, -(a - 1j * b) / (math.pi * x), 0.0)
