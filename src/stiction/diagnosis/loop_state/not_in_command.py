"""Not in command: another controller moves the valve, and the output of this one is wound up."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.loop_state.arrays import block_means
from stiction.diagnosis.loop_state.wind_up import MIN_ONE_SIDED, WindUp, find_wind_up, smooth_error
from stiction.records.gaps import interpolate_gaps

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["find_not_in_command"]


def find_not_in_command(
    op: NDArray[np.float64],
    pv: NDArray[np.float64],
    sp: NDArray[np.float64],
    *,
    at_limit: NDArray[np.bool_] | None = None,
    needs_integral: bool = False,
    min_one_sided: float = MIN_ONE_SIDED,
    min_error_ratio: float = 1.5,
    min_at_limit: float = 0.5,
    min_proportional: float = 0.95,
) -> WindUp | None:
    """Find the part of a record in which another controller moves the valve.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output [% of span]; NaN is missing.
    pv, sp : ndarray, shape (n_samples,)
        Process variable and set point [unit of PV].
    at_limit : ndarray of bool, shape (n_samples,), optional
        True where OP rests at a limit.
    needs_integral : bool
        Whether a controller of this kind always has integral action, as that of a flow.
    min_one_sided : float
        Share of the record in which PV stays on one side of SP [-].
    min_error_ratio : float
        Mean error over the standard deviation of the smoothed error [-].
    min_at_limit : float
        Share of the record in which OP rests at a limit [-].
    min_proportional : float
        Share of the variance of OP that proportional action alone explains [-].

    Returns
    -------
    WindUp or None
        The part; None when the controller is in command, as far as the record shows.

    Notes
    -----
    An override or a selector gives the valve to another controller. Integral action of the one selected out then has
    no effect on its error: OP runs to a limit and stays, or an anti-windup scheme leaves proportional action only. PV
    is controlled about another value than SP: it stays on one side of it, or oscillates with the loop in command.
    Offset is normal for a controller without integral action, as on many levels; so an offset at an OP between the
    limits counts only where integral action is the rule.

    Examples
    --------
    >>> import numpy as np
    >>> pv = 150.0 + 10.0 * np.sin(np.arange(900) / 9.0)
    >>> op = np.minimum(60.0 + 0.02 * np.cumsum(156.0 - pv), 100.0)
    >>> find_not_in_command(op, pv, np.full(900, 156.0)).op_end > 99.0
    True
    """
    found = find_wind_up(op, pv, sp)
    if found is not None:
        return found if math.isfinite(found.period) else None
    op, error = interpolate_gaps(op), smooth_error(pv, sp)
    if op.size < 60 or not np.isfinite([op, error]).all():
        return None
    mean = float(error.mean())
    one_sided = np.mean(math.copysign(1.0, mean) * error > 0.0) >= min_one_sided
    if not one_sided or abs(mean) < min_error_ratio * error.std():
        return None
    wound_up = at_limit is not None and at_limit.mean() >= min_at_limit
    raw = interpolate_gaps(sp) - interpolate_gaps(pv)
    if not wound_up and not (needs_integral and _is_proportional(op, raw, min_proportional)):
        return None
    ends = block_means(op, 20)
    return WindUp(0, op.size, op.size - 1, float(ends[0]), float(ends[-1]), mean, math.nan)


def _is_proportional(op: NDArray[np.float64], error: NDArray[np.float64], min_share: float) -> bool:
    """Whether OP follows the error without integral action."""
    if not (np.ptp(op) > 0.0 and np.ptp(error) > 0.0):
        return False
    return float(np.corrcoef(op, error)[0, 1]) ** 2 >= min_share
