"""Frozen PV: the transmitter or its connection repeats one value while OP moves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.loop_state.arrays import LONG_REST, LONG_SHARE, find_rests
from stiction.records.quality.quantisation import count_values, peak_to_peak
from stiction.records.runs import run_lengths

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["find_pv_frozen"]


def find_pv_frozen(
    op: NDArray[np.float64],
    pv: NDArray[np.float64],
    *,
    min_samples: int = LONG_REST,
    min_share: float = LONG_SHARE,
    max_rests: int = 5,
    min_length_ratio: float = 4.0,
    min_values: int = 10,
    min_op_move: float = 0.1,
    max_usual: float = 0.05,
) -> NDArray[np.bool_]:
    """Mark the samples in which PV repeats one value although OP moves.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output [% of span]; NaN is missing.
    pv : ndarray, shape (n_samples,)
        Process variable [its unit]; NaN is missing.
    min_samples : int
        Shortest rest of PV that counts [samples].
    min_share : float
        Shortest rest that counts, as a share of the record [-]; the longer of the two holds.
    max_rests : int
        Largest number of long rests. More of them are a coarse resolution or a compressed record.
    min_length_ratio : float
        Length of the shortest long rest over that of the longest other one [-].
    min_values : int
        Smallest number of values that PV takes outside the long rests. With fewer its resolution is coarse.
    min_op_move : float
        Range of OP in a rest over its range in the record [-]. Where OP hardly moves, at a usual value of PV, the loop
        is at rest.
    max_usual : float
        Share of the other samples that have the value of a rest, above which that value is usual [-].

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True where PV is frozen.

    Notes
    -----
    A measured process variable carries noise and never repeats one value for long. A coarse transmitter and a historian
    that stores changes only also make rests, but many of them and of every length. A frozen PV makes one or a few, far
    longer than all others.

    Examples
    --------
    >>> import numpy as np
    >>> pv = np.random.default_rng(1).normal(150.0, 1.0, 300)
    >>> pv[200:] = pv[200]
    >>> int(find_pv_frozen(np.linspace(40.0, 60.0, 300), pv).sum())
    100
    """
    mask = np.zeros(pv.size, dtype=bool)
    rests = find_rests(pv)
    lengths = run_lengths(rests)
    long = lengths >= max(min_samples, int(min_share * pv.size))
    if not 1 <= long.sum() <= max_rests:
        return mask
    if not long.all() and min_length_ratio * lengths[~long].max() > lengths[long].min():
        return mask
    for first, last in rests[long].tolist():
        mask[first:last] |= peak_to_peak(op[first:last]) > 0.0
    elsewhere = pv[~mask & np.isfinite(pv)]
    if elsewhere.size > 2 * min_values and count_values(elsewhere, min_values) < min_values:
        return np.zeros(pv.size, dtype=bool)
    for first, last in rests[long].tolist():
        is_usual = elsewhere.size > 0 and np.mean(elsewhere == pv[first]) > max_usual
        if is_usual and peak_to_peak(op[first:last]) < min_op_move * peak_to_peak(op):
            mask[first:last] = False
    return mask
