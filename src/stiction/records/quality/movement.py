"""Movement: whether OP and PV move, and how often OP reverses."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.number_format import count_noun
from stiction.records.check_result import MIN_CYCLES, CheckResult, check_minimum
from stiction.records.quality.quantisation import peak_to_peak

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["check_op_movement", "check_op_reversals", "check_pv_movement", "count_reversals"]


def count_reversals(x: NDArray[np.float64], min_move: float = 0.0) -> int:
    """Count how often a signal reverses its direction.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        A signal without NaN [any unit].
    min_move : float
        Moves up to this, before or after a reversal, do not count [unit of `x`].

    Returns
    -------
    int
        Reversals [-].

    Examples
    --------
    >>> x = np.array([0.0, 5.0, 10.0, 9.9, 10.0, 4.0, 0.0, 8.0])
    >>> count_reversals(x), count_reversals(x, 1.5)
    (4, 2)
    """
    directions = np.sign(np.diff(x))
    directions = directions[moving := directions != 0.0]
    if not directions.size:
        return 0
    turns = directions[1:] != directions[:-1]
    if min_move == 0.0:
        return int(np.count_nonzero(turns))
    turning = x[:-1][moving][np.append(True, turns)]
    values = iter([*turning.tolist(), float(x[-1])])
    count, rises, low = 0, None, math.inf
    high = farthest = -math.inf
    for value in values:
        low, high = min(low, value), max(high, value)
        if high - low > min_move:
            rises, farthest = value == high, value
            break
    for value in values:
        if rises:
            if value > farthest:
                farthest = value
            elif farthest - value > min_move:
                count, rises, farthest = count + 1, False, value
        elif value < farthest:
            farthest = value
        elif value - farthest > min_move:
            count, rises, farthest = count + 1, True, value
    return count


def check_op_movement(op: NDArray[np.float64]) -> CheckResult:
    """A constant OP says nothing about the valve."""
    finding = "OP is constant: the loop is in manual, or OP was not recorded"
    return _check_movement("op", peak_to_peak(op), finding, "put the controller in automatic and record again")


def check_pv_movement(
    op: NDArray[np.float64], pv: NDArray[np.float64] | None, usable_pv: NDArray[np.float64] | None
) -> CheckResult:
    """PV must be recorded, move in the usable segment, and be another signal than OP."""
    if pv is None:
        return _check_movement("pv", 0.0, "PV was not recorded", "record PV together with OP")
    if np.array_equal(pv, op, equal_nan=True) and peak_to_peak(op) > 0.0:
        finding = "PV and OP are the same numbers: one column was exported or assigned twice"
        return _check_movement("pv", 0.0, finding, "give the name of the PV column")
    finding = "PV is constant: the transmitter is frozen, or the column is wrong"
    remedy = "repair the transmitter, or name the right column, and record again"
    return _check_movement("pv", peak_to_peak(pv if usable_pv is None else usable_pv), finding, remedy)


def _check_movement(name: str, moved: float, finding: str, remedy: str) -> CheckResult:
    """Reject a signal that does not move."""
    unit, result = "% of span" if name == "op" else "PV units", f"{name} movement"
    if moved > 0.0:
        return CheckResult(result, "ok", moved, 0.0, unit, finding=f"{name.upper()} moves by {moved:.3g}")
    return CheckResult(result, "reject", moved, 0.0, unit, finding, remedy)


def check_op_reversals(op: NDArray[np.float64], swing: float, *, min_share: float = 0.15) -> CheckResult | None:
    """Reversals of OP by `min_share` of its robust range `swing` [-] and more: friction shows nowhere else."""
    if not peak_to_peak(op) > 0.0:
        return None
    count = count_reversals(op, min_share * swing)
    return check_minimum(
        "op reversals", count, "-", warn=2 * MIN_CYCLES, remedy="record a period with more OP movement",
        finding=f"OP reverses {count_noun(count, 'time')}; friction shows only at reversals",
    )  # fmt: skip
