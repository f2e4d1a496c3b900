"""Haegglund 2011: is a square nearer than a sine? (`haegglund2011`).

A sticking valve in a fast self-regulating loop makes the PV a square wave; a badly tuned or disturbed loop a sine.
Sine and square of the same integrated absolute error stand between each pair of zero crossings of the error, with
a_sine = pi IAE / (2 T_half), a_square = IAE / T_half; V is the sum of squares to each,
I = (V_sine - V_square) / (V_sine + V_square), and the median half period speaks. Above 0 stiction, below none.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.detection.evidence import half_periods, judge, objections
from stiction.diagnosis.detection.shapes import square_misfit
from stiction.diagnosis.oscillation.signals import error_name
from stiction.models.numba_compile import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Evidence, Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["haegglund_shape", "square_indices"]


def haegglund_shape(record: LoopRecord, oscillation: Oscillation) -> Evidence:
    """Compare a square with a sine, half period by half period (`haegglund2011`).

    `record`: the control error is used; valid for a self-regulating process, best a fast one. `oscillation`: what
    `find_oscillation` says of the record. `index` is I [-]: -1 a sine, +1 a square.
    """
    values = square_indices(*half_periods(record, oscillation, "error"))
    index = float(np.median(values)) if values.size else float("nan")
    why = (
        f"{error_name(record)} is closer to a {'square' if index >= 0.0 else 'sine'}: I {index:.2f} over {values.size} "
        "half periods, -1 is a sine, +1 a square; a slow process rounds the square."
    )
    against = objections(record, oscillation, integrating=False)
    return judge("haegglund_shape", index, 0.0, 0.0, why, against, source="haegglund2011")


def square_indices(y: NDArray[np.float64], cuts: NDArray[np.intp]) -> NDArray[np.float64]:
    """Haegglund's I of each half period [-], shape (n_half_periods,), of what `half_periods` gives.

    Examples
    --------
    >>> import numpy as np
    >>> square_indices(np.ones(20), np.array([[0, 20]])).tolist()
    [1.0]
    """
    values = np.empty(cuts.shape[0])
    _fit(y, cuts, values)
    return values


@kernel
def _fit(y, cuts, values):
    for k in range(cuts.shape[0]):
        sine, square = square_misfit(y, cuts[k, 0], cuts[k, 1])
        both = sine + square
        values[k] = (sine - square) / both if both > 0.0 else 0.0
