"""He, Wang, Pottmann and Qin 2007: does a triangle fit better than a sine? (`he2007`).

With stiction the valve gives a self-regulating loop a square-like flow; the first integrator after it turns that into
a triangle: the controller in a self-regulating loop (so look at OP), the process in an integrating one (look at PV).

SI = MSE_sine / (MSE_sine + MSE_triangle) for each half period; the median half period speaks.
From 0.6 stiction, to 0.4 none, between unknown (after `he2007`). The mean squares are over the degrees of freedom,
m - 1 and m - 2 (the apex is free too), or few samples would always prefer the triangle.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.detection.evidence import half_periods, judge, objections
from stiction.diagnosis.detection.shapes import sine_misfit, triangle_misfit
from stiction.models.numba_compile import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Evidence, Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["he_curve_fit", "stiction_indices"]


def he_curve_fit(record: LoopRecord, oscillation: Oscillation) -> Evidence:
    """Compare a triangle with a sine, half period by half period (`he2007`).

    `record`: OP is used for a self-regulating process, PV for an integrating one; for an unknown one OP, marked not
    valid. `oscillation`: what `find_oscillation` says of the record. `index` is SI [-]: 0 a sine, 1 a triangle, near
    0.5 neither.
    """
    name = "error" if record.integrating else "op"
    against = objections(record, oscillation)
    if record.integrating is None:
        against.append("OP is the right signal for a self-regulating process, but the type of this process is unknown")
    y, cuts = half_periods(record, oscillation, name)
    values = stiction_indices(y, cuts)
    index = float(np.median(values)) if values.size else float("nan")
    why = (
        f"{'PV' if record.integrating else 'OP'} is {'a triangle' if index >= 0.6 else 'no clear triangle'}: "
        f"SI {index:.2f} over {values.size} half periods, 0 is a sine, 1 a triangle."
    )
    return judge("he_curve_fit", index, 0.6, 0.4, why, against, source="he2007")


def stiction_indices(y: NDArray[np.float64], cuts: NDArray[np.intp]) -> NDArray[np.float64]:
    """SI of each half period [-], shape (n_half_periods,), of what `half_periods` gives.

    Examples
    --------
    >>> import numpy as np
    >>> ramp = np.concatenate([np.arange(10) + 0.5, 9.5 - np.arange(10)])
    >>> stiction_indices(ramp, np.array([[0, 20]])).round(9).tolist()
    [1.0]
    """
    values = np.empty(cuts.shape[0])
    _fit(y, cuts, values)
    return values


@kernel
def _fit(y, cuts, values):
    for k in range(cuts.shape[0]):
        m = cuts[k, 1] - cuts[k, 0]
        sine = sine_misfit(y, cuts[k, 0], cuts[k, 1]) / (m - 1.0)
        triangle = triangle_misfit(y, cuts[k, 0], cuts[k, 1]) / max(m - 2.0, 1.0)
        both = sine + triangle
        values[k] = sine / both if both > 0.0 else 0.5
