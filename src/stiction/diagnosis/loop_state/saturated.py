"""Saturation: OP rests at one of its limits, so the controller does not move the valve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.loop_state.arrays import OP_LIMITS, keep_long_runs
from stiction.errors import ParameterError

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["find_saturated"]


def find_saturated(
    op: NDArray[np.float64],
    *,
    limits: tuple[float, float] = OP_LIMITS,
    tolerance: float = 0.1,
    min_samples: int = 10,
    min_visits: int = 3,
) -> NDArray[np.bool_]:
    """Mark the samples in which OP rests at a limit.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output [% of span]; NaN is missing.
    limits : (float, float)
        Output limits [% of span].
    tolerance : float
        Largest distance from a limit that counts as "at the limit" [% of span].
    min_samples : int
        Shortest stay that counts [samples].
    min_visits : int
        Stays at the largest or the smallest value of OP from which that value is a configured output limit [-].

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True where OP rests at 0 or 100 %, or at an output limit of its own.

    Raises
    ------
    ParameterError
        When the lower limit is not below the upper one, or `min_samples` is below 1.

    Notes
    -----
    At a limit the valve does not follow the controller: these samples say nothing about friction. A plant often sets
    narrower limits than 0 and 100 %. OP then comes back to exactly the same extreme value several times.

    Examples
    --------
    >>> import numpy as np
    >>> op = np.concatenate([np.linspace(90.0, 100.0, 5), np.full(12, 100.0)])
    >>> int(find_saturated(op).sum())
    13
    """
    low, high = limits
    if not low < high:
        raise ParameterError(f"limits = ({low:g}, {high:g}) % is an empty range; give lowest < highest.")
    if min_samples < 1:
        raise ParameterError(f"min_samples = {min_samples} is below 1; give 1 or more.")
    mask = keep_long_runs((op <= low + tolerance) | (op >= high - tolerance), min_samples)
    if not np.isfinite(op).any():
        return mask
    for extreme in (np.nanmin(op), np.nanmax(op)):
        stays = keep_long_runs(op == extreme, min_samples)
        if np.count_nonzero(np.diff(stays.astype(np.int8), prepend=0) == 1) >= min_visits:
            mask |= stays
    return mask
