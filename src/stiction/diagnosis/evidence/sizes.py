"""Pool S and J of several windows: random-effects meta-analysis."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["PooledSize", "pool_estimates"]

NORMAL_95 = 1.959964
"""Quantile of the standard normal distribution at 0.975 [-]."""


class PooledSize(NamedTuple):
    """A pooled estimate with its 95 % interval."""

    value: float
    """The estimate."""
    low: float
    """Lower end of the interval."""
    high: float
    """Upper end of the interval."""


def pool_estimates(
    values: NDArray[np.float64],
    errors: NDArray[np.float64],
    relevance: NDArray[np.float64],
    *,
    shared_error: float,
    scale: float,
) -> PooledSize:
    r"""Pool estimates of one quantity by the random-effects model of DerSimonian and Laird (1986).

    .. math:: \hat\mu = \frac{\sum w_i y_i}{\sum w_i}, \quad w_i = \frac{r_i}{s_i^2 + \tau^2}

    Parameters
    ----------
    values : ndarray, shape (n_windows,)
        Estimates y of the windows.
    errors : ndarray, shape (n_windows,)
        Their standard errors s, same unit.
    relevance : ndarray, shape (n_windows,)
        Share r of its weight that a window keeps [-].
    shared_error : float
        Standard error that all windows have in common, same unit: more windows do not make it smaller.
    scale : float
        Factor of the standard error of the rest [-].

    Returns
    -------
    PooledSize
        Estimate and interval, in the unit of the values.

    References
    ----------
    dersimonian1986

    Examples
    --------
    >>> y, s, r = np.array([1.0, 1.2, 1.1]), np.full(3, 0.1), np.ones(3)
    >>> pooled = pool_estimates(y, s, r, shared_error=0.0, scale=1.0)
    >>> round(pooled.value, 6), round(pooled.high - pooled.value, 3)
    (1.1, 0.113)
    """
    fixed = relevance / errors**2
    mean, spread = float(fixed @ values) / fixed.sum(), 0.0
    if values.size > 1:
        surplus = float(fixed @ (values - mean) ** 2) - (values.size - 1)
        spread = max(surplus / float(fixed.sum() - (fixed**2).sum() / fixed.sum()), 0.0)
    weights = relevance / (errors**2 + spread)
    pooled = float(weights @ values) / weights.sum()
    error = float(np.hypot(shared_error, scale * np.sqrt(1.0 / weights.sum())))
    return PooledSize(*(float(x) for x in (pooled, pooled - NORMAL_95 * error, pooled + NORMAL_95 * error)))
