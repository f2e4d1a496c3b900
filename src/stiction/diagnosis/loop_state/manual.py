"""Manual: OP is set by a person, so it says nothing about the controller and the valve is hardly exercised."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.loop_state.arrays import LONG_REST, LONG_SHARE, OP_LIMITS, find_rests
from stiction.records.quality.quantisation import peak_to_peak
from stiction.records.runs import run_lengths

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["find_manual"]


def find_manual(
    op: NDArray[np.float64],
    pv: NDArray[np.float64],
    auto: NDArray[np.bool_] | None = None,
    *,
    limits: tuple[float, float] = OP_LIMITS,
    min_rest: int = LONG_REST,
    min_rest_share: float = LONG_SHARE,
    min_pv_move: float = 0.05,
    min_length_spread: float = 0.25,
    min_hidden_steps: float = 3.0,
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
    min_hidden_steps : float
        Moves of OP that PV would cause in a rest, by the ratio of their ranges in the rest of the record, over the
        resolution of OP [-]. Below it the rounding of OP explains the rest.

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True where the mode says so or, without a mode, where OP rests at one value while PV moves.

    Notes
    -----
    A controller with integral action moves its output whenever PV is off SP. OP that keeps one value for many samples
    while PV moves by more than the rounding of OP hides is therefore not computed by the controller. Rests of equal
    length are the update interval of a slow controller, such as that of an analyser, and no manual operation.

    Examples
    --------
    >>> import numpy as np
    >>> op, pv = np.full(200, 40.0), np.sin(np.arange(200) / 9.0)
    >>> op[:80] -= pv[:80]
    >>> int(find_manual(op, pv).sum())
    120
    """
    if auto is not None:
        return ~auto
    mask = np.zeros(op.size, dtype=bool)
    shortest = max(min_rest, int(min_rest_share * op.size))
    rests = find_rests(op)
    rests = rests[run_lengths(rests) >= shortest]
    long = rests[(limits[0] < op[rests[:, 0]]) & (op[rests[:, 0]] < limits[1])].tolist()
    lengths = run_lengths(long)
    if lengths.size >= 6 and lengths.std() < min_length_spread * lengths.mean():
        return mask
    elsewhere = np.ones(op.size, dtype=bool)
    for first, last in long:
        elsewhere[first:last] = False
    ratio, step = peak_to_peak(op[elsewhere]) / max(peak_to_peak(pv[elsewhere]), 1e-300), _resolution(op)
    for first, last in long:
        inside = pv[first:last][np.isfinite(pv[first:last])]
        moves = np.unique(inside).size > 2 and peak_to_peak(inside) > min_pv_move * peak_to_peak(pv)
        mask[first:last] = moves and (elsewhere.mean() < 0.02 or ratio * peak_to_peak(inside) > min_hidden_steps * step)
    return mask


def _resolution(op: NDArray[np.float64]) -> float:
    """Smallest move of OP between two samples [% of span], 0 when it never moves."""
    moves = np.abs(np.diff(op[np.isfinite(op)]))
    return float(moves[moves > 1e-9].min()) if np.any(moves > 1e-9) else 0.0
