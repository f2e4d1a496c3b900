"""Clock jumps: rows are missing, and OP and PV jump together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.display.number_format import count_noun
from stiction.records.check_result import CheckResult, check_maximum

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["check_clock_jumps", "find_discontinuities"]


def find_discontinuities(
    op: NDArray[np.float64], pv: NDArray[np.float64], *, max_count: int, min_ratio: float = 3.0
) -> NDArray[np.bool_]:
    """Mark the samples at which OP and PV jump together.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        Controller output [% of span] and process variable [engineering units]; NaN is missing.
    max_count : int
        Most places to mark: the clock jumps that the reader met [-].
    min_ratio : float
        Second difference of both signals at such a place [95 % quantiles of each]; noise makes up to 2.5.

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True at a discontinuity. A record below 60 samples has none.

    Examples
    --------
    >>> k = np.delete(np.arange(200), range(100, 130)) / 9.0
    >>> np.flatnonzero(find_discontinuities(np.sin(k), np.cos(k), max_count=1)).tolist()
    [100]
    """
    mask = np.zeros(op.size, dtype=bool)
    if op.size < 60 or max_count < 1:
        return mask
    size = np.full(op.size, np.inf)
    for x in (op, pv):
        bend = np.abs(np.diff(x, 2, prepend=(x[0], x[0])))
        usual = float(np.nanpercentile(bend, 95.0)) if np.isfinite(bend).any() else 0.0
        size = np.fmin(size, bend / usual if usual > 0.0 else 0.0)
    for _ in range(max_count):
        k = int(np.argmax(size))
        if not size[k] > min_ratio:
            break
        mask[k] = True
        size[max(k - 2, 0) : k + 3] = 0.0
    return mask


def check_clock_jumps(
    op: NDArray[np.float64], pv: NDArray[np.float64] | None, clock_jumps: int, summer_time: int
) -> CheckResult:
    """Clock changes that the reader met; a change of summer time across which OP and PV continue lost no rows."""
    jumps = pv is not None and find_discontinuities(op, pv, max_count=min(clock_jumps, 20)).any()
    undone = 0 if jumps else summer_time
    count = clock_jumps - undone
    finding = "the clock runs evenly"
    if count:
        finding = f"the clock jumped or rows were out of order {count_noun(count, 'time')}"
    elif undone:
        finding = "the clock change of summer time was corrected; OP and PV continue without a jump"
    remedy = "check the assumptions of the reader, or split the record there"
    return check_maximum("clock jumps", count, "-", warn=0, finding=finding, remedy=remedy)
