"""Samples that no valve predicts: steps of the load, and whatever else befalls a loop a few times in a record.

One step of the load is worth more in a sum of squares than all that a valve does: it swells the variance by which each
valve is measured, and Vuong's test sees one half cycle that outweighs the others. Where neither the likeliest sticky
valve nor a good one predicts the PV, by `BEYOND` robust standard deviations, these samples and those about them are
left out of the regression, and the best of the valves tried go on from there. Their PV and OP remain the past of
others. A slip of a valve that sticks is not left out: it predicts that. Where more than `MOST` of the record would be,
nothing is: what befalls a loop all the time is its noise. The limits were chosen on `simulation.population`, seed 10,
and on sticky loops whose load steps (`tests/diagnosis/verdict/load_steps.py`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.identification.likelihood import FLOOR, NONE, errors_of, stem_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.diagnosis.identification.likelihood import Prediction, Trial

__all__ = ["shocks_of"]

BEYOND = 6.0
"""Standard deviations, by the median, that neither valve comes near [-]."""
SLIPS, LARGER = 0.98, 1.5
"""Share of what a good valve leaves, and how many times as much a shock leaves [-]: a slip that comes a sample late by
the likeliest valve leaves mostly no more than others do by a good one, and must count lest S stay where it is. Without
this S is within 5 % in 0.626 of the sticky loops of seed 10, with it in 0.646 (at `BEYOND` 5 and `ABOUT` 4)."""
ABOUT = 8
"""Samples left out either way [-]: a step of the load comes through the process."""
MOST = 0.05
"""Share of the record that is left out at most [-]."""


def shocks_of(prediction: Prediction, best: Trial) -> NDArray[np.int64]:
    """Find the samples that neither a sticky valve nor a good one predicts.

    Parameters
    ----------
    prediction : Prediction
        What is predicted.
    best : Trial
        The likeliest sticky valve.

    Returns
    -------
    ndarray, shape (n_shocks,)
        Their places, those about them among them, increasing; none where there would be too many.
    """
    n, begin = prediction.pv.size, prediction.begin
    stems = np.stack([u.reshape(n, prediction.width).mean(axis=1) for u in (prediction.op, stem_of(prediction, best))])
    each = prediction._replace(ends=np.arange(begin + 1, n + 1))
    by_valve = errors_of(each, stems)[1]
    left = by_valve.min(axis=0)
    slips, noise = float(np.quantile(by_valve[0], SLIPS)), max(float(np.median(left)) / 0.6745**2, FLOOR)
    hit = np.flatnonzero(left > max(BEYOND**2 * noise, LARGER**2 * slips))
    if hit.size == 0:
        return NONE
    rows = np.unique(np.clip(hit[:, np.newaxis] + np.arange(-ABOUT, ABOUT + 1), 0, n - begin - 1)) + begin
    return rows if rows.size <= MOST * n else NONE
