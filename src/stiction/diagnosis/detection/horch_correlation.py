"""Horch 1999: is the cross-correlation of OP and PV odd or even? (`horch1999`).

With PI control of a self-regulating process, stiction sets OP and PV a quarter period apart (odd correlation), a
disturbance or tight tuning half a period (even). With r0 the correlation at lag 0, r_opt its extremum between the zero
crossings -tau_l and tau_r around lag 0:

    d_rho = |r0 - r_opt| / |r0 + r_opt|,    d_tau = |tau_l - tau_r| / (tau_l + tau_r)

Stiction where d_rho >= 1/3 and d_tau >= 2/3, none where d_rho <= 0.072 and d_tau <= 1/3, else unknown (after
`horch1999`). Derived here: for sinusoids psi from even, d_rho = (1 - cos psi) / (1 + cos psi), d_tau = 2 psi / pi, so
the two pairs of limits are the same angles, 60 and 30 degrees. The index is the smaller of both as a share of 90 deg.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.detection.evidence import judge, objections, swing
from stiction.records.correlation import lagged_products

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Evidence, Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["correlation_offsets", "cross_correlation", "horch_correlation"]


def horch_correlation(record: LoopRecord, oscillation: Oscillation) -> Evidence:
    """Place the cross-correlation of OP and PV between even and odd (`horch1999`).

    `record`: OP and control error are used; valid for PI control of a self-regulating process. `oscillation`: what
    `find_oscillation` says of the record. `index` is the smaller phase offset from even over a quarter period [-]: 0
    even, 1 odd, votes from 2/3.
    """
    op, error = swing(record, oscillation, "op"), swing(record, oscillation, "error")
    low = high = d_rho = d_tau = float("nan")
    if op is not None and error is not None and oscillation.period > 0.0:
        reach = min(round(oscillation.period / record.dt), len(record) - 1)
        d_rho, d_tau = correlation_offsets(cross_correlation(op, error, reach))
        by_height = 2.0 / math.pi * math.acos((1.0 - min(d_rho, 1.0)) / (1.0 + min(d_rho, 1.0)))
        low, high = min(by_height, d_tau), max(by_height, d_tau)
    kind = "odd" if low >= 2.0 / 3.0 else "even" if high <= 1.0 / 3.0 else "neither odd nor even"
    why = (
        f"The cross-correlation of OP and PV is {kind}: d_rho is {d_rho:.2f} (from 1/3 on odd, up to 0.072 even), "
        f"d_tau {d_tau:.2f} (from 2/3 on odd, up to 1/3 even). Valid for PI control without coupled loops."
    )
    against = objections(record, oscillation, integrating=False)
    # Even needs both offsets below 1/3, stiction both above 2/3; the smaller one alone decides only the latter.
    no_stiction = 1.0 / 3.0 if high <= 1.0 / 3.0 else -1.0
    return judge("horch_correlation", low, 2.0 / 3.0, no_stiction, why, against, source="horch1999")


def cross_correlation(x: NDArray[np.float64], y: NDArray[np.float64], reach: int) -> NDArray[np.float64]:
    """Sum of x[k] y[k + lag] for lags -reach .. reach, over the pairs each lag has, shape (2 reach + 1,)."""
    x, y = x - x.mean(), y - y.mean()
    r = np.concatenate([lagged_products(y, x, reach + 1)[:0:-1], lagged_products(x, y, reach + 1)])
    return r / (x.shape[0] - np.abs(np.arange(-reach, reach + 1)))


def correlation_offsets(r: NDArray[np.float64]) -> tuple[float, float]:
    """Horch's d_rho and d_tau of a cross-correlation.

    `r`, of shape (2 reach + 1,): Cross-correlation, lag 0 in the middle. Returns `d_rho`, `d_tau`: both [-]; NaN where
    no zero crossing surrounds lag 0.

    Examples
    --------
    >>> import numpy as np
    >>> lags = np.arange(-40, 41)
    >>> d_rho, d_tau = correlation_offsets(np.cos(2 * np.pi * lags / 40 + np.pi / 3))
    >>> round(d_rho, 2), round(d_tau, 2)
    (0.33, 0.67)
    """
    middle = r.shape[0] // 2
    positive = r > 0.0
    at = np.flatnonzero(positive[1:] != positive[:-1])
    crossings = at + r[at] / (r[at] - r[at + 1]) - middle
    left, right = crossings[crossings <= 0.0], crossings[crossings > 0.0]
    if not (left.size and right.size):
        return float("nan"), float("nan")
    tau_l, tau_r = -float(left[-1]), float(right[0])
    between = r[middle - int(tau_l) : middle + int(tau_r) + 1]
    r_opt = float(between[np.argmax(np.abs(between))])
    r0 = float(r[middle])
    if r0 + r_opt == 0.0:
        return float("nan"), float("nan")
    return abs(r0 - r_opt) / abs(r0 + r_opt), abs(tau_l - tau_r) / (tau_l + tau_r)
