"""Rossi and Scali 2005: does a relay's response fit better than a sine? (`rossi2005`).

The PV's half periods are fitted with a sine, a triangle, and the response of a first-order lag to a relay.
S_I = (E_sine - E_relay) / (E_sine + E_relay), with the better of relay and triangle as E_relay; the median half period
speaks. From 0.21 stiction, to -0.21 none, between unknown (after `rossi2005`). Errors are mean squares over the
degrees of freedom, m - 1 for the sine and m - 2 for the others, which have a free number besides the amplitude.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.detection.evidence import half_periods, judge, objections
from stiction.diagnosis.detection.shapes import relay_misfit, relay_shapes, sine_misfit, triangle_misfit
from stiction.diagnosis.oscillation.signals import error_name
from stiction.models.numba_compile import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.result import Evidence, Oscillation
    from stiction.records.record import LoopRecord

__all__ = ["relay_indices", "rossi_scali"]


def rossi_scali(record: LoopRecord, oscillation: Oscillation) -> Evidence:
    """Compare relay and triangle with a sine, half period by half period (`rossi2005`).

    `record`: the control error is used; valid for a self-regulating process. `oscillation`: what `find_oscillation`
    says of the record. `index` is S_I [-]: -1 a sine, +1 a relay's response or a triangle.
    """
    values = relay_indices(*half_periods(record, oscillation, "error"))
    index = float(np.median(values)) if values.size else float("nan")
    why = (
        f"{error_name(record)} is closer to {'the response to a relay' if index > 0.0 else 'a sine'}: S_I {index:.2f} "
        f"over {values.size} half periods, -1 is a sine, +1 a relay's response or a triangle."
    )
    against = objections(record, oscillation, integrating=False)
    return judge("rossi_scali", index, 0.21, -0.21, why, against, source="rossi2005")


def relay_indices(y: NDArray[np.float64], cuts: NDArray[np.intp]) -> NDArray[np.float64]:
    """S_I of each half period [-], shape (n_half_periods,), of what `half_periods` gives.

    Examples
    --------
    >>> import numpy as np
    >>> half = np.sin(np.pi * (np.arange(40) + 0.5) / 40)
    >>> relay_indices(half, np.array([[0, 40]])).round(3).tolist()
    [-1.0]
    """
    values = np.empty(cuts.shape[0])
    lengths = cuts[:, 1] - cuts[:, 0]
    shapes = np.empty((12, int(lengths.max(initial=0)) + 1))  # half periods of 0.5, 0.8, ... 88 time constants
    _fit(y, cuts, np.argsort(lengths), shapes, values)
    return values


@kernel
def _fit(y, cuts, order, shapes, values):
    """Fill `values`, in order of the lengths: half periods of one length share their `shapes`."""
    last = 0
    for k in order:
        m = cuts[k, 1] - cuts[k, 0]
        if m != last:
            relay_shapes(m, shapes)
            last = m
        sine = sine_misfit(y, cuts[k, 0], cuts[k, 1]) / (m - 1.0)
        triangle = triangle_misfit(y, cuts[k, 0], cuts[k, 1])
        relay = min(triangle, relay_misfit(y, cuts[k, 0], cuts[k, 1], shapes)) / max(m - 2.0, 1.0)
        both = sine + relay
        values[k] = (sine - relay) / both if both > 0.0 else 0.0
