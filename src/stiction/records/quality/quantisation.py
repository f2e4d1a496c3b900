"""Quantisation: the step to which a signal was rounded, and how many steps it covers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.records.check_result import CheckResult, check_minimum
from stiction.records.quantiles import quantiles

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "check_resolution",
    "count_levels",
    "count_values",
    "different_values",
    "is_coarse",
    "peak_to_peak",
    "quantisation_step",
    "robust_range",
]

ROUNDING = 1e-9
"""Share of a signal's range below which a difference is rounding of the arithmetic [-]."""


def peak_to_peak(x: NDArray[np.float64]) -> float:
    """Largest minus smallest value [unit of `x`]; 0 when there is none."""
    x = x[np.isfinite(x)]
    return float(x.max() - x.min()) if x.size else 0.0


def robust_range(x: NDArray[np.float64]) -> float:
    """Range between the 1 % and the 99 % quantile [unit of `x`], which a few spikes do not widen."""
    low, high = quantiles(x, 0.01, 0.99)
    return high - low


def quantisation_step(
    x: NDArray[np.float64],
    values: NDArray[np.float64] | None = None,
    *,
    tolerance: float = 0.02,
    min_share: float = 0.98,
) -> float:
    """Find the step of which all differences of a signal are multiples.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        A signal [any unit]; NaN is missing.
    values : ndarray, shape (n_values,), optional
        Its different values in ascending order [unit of `x`], when they are known.
    tolerance : float
        Largest distance of a difference from a multiple [steps].
    min_share : float
        Share of the differences that must be multiples [-].

    Returns
    -------
    float
        The step [unit of `x`]; 0 when there is none. A straight line has none: it visits each level once.

    Examples
    --------
    >>> quantisation_step(np.array([57.0, 57.3, 58.8, 57.6, 60.0]))
    0.3
    >>> quantisation_step(np.array([0.0, 1.0, 2.617, 3.141]))
    0.0
    """
    gaps = np.diff(different_values(x) if values is None else values)
    gaps = gaps[gaps > ROUNDING * gaps.sum()] if gaps.size else gaps
    if gaps.size == 0:
        return 0.0
    smallest = float(gaps.min())
    few = gaps[:: gaps.size // 1000 + 1]
    for divisor in (1, 2, 3):
        if np.mean(_from_whole(few * (divisor / smallest)) < tolerance) < 0.5 * min_share:
            continue
        multiples = gaps * (divisor / smallest)
        whole = np.round(multiples)
        if np.mean(_from_whole(multiples) < tolerance) >= min_share:
            is_line = gaps.size > 0.95 * np.isfinite(x).sum() > 9.0 and np.mean(whole == 1.0) > 0.95
            return 0.0 if is_line else float(f"{gaps.sum() / whole.sum():.9g}")
    return 0.0


def different_values(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Different values of a signal in ascending order, NaN left out [unit of `x`], shape (n_values,)."""
    return np.unique(x[np.isfinite(x)])


def _from_whole(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance from the next whole number [-]."""
    return np.abs(x - np.round(x))


def count_levels(
    x: NDArray[np.float64],
    step: float | None = None,
    values: NDArray[np.float64] | None = None,
    swing: float | None = None,
) -> float:
    """Count the quantisation levels that a signal covers.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        A signal without NaN [any unit].
    step : float, optional
        Its quantisation step [unit of `x`], when it is known.
    values : ndarray, shape (n_values,), optional
        Its different values in ascending order [unit of `x`], when they are known.
    swing : float, optional
        Its robust range [unit of `x`], when it is known.

    Returns
    -------
    float
        Levels within the robust range [-]; the number of values when most samples have one of their own, NaN when
        there is only one value.

    Examples
    --------
    >>> count_levels(np.tile([0.0, 0.5, 1.0, 1.5, 2.0], 40))
    5.0
    """
    values = np.unique(x) if values is None else values
    if len(values) < 2:
        return float("nan")
    if len(values) > 0.5 * len(x):
        return float(len(values))
    width = (robust_range(x) if swing is None else swing) or peak_to_peak(x)
    step = quantisation_step(x, values) if step is None else step
    if not step:
        gaps = np.diff(values)
        step = float(np.percentile(gaps[gaps > ROUNDING * width], 5))
    return round(width / step + 1.0, 6)  # a conversion of units must not decide at a limit


def count_values(x: NDArray[np.float64], most: int) -> int:
    """Count the different values of a signal, at most so many: a few samples show that there are more."""
    few = x[:: x.size // (4 * most) + 1]
    return most if np.unique(few).size >= most else min(np.unique(x).size, most)


def is_coarse(x: NDArray[np.float64], *, max_values: int = 50) -> bool:
    """Whether a signal returns to the same few values again and again.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        A signal without NaN [any unit].
    max_values : int
        Most values of a coarse signal [-]; it changes more than twice as often.

    Returns
    -------
    bool
        True for a coarse signal, False for one that is only held.

    Examples
    --------
    >>> x = np.random.default_rng(1).normal(size=400)
    >>> is_coarse(np.round(x)), is_coarse(x), is_coarse(np.repeat(x[::20], 20))
    (True, False, False)
    """
    values = count_values(x, max_values + 1)
    return values <= max_values and 2 * values < int(np.count_nonzero(np.diff(x)))


def check_resolution(
    signal: str, x: NDArray[np.float64], step: float, values: NDArray[np.float64], swing: float
) -> CheckResult | None:
    """Quantisation steps that OP or PV covers: few steps of PV look like stick and slip."""
    levels = count_levels(x, step, values, swing)
    if np.isnan(levels):
        return None
    return check_minimum(
        f"{signal.lower()} resolution", levels, "steps", warn=20, reject=6 if signal == "OP" else 3,
        finding=f"{signal} covers {levels:.0f} quantisation steps", remedy="record without rounding",
    )  # fmt: skip
