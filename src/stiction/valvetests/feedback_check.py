"""Whether the OP was given or answers PV: a controller passes the noise of PV on to OP, a test in manual does not."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.valvetests.segmentation import quantisation_step

if TYPE_CHECKING:
    from stiction.records import LoopRecord

__all__ = ["FEEDBACK_CORRELATION", "noise_correlation"]

FEEDBACK_CORRELATION = 0.5
"""Correlation of the noise above which OP reacts to PV [-]; its chance in 100 samples of unrelated noise is below
1e-3."""
MIN_SAMPLES = 100
"""Fewest samples that tell [-]."""
MIN_OP_NOISE = 1e-3
"""Noise below which an OP has none [% of span]."""
MAX_OP_ROUNDING = 0.3
"""Largest rounding of an OP [% of span]."""
OUTLIER_LIMIT_STD = 4.0
"""Second differences beyond this many standard deviations are left out: slips and corners are no noise [-]."""
SECOND_DIFFERENCE_STD = math.sqrt(6.0)
"""Standard deviation of the second differences of white noise over its own [-]."""


def noise_correlation(record: LoopRecord) -> float:
    """Correlation of the noise of OP with that of PV at the same sample [-].

    Parameters
    ----------
    record : LoopRecord
        With OP [% of span] and PV.

    Returns
    -------
    float
        About -1 for a controller that opens the valve when PV is low, 1 for the other direction, whatever its gain;
        about 0 for an OP given in manual; NaN where PV was not recorded or one of the two has no noise.
    """
    if record.pv is None or len(record) < MIN_SAMPLES:
        return math.nan
    bends = [signal[2:] - 2.0 * signal[1:-1] + signal[:-2] for signal in (record.op, record.pv)]
    known = np.isfinite(bends[0]) & np.isfinite(bends[1])
    if known.sum() < MIN_SAMPLES:
        return math.nan
    centred = [bend[known] - np.median(bend[known]) for bend in bends]
    spread = [1.4826 * float(np.median(np.abs(bend))) for bend in centred]
    kept = (np.abs(centred[0]) <= OUTLIER_LIMIT_STD * spread[0]) & (np.abs(centred[1]) <= OUTLIER_LIMIT_STD * spread[1])
    if kept.sum() < MIN_SAMPLES or spread[0] < MIN_OP_NOISE * SECOND_DIFFERENCE_STD or spread[1] == 0.0:
        return math.nan
    op, pv = centred[0][kept], centred[1][kept]
    together = float(op @ pv) / math.sqrt(float(op @ op) * float(pv @ pv))
    # The rounding of a given OP moves a valve that follows at once, and with it PV: up where OP goes up.
    return (
        together
        if together < 0.0 or spread[0] > SECOND_DIFFERENCE_STD * quantisation_step(record.op, MAX_OP_ROUNDING)
        else math.nan
    )
