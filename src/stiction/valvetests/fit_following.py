r"""A stem that followed every ramp: its deadband, and the largest S that the test cannot exclude.

No slip was visible, so there is none to fit. The fit uses the difference between rising and falling OP,

.. math:: u - x = c + d\,(D / 2 + \tau\,|\dot u|), \qquad d = \pm 1

with u the OP and x the stem in the middle of each ramp, D the deadband and :math:`\tau` the lag of the stem.
Slips below the smallest visible stair are possible, so S lies between D and D plus one such stair.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.valvetests.result import Estimate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.valvetests.ramp_split import OpRamp
    from stiction.valvetests.stem_moves import StemMoves

__all__ = ["fit_following"]


def fit_following(ramps: Sequence[OpRamp], moves: Sequence[StemMoves]) -> tuple[Estimate, Estimate]:
    """Deadband and S of a stem that followed every ramp, from its position.

    `ramps`: ramps of the OP. `moves`: motion of the stem in each ramp [% of span]. Returns deadband and S [% of span];
    unknown when the stem did not follow in both directions.
    """
    if not all(moved.follows for moved in moves) or len({ramp.direction for ramp in ramps}) < 2:
        return Estimate(), Estimate()
    rows, distances = [], []
    for ramp, moved in zip(ramps, moves, strict=True):
        for follow in moved.follows:
            rows.append((1.0, 0.5 * ramp.direction, ramp.rate))
            distances.append(0.5 * (follow.op_start + follow.op_end - follow.stem_start - follow.stem_end))
    several = len({round(abs(ramp.rate), 9) for ramp in ramps}) > 1
    A, y = np.array(rows)[:, : 3 if several else 2], np.array(distances)
    weights, *_ = np.linalg.lstsq(A, y, rcond=None)
    free = max(y.size - A.shape[1], 1)
    error = math.sqrt(float(np.sum((y - A @ weights) ** 2)) / free * float(np.linalg.pinv(A.T @ A)[1, 1]))
    D, half = max(float(weights[1]), 0.0), 1.96 * error
    hidden = min(moved.smallest_stair for moved in moves)
    deadband = Estimate(D, max(D - half, 0.0), D + half, n=y.size)
    return deadband, Estimate(D, deadband.low, D + half + hidden, n=y.size)
