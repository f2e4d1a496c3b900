"""Bad data: OP or PV is missing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.loop_state.arrays import keep_long_runs

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["find_bad_data"]


def find_bad_data(op: NDArray[np.float64], pv: NDArray[np.float64], *, max_gap: int = 5) -> NDArray[np.bool_]:
    """Mark the samples that cannot be used.

    `op`: controller output [% of span]; NaN is missing. `pv`: process variable [its unit]; NaN is missing. `max_gap`:
    longest gap over which the last value may be held [samples]. Returns True in long gaps.

    Examples
    --------
    >>> import numpy as np
    >>> op = np.full(20, 50.0)
    >>> op[3:5] = op[10:18] = np.nan
    >>> int(find_bad_data(op, np.ones(20)).sum())
    8
    """
    return keep_long_runs(~(np.isfinite(op) & np.isfinite(pv)), max_gap + 1)
