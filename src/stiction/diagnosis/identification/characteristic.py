"""How well a good valve predicts the PV if its characteristic is not straight.

The likelihood of a sticky valve is compared with that of a good one whose stem is OP itself. A valve on its seat or
wide open, an equal percentage trim or two valves in split range bend what OP makes of the flow, and such a bend, which
has no memory, may pass for a band: it leaves the straight valve the same part of a wave unexplained. So does a wave
from outside that is no sine, where there is little noise. A valve that sticks has a memory, and no bend predicts what
it does. The bends are tried one by one, with the same regression on the past of the PV as every valve.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.contest import LookAlike
from stiction.diagnosis.identification.likelihood import errors_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from stiction.diagnosis.identification.likelihood import Prediction

__all__ = ["bent_valve", "characteristics"]

ENDS = 0.02, 0.98
"""Quantiles of OP between which a characteristic is bent [-]."""
SEATS, WIDE_OPEN = (0.15, 0.35, 0.55, 0.75), (0.85, 0.65, 0.45, 0.25)
"""Places between them below or above which the flow does not change [-]."""
BENDS, SLOPES = (0.25, 0.5, 0.75), (1.0 / 3.0, 3.0)
"""Places at which the slope changes, and its slope above over that below [-]: split range."""
EXPONENTS = -3.0, -1.5, 1.5, 3.0
"""Logarithms of the largest slope over the smallest [-]: equal percentage, and below zero quick opening."""
BEYOND = 0.3
"""How far beyond the ends the exponential goes on [-]; further out it is held."""
GAPS, HALF_GAPS = (0.35, 0.5, 0.65), (0.1, 0.2)
"""Middles of a gap between two valves in split range, and half its width [-]."""


def bent_valve(prediction: Prediction) -> tuple[str, LookAlike]:
    """Find the bent characteristic with which a good valve predicts the PV best.

    Parameters
    ----------
    prediction : Prediction
        What is predicted.

    Returns
    -------
    tuple of str and LookAlike
        The characteristic, and what the valve leaves.
    """
    op = prediction.op
    low, high = np.quantile(op, ENDS)
    if not high > low:  # OP rests nearly all the time
        low, high = op.min(), op.max()
    place = (op - low) / (high - low if high > low else 1.0)
    names, flows = zip(*characteristics(place), strict=True)
    stems = np.array([flow.reshape(-1, prediction.width).mean(axis=1) for flow in flows])
    # With lags of OP beside it a bend one way predicts what one the other way does: they must not choose.
    best = int(np.argmin(errors_of(prediction._replace(most_op=0), stems)[0]))
    by_half = errors_of(prediction, stems[best : best + 1])[1]
    return names[best], LookAlike(by_half[0], prediction.op_order)


def characteristics(place: NDArray[np.float64]) -> Iterator[tuple[str, NDArray[np.float64]]]:
    """Bend a stem by each characteristic.

    Parameters
    ----------
    place : ndarray
        Stem position, 0 and 1 at the ends of what it mostly moves through [-].

    Yields
    ------
    name : str
        What the characteristic is.
    flow : ndarray
        Flow through the valve [-], same shape.
    """
    for k in SEATS:
        yield f"a seat at {100.0 * k:.0f} % of OP's range", np.maximum(place, k)
    for k in WIDE_OPEN:
        yield f"wide open from {100.0 * k:.0f} % of OP's range", np.minimum(place, k)
    for k in BENDS:
        for slope in SLOPES:
            yield (
                f"a slope {slope:.2g} times as steep from {100.0 * k:.0f} % of OP's range",
                np.where(place < k, place, k + slope * (place - k)),
            )
    for exponent in EXPONENTS:
        shape = "equal percentage" if exponent > 0.0 else "quick opening"
        name = f"{shape}, its slope changing by a factor of {math.exp(abs(exponent)):.2g}"
        yield name, math.copysign(1.0, exponent) * np.exp(exponent * np.clip(place, -BEYOND, 1.0 + BEYOND))
    for k in GAPS:
        for half in HALF_GAPS:
            off = place - k
            yield (
                f"a gap of {200.0 * half:.0f} % about {100.0 * k:.0f} % of OP's range",
                np.sign(off) * np.maximum(np.abs(off) - half, 0.0),
            )
