"""Clock jumps: rows are missing, and OP and PV break off together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["find_discontinuities"]


def find_discontinuities(
    op: NDArray[np.float64], pv: NDArray[np.float64], *, max_count: int, min_ratio: float = 3.0
) -> NDArray[np.bool_]:
    """Mark the samples at which OP and PV break off together.

    Parameters
    ----------
    op, pv : ndarray, shape (n_samples,)
        Controller output [% of span] and process variable [engineering units]; NaN is missing.
    max_count : int
        Most places to mark: the clock jumps that the reader met [-].
    min_ratio : float
        Second difference of both signals at such a place [95 % quantiles of each].

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True at a discontinuity. A record below 60 samples has none.

    Notes
    -----
    Noise that the controller passes from PV on to OP bends both by up to 2.5 of these quantiles.

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
