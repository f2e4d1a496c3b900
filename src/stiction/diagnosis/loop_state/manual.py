"""Manual: OP is set by a person, so it says nothing about the controller and the valve is hardly exercised."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.loop_state.arrays import find_rests

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["find_manual"]


def find_manual(
    op: NDArray[np.float64],
    pv: NDArray[np.float64],
    auto: NDArray[np.bool_] | None = None,
    *,
    limits: tuple[float, float] = (0.0, 100.0),
    min_rest: int = 60,
    min_rest_share: float = 0.05,
    min_pv_move: float = 0.05,
    min_length_spread: float = 0.25,
) -> NDArray[np.bool_]:
    """Mark the samples in which a person sets OP.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output [% of span]; NaN is missing.
    pv : ndarray, shape (n_samples,)
        Process variable [its unit].
    auto : ndarray of bool, shape (n_samples,), optional
        True where the recorded mode is automatic. It decides alone when it is given.
    limits : (float, float)
        Output limits [% of span]. A rest at a limit is saturation.
    min_rest : int
        Shortest rest of OP that counts [samples].
    min_rest_share : float
        Shortest rest of OP that counts, as a share of the record [-]; the longer of the two holds.
    min_pv_move : float
        Range of PV in a rest, over its range in the record, from which PV moves [-].
    min_length_spread : float
        Standard deviation of the lengths of six or more rests, over their mean, below which OP is updated at a fixed
        interval [-].

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True where the mode says so or, without a mode, where OP rests at one value while PV moves.

    Notes
    -----
    A controller with integral action moves its output whenever PV is off SP. OP that keeps one value for many samples
    while PV moves is therefore not computed by the controller. Rests of equal length are the update interval of a slow
    controller, such as that of an analyser, and no manual operation.

    Examples
    --------
    >>> import numpy as np
    >>> op, pv = np.full(200, 40.0), np.sin(np.arange(200) / 9.0)
    >>> op[:80] += pv[:80]
    >>> int(find_manual(op, pv).sum())
    120
    """
    if auto is not None:
        return ~auto
    mask = np.zeros(op.size, dtype=bool)
    shortest = max(min_rest, int(min_rest_share * op.size))
    rests = [(first, last) for first, last in find_rests(op) if last - first >= shortest]
    long = [(first, last) for first, last in rests if limits[0] < op[first] < limits[1]]
    lengths = np.array([last - first for first, last in long])
    if lengths.size >= 6 and lengths.std() < min_length_spread * lengths.mean():
        return mask
    swing = np.nanmax(pv) - np.nanmin(pv) if np.isfinite(pv).any() else 0.0
    for first, last in long:
        inside = pv[first:last][np.isfinite(pv[first:last])]
        mask[first:last] = np.unique(inside).size > 2 and np.ptp(inside) > min_pv_move * swing
    return mask
