"""Steps of OP in manual: it goes from one constant level straight to the next, as in a step test."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.records.gaps import unchanged_mask
from stiction.records.runs import run_bounds, run_lengths

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["find_manual_steps"]


def find_manual_steps(
    op: NDArray[np.float64],
    *,
    min_samples: int = 12,
    max_transition: int = 1,
    max_short_share: float = 0.02,
    min_moving_share: float = 0.2,
    max_groups: int = 5,
) -> NDArray[np.bool_]:
    """Mark where OP steps between constant levels while it is almost never constant elsewhere.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output [any unit]; NaN is missing.
    min_samples : int
        Shortest constant level [samples].
    max_transition : int
        Most samples between two levels [samples]; a historian may draw a line there.
    max_short_share : float
        Share of the record that shorter constant runs must stay below [-].
    min_moving_share : float
        Share of the record in which OP must move at every sample [-].
    max_groups : int
        Most groups of steps [-]; a controller slower than the record makes more.

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True from the first to the last level of each group of steps.

    Examples
    --------
    >>> op = np.concatenate([50.0 + np.arange(40.0) % 3, np.repeat([51.0, 53.0, 47.0], 20)])
    >>> np.flatnonzero(find_manual_steps(op))[[0, -1]].tolist()
    [40, 99]
    """
    mask = np.zeros(op.size, dtype=bool)
    constant = run_bounds(unchanged_mask(op)) - (1, 0)
    lengths = run_lengths(constant)
    long = lengths >= min_samples
    is_habit = lengths[~long].sum() >= max_short_share * op.size
    if long.sum() < 2 or is_habit or op.size - lengths.sum() < min_moving_share * op.size:
        return mask
    groups: list[list[tuple[int, int]]] = []
    for first, last in constant[long].tolist():
        if groups and first - groups[-1][-1][1] <= max_transition:
            groups[-1].append((first, last))
        else:
            groups.append([(first, last)])
    extremes = {float(np.nanmin(op)), float(np.nanmax(op))}
    levels = [{float(op[first]) for first, _ in group} for group in groups]
    steps = [group for group, at in zip(groups, levels, strict=True) if len(at) > 1 and at - extremes]
    for group in steps if len(steps) <= max_groups else ():
        mask[group[0][0] : group[-1][1]] = True
    return mask
