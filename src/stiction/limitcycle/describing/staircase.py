"""Describing function of a staircase (Stenman's valve, He's, Srinivasan's that never follows), any rest levels.

Every upward jump to the level L happens when the input passes L + lag, every downward jump from L at L - sb.
Integrating the two Fourier integrals by parts leaves a sum over jumps: with the jump size j,

    Re N = j / (pi A) sum_L [ sqrt(1 - ((L + lag) / A)^2) + sqrt(1 - ((L - sb) / A)^2) ]
    Im N = -n j (sb + lag) / (pi A^2)

over the n levels L that are jumped to. Stenman's valve has sb = j = d, lag = 0. Eqs. 6-7 of the paper are the
family of levels +-d/2, +-3d/2, ... and miss a factor 2 on the inner roots.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from stiction.errors import ParameterError
from stiction.models.numba_compile import kernel

__all__ = [
    "require_families",
    "rest_level_offset",
    "staircase_amplitudes",
    "staircase_df",
    "staircase_levels",
    "stenman_printed",
]

_LEVEL_TOLERANCE = 1e-12
"""Relative tolerance on the amplitude at which a level is reached [-]."""


def rest_level_offset(jump: float, family: str | float, rest: float = 0.0) -> float:
    """Offset of the rest levels from the centre of the oscillation [% of span], 0 <= offset < jump.

    `jump`: distance between levels [% of span]. `family`: "half" (levels +-jump/2, +-3 jump/2, ...), "integer" (0,
    +-jump, ...) or one of the levels [% of span]. `rest`: position of the centre on the scale of that level [% of
    span].
    """
    if family == "half":
        return jump / 2.0
    if family == "integer":
        return 0.0
    try:
        level = float(family)
    except (TypeError, ValueError, OverflowError):
        level = math.nan
    if not math.isfinite(level):
        raise ParameterError(f"family = {family!r} is unknown; use 'half', 'integer' or a rest level in % of span.")
    return (level - rest) % jump


def require_families(families: Iterable[str | float]) -> tuple[str | float, ...]:
    """Return families of rest levels as a tuple; raise when one is unknown."""
    if isinstance(families, str) or not isinstance(families, Iterable):
        raise ParameterError(
            f"families = {families!r} is not a list of families; give for example ['half', 'integer']."
        )
    chosen = tuple(families)
    for family in chosen:
        rest_level_offset(1.0, family)
    return chosen


def staircase_levels(sb: float, lag: float, offset: float, amplitude: float) -> tuple[float, ...]:
    """Rest levels visited under an input of this amplitude, ascending [% of span]; fewer than two: no motion."""
    jump = sb - lag
    slack = _LEVEL_TOLERANCE * amplitude
    top = math.floor((amplitude - lag - offset + slack) / jump)
    bottom = math.ceil((lag - amplitude - offset - slack) / jump)
    return tuple(offset + k * jump for k in range(bottom, top + 1))


def staircase_amplitudes(sb: float, lag: float, offset: float, largest: float) -> list[float]:
    """Amplitudes at which another level is reached, ascending, the onset of motion first [% of span]."""
    jump = sb - lag
    up = [offset + k * jump + lag for k in range(-2, int(largest / jump) + 2)]
    down = [-(offset - k * jump - lag) for k in range(-2, int(largest / jump) + 2)]
    onset = next(a for a in sorted(up + down) if len(staircase_levels(sb, lag, offset, a)) > 1)
    reached = sorted(a for a in up + down if onset - _LEVEL_TOLERANCE * onset <= a <= largest)
    return [a for i, a in enumerate(reached) if i == 0 or a > reached[i - 1] * (1.0 + 1e-9)]


@kernel
def _sum_jumps(sb, lag, offset, amplitude, real, imag):
    jump = sb - lag
    for i in range(amplitude.shape[0]):
        a = amplitude[i]
        slack = 1e-12 * a
        top = math.floor((a - lag - offset + slack) / jump)
        bottom = math.ceil((lag - a - offset - slack) / jump)
        total = 0.0
        for k in range(bottom + 1, top + 1):
            level = offset + k * jump
            total += math.sqrt(max(1.0 - ((level + lag) / a) ** 2, 0.0))
            total += math.sqrt(max(1.0 - ((level - sb) / a) ** 2, 0.0))
        real[i] = jump * total / (math.pi * a)
        imag[i] = -max(top - bottom, 0) * jump * (sb + lag) / (math.pi * a * a)


def staircase_df(sb: float, lag: float, offset: float, amplitude):
    """N(A) of a staircase whose levels are offset + k (sb - lag), shape of `amplitude`."""
    amplitude = np.asarray(amplitude, dtype=float)
    real, imag = np.empty(amplitude.size), np.empty(amplitude.size)
    _sum_jumps(sb, lag, offset, np.ascontiguousarray(amplitude.ravel()), real, imag)
    return (real + 1j * imag).reshape(amplitude.shape)


def stenman_printed(d: float, amplitude, *, roots_repaired: bool = False):
    """Eqs. 6 and 7 letter by letter; NaN above 5d/2, which the paper does not cover.

    `d`: stiction band [% of span]. `amplitude`: amplitude of the valve's input [% of span]. `roots_repaired`: read
    sqrt((1 - a)^2) as sqrt(1 - a^2), the first misprint, and leave the second (the missing factor 2).

    References
    ----------
    srinivasan2008, eqs. 6, 7.
    """
    amplitude = np.asarray(amplitude, dtype=float)

    def root(a):
        return np.sqrt(np.maximum(1.0 - a**2, 0.0)) if roots_repaired else np.abs(1.0 - a)

    ratio = d / amplitude
    first, other = root(ratio / 2.0), root(3.0 * ratio / 2.0)
    scale = 2.0 * ratio / math.pi
    second = ratio <= 2.0 / 3.0
    real = scale * np.where(second, first + other, first)
    imag = -(ratio**2) / math.pi * np.where(second, 3.0, 1.0)
    value = np.where(ratio > 2.0, 0.0, real + 1j * imag)
    return np.where(ratio <= 2.0 / 5.0, complex(math.nan, math.nan), value)
