"""A first-order lag of a sampled signal: `scipy.signal.lfilter` of one pole, whose import takes most of a short run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.models.numba_compile import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["first_order_lag"]


@kernel
def _filter(x, new, keep, y):
    for row in range(x.shape[0]):
        state = y[row, 0]
        for k in range(x.shape[1]):
            state = keep * state + new * x[row, k]
            y[row, k] = state


def first_order_lag(
    x: NDArray[np.float64], keep: float, new: float | None = None, start: NDArray[np.float64] | float = 0.0
) -> NDArray[np.float64]:
    """Return the signal y(k) = keep y(k-1) + new x(k).

    `x`: one signal, or one in each row. `keep`: share of the last value that remains after a sample, exp(-dt / lag)
    [-]. `new`: weight of the new value [-]; by default 1 - keep, which gives unit gain. `start`, of shape (n_signals,):
    value before the first sample [unit of x]. Returns the signal behind the lag, of the shape of `x`.

    Examples
    --------
    >>> first_order_lag(np.array([1.0, 1.0, 1.0]), 0.5).tolist()
    [0.5, 0.75, 0.875]
    """
    rows = np.ascontiguousarray(np.atleast_2d(x), dtype=np.float64)
    y = np.empty_like(rows)
    if rows.size:
        y[:, 0] = start
        _filter(rows, 1.0 - keep if new is None else float(new), float(keep), y)
    return y.reshape(np.shape(x))
