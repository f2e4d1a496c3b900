"""Scale of OP: whether it is in % of span."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.records.check_result import CheckResult

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["check_op_scale", "detect_op_scale"]


def detect_op_scale(low: float, high: float) -> str:
    """Say which unit an OP between two values may have.

    Parameters
    ----------
    low, high : float
        Smallest and largest OP [its unit].

    Returns
    -------
    str
        "percent", "fraction" (of span), "normalised" (mean removed), or "other".

    Examples
    --------
    >>> [detect_op_scale(*ends) for ends in ((20.0, 70.0), (0.2, 0.7), (-1.9, 2.2), (-52.0, -45.0))]
    ['percent', 'fraction', 'normalised', 'other']
    """
    if low >= 0.0 and high <= 1.0:
        return "fraction"
    if low < -10.0 or high > 110.0:
        return "other"
    return "normalised" if low < -0.5 and high <= 5.0 else "percent"


def check_op_scale(op: NDArray[np.float64], op_unit: str) -> CheckResult | None:
    """An OP that is not in % of span; `op_unit` is its unit by the header, empty when it is % or unknown."""
    op = op[np.isfinite(op)]
    if op.size == 0:
        return None
    low, high = float(op.min()), float(op.max())
    scale = "unit" if op_unit else detect_op_scale(low, high)
    value = high if abs(high) >= abs(low) else low
    between = f"OP lies between {low:.4g} and {high:.4g}"
    if scale == "percent":
        finding = f"{between} and is taken as % of span"
        return CheckResult("op scale", "ok", value, 100.0, "% of span", finding)
    unlike = {
        "unit": f" in {op_unit} (according to its header)", "fraction": ", like a fraction of span",
        "normalised": ", as if normalised", "other": ", unlike a percentage",
    }[scale]  # fmt: skip
    finding = f"{between}{unlike}: S and J are in its unit, not in % of span"
    remedy = "give op_range (--op-range) to convert it"
    return CheckResult("op scale", "warn", value, 100.0, "% of span", finding, remedy)
