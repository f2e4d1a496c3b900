"""Outliers: values far from all others, such as a historian's code for a bad value or a lost digit."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.number_format import count_noun
from stiction.records.check_result import CheckResult, check_maximum
from stiction.records.quantiles import quantiles
from stiction.records.runs import runs

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

__all__ = ["OP_DISTANCE_LIMIT", "check_outliers", "find_outliers", "find_record_outliers"]

OP_DISTANCE_LIMIT, OTHER_DISTANCE_LIMIT = 1.0, 5.0
"""Distance of an outlier of OP, and of PV or valve position, see `find_outliers` [widths]; single-sample
spikes of PV that are nearer are a fault of the transmitter, and stay."""
USUAL_OP_LIMITS = (0.0, 1.0, 100.0)
"""Values that OP takes by itself, as a fraction or in %: a code only beyond `OTHER_DISTANCE_LIMIT`."""


def find_outliers(
    x: NDArray[np.float64],
    *,
    min_distance: float = OP_DISTANCE_LIMIT,
    samples_per_value: int = 1,
    max_samples: int = 2,
    max_samples_constant: int = 30,
    max_share: float = 0.02,
    min_end_distance: float = 20.0,
) -> NDArray[np.bool_]:
    """Mark values that stand alone far from all others.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        A signal [any unit]; NaN is missing.
    min_distance : float
        Distance from the others [widths between their 2.5 % and 97.5 % quantiles].
    samples_per_value : int
        Samples for which a stored value is held [samples].
    max_samples : int
        Longest run of outliers [stored values]; a longer one is an upset.
    max_samples_constant : int
        Longest run of one constant value that is at least five widths away [stored values].
    max_share : float
        Share of the record above which such values are normal for the loop [-].
    min_end_distance : float
        Distance at an end of the record or beside a gap, where one step cannot be seen [widths].

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True at an outlier.

    Examples
    --------
    >>> x = np.sin(np.arange(900.0))
    >>> x[[40, 200, 201, 202]] = 9.0
    >>> np.flatnonzero(find_outliers(x)).tolist()
    [40]
    """
    limits = (samples_per_value, max_samples, max_samples_constant, min_end_distance)
    codes, usual = _find_codes(x, min_distance, limits)
    alone = _find_alone(np.where(codes, np.nan, x), min_distance, limits, usual)
    return codes | alone if alone.sum() <= max(max_share * np.isfinite(x).sum(), samples_per_value) else codes


def find_record_outliers(
    signals: Mapping[str, NDArray[np.float64]], sp: NDArray[np.float64] | None = None, *, samples_per_value: int = 1
) -> dict[str, NDArray[np.bool_]]:
    """Mark outliers of `op`, `pv`, `mv`, shape (n_samples,); none of OP beside a step of SP or a spike of PV."""
    masks = {
        name: find_outliers(
            x,
            min_distance=OP_DISTANCE_LIMIT if name == "op" else OTHER_DISTANCE_LIMIT,
            samples_per_value=samples_per_value,
        )
        for name, x in signals.items()
    }
    if masks["op"].any():
        causes = np.zeros(masks["op"].size, dtype=bool)
        if sp is not None:
            moved = np.abs(np.diff(sp)) > 0.0
            causes[1:] = moved & (moved.mean() <= 0.02)  # a set point that moves all the time explains no kick
        if "pv" in signals:
            causes |= find_outliers(signals["pv"], samples_per_value=samples_per_value) & ~masks["pv"]
        masks["op"] &= ~(np.convolve(causes, np.ones(5), "same") > 0.0)
    return masks


def check_outliers(pv: NDArray[np.float64] | None, removed: int, samples_per_value: int) -> CheckResult | None:
    """Distant outliers that were removed [samples], and single-sample PV spikes that were not."""
    spikes = 0 if pv is None else int(find_outliers(pv, samples_per_value=samples_per_value).sum())
    if not removed + spikes:
        return None
    finding = (
        f"{count_noun(removed, 'value')} far from all others were removed; {count_noun(spikes, 'spike')} of PV were "
        "not removed"
    )
    remedy = "check how the historian writes bad values"
    return check_maximum("outliers", removed + spikes, "-", warn=0, finding=finding, remedy=remedy)


def _find_codes(
    x: NDArray[np.float64], distance: float, limits: tuple[int, int, int, float]
) -> tuple[NDArray[np.bool_], tuple[float, float]]:
    """Mark an extreme value that comes again, mostly alone: a bad value; also give the range of the others."""
    codes = np.zeros(x.size, dtype=bool)
    if not x.size:
        return codes, (0.0, 0.0)
    extremes = {value: x == value for value in (np.fmin.reduce(x), np.fmax.reduce(x))}
    often = {value: same for value, same in extremes.items() if 5 <= same.sum() <= 0.4 * x.size}
    if not often:
        return codes, _usual_range(x)
    usual = _usual_range(np.where(np.logical_or.reduce([codes, *often.values()]), np.nan, x))
    for value, same in often.items():
        needed = max(distance, OTHER_DISTANCE_LIMIT) if value in USUAL_OP_LIMITS else distance
        if int((same & _find_alone(x, needed, limits, usual)).sum()) >= max(5, 0.4 * same.sum()):
            codes |= same
    return codes, _usual_range(np.where(codes, np.nan, x))


def _usual_range(x: NDArray[np.float64]) -> tuple[float, float]:
    """Range of all values but a fortieth at both ends [unit of `x`]."""
    low, high = quantiles(x, 0.025, 0.975)
    return (0.0, 0.0) if math.isnan(low) else (low, high)


def _find_alone(
    x: NDArray[np.float64],
    distance: float,
    limits: tuple[int, int, int, float],
    usual: tuple[float, float],
) -> NDArray[np.bool_]:
    """Mark short runs far from the usual range that are reached and left in one step."""
    mask = np.zeros(x.size, dtype=bool)
    samples_per_value, max_samples, max_constant, end_distance = limits
    low, high = usual
    width, middle = high - low, 0.5 * (low + high)
    if not width > 0.0:
        return mask
    for first, last in runs((x < low - distance * width) | (x > high + distance * width)):
        farthest = np.abs(x[first:last] - middle).max()
        at_end = farthest if farthest > end_distance * width else 0.0
        before = abs(x[first] - x[first - 1]) if first and np.isfinite(x[first - 1]) else at_end
        after = abs(x[last - 1] - x[last]) if last < x.size and np.isfinite(x[last]) else at_end
        values, samples = 1 + np.count_nonzero(np.diff(x[first:last])), last - first
        in_one_step = min(before, after) >= 0.75 * farthest
        is_short = values <= max_samples and samples <= max_samples * samples_per_value
        is_far = values == 1 and farthest > OTHER_DISTANCE_LIMIT * width
        mask[first:last] = in_one_step and (is_short or (is_far and samples <= max_constant * samples_per_value))
    return mask
