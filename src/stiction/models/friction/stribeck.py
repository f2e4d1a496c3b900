"""Stribeck's curve: sliding friction that falls from static to Coulomb friction as the speed rises."""

from __future__ import annotations

import math

from stiction.models.numba_compile import inline_kernel

__all__ = ["stribeck"]


@inline_kernel
def stribeck(ratio: float, coulomb: float, static: float) -> float:
    """Eq. 3 without its sign, Fc + (Fs - Fc) exp(-ratio^2) [N], for `ratio` = v / vs; the minus is erratum E1.

    Above 6.5 Stribeck velocities the exponential is below the rounding of Fc and is left out.
    """
    square = ratio * ratio
    if square > 42.0:
        return coulomb
    return coulomb + (static - coulomb) * math.exp(-square)
