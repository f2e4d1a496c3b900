"""Singhal and Salsbury 2005: is the error's area before its peak larger than after it? (`singhal2005`).

A sticking valve holds the error while it builds up and lets it fall at once when the stem slips; tight tuning makes a
sine, alike on both sides of the peak. R = A1 / A2 for each half period. From 1 + delta stiction, to 1 + delta / 2 none;
delta comes from the noise: here twice the standard error of the median of log R over the half periods. The smoothing
that finds the peak in noise also rounds it, so that a saw tooth's R comes out too low, never a sine's too high.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.detection.evidence import half_periods, judge, objections
from stiction.diagnosis.detection.shapes import area_ratio
from stiction.diagnosis.oscillation.signals import error_name
from stiction.models.numba_compile import kernel
from stiction.records.quantiles import robust_std

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Evidence, Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["area_ratios", "singhal_salsbury"]

LEAST_DELTA = 0.05
MEDIAN_ERROR = 1.253  # standard error of a median over the standard deviation, times sqrt(n)


def singhal_salsbury(record: LoopRecord, oscillation: Oscillation) -> Evidence:
    """Compare the areas before and after the error's peaks (`singhal2005`).

    `record`: the control error is used; valid for a self-regulating process. `oscillation`: what `find_oscillation`
    says of the record. `index` is R [-]: 1 for a sine, above 1 where the error builds up slowly and falls at once.
    """
    error, cuts = half_periods(record, oscillation, "error")
    # Rounded, lest the unit of the PV decide which of two equal samples is the peak.
    largest = float(np.abs(error).max(initial=0.0))
    logs = np.log(area_ratios(np.round(error / largest, 9) if largest > 0.0 else error, cuts))
    index, delta = float("nan"), LEAST_DELTA
    if logs.size:
        middle = float(np.median(logs))
        spread = MEDIAN_ERROR * robust_std(logs) / np.sqrt(logs.size)
        index, delta = float(np.exp(middle)), max(LEAST_DELTA, float(np.expm1(2.0 * spread)))
    why = (
        f"{error_name(record)} has R = {index:.2f} times as much area before its peak as after it (median of "
        f"{logs.size} half periods, uncertainty {delta:.2f}); 1 is symmetric."
    )
    against = objections(record, oscillation, integrating=False)
    return judge("singhal_salsbury", index, 1.0 + delta, 1.0 + 0.5 * delta, why, against, source="singhal2005")


def area_ratios(y: NDArray[np.float64], cuts: NDArray[np.intp]) -> NDArray[np.float64]:
    """R of each half period [-], shape (n_half_periods,), of what `half_periods` gives.

    Examples
    --------
    >>> import numpy as np
    >>> area_ratios(np.array([1.0, 2.0, 3.0, 4.0, 2.0]), np.array([[0, 5]])).tolist()
    [2.0]
    """
    values = np.empty(cuts.shape[0])
    _ratios(y, cuts, values)
    return values[np.isfinite(values) & (values > 0.0)]


@kernel
def _ratios(y, cuts, values):
    for k in range(cuts.shape[0]):
        values[k] = area_ratio(y, cuts[k, 0], cuts[k, 1])
