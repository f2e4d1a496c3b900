"""Check that OP does not react to PV: a controller passes the noise of PV to OP, a test in manual does not."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.quantiles import robust_std
from stiction.valvetests.segmentation import quantisation_step

if TYPE_CHECKING:
    from stiction.records import LoopRecord

__all__ = ["FEEDBACK_CORRELATION", "noise_correlation"]

FEEDBACK_CORRELATION = 0.5
"""Correlation of the noise above which OP reacts to PV [-]; unrelated noise exceeds it in less than 1 of 1000 cases."""
MIN_SAMPLES = 100
"""Smallest number of samples for the check [-]."""
MIN_OP_NOISE = 1e-3
"""OP noise below which OP counts as free of noise [% of span]."""
MAX_OP_ROUNDING = 0.3
"""Largest rounding of an OP [% of span]."""
OUTLIER_LIMIT_STD = 4.0
"""Second differences above this many standard deviations are ignored, because they are slips or corners [-]."""
SECOND_DIFFERENCE_STD = math.sqrt(6.0)
"""Standard deviation of the second differences of white noise over its own [-]."""


def noise_correlation(record: LoopRecord) -> float:
    """Correlation of the noise of OP with that of PV at the same sample [-].

    `record`: with OP [% of span] and PV. Returns about -1 for a controller that opens the valve when PV is low, 1 for
    the other direction, whatever its gain; about 0 for an OP in manual; NaN when PV was not recorded or OP or PV has no
    noise.
    """
    if record.pv is None or len(record) < MIN_SAMPLES:
        return math.nan
    bends = [signal[2:] - 2.0 * signal[1:-1] + signal[:-2] for signal in (record.op, record.pv)]
    known = np.isfinite(bends[0]) & np.isfinite(bends[1])
    if known.sum() < MIN_SAMPLES:
        return math.nan
    centred = [bend[known] - np.median(bend[known]) for bend in bends]
    spread = [robust_std(bend, centre=0.0) for bend in centred]
    valid = (np.abs(centred[0]) <= OUTLIER_LIMIT_STD * spread[0]) & (
        np.abs(centred[1]) <= OUTLIER_LIMIT_STD * spread[1]
    )
    if valid.sum() < MIN_SAMPLES or spread[0] < MIN_OP_NOISE * SECOND_DIFFERENCE_STD or spread[1] == 0.0:
        return math.nan
    op, pv = centred[0][valid], centred[1][valid]
    together = float(op @ pv) / math.sqrt(float(op @ op) * float(pv @ pv))
    # The rounding of OP in manual moves a valve that follows, and with it PV, in the same direction.
    return (
        together
        if together < 0.0 or spread[0] > SECOND_DIFFERENCE_STD * quantisation_step(record.op, MAX_OP_ROUNDING)
        else math.nan
    )
