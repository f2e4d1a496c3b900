"""Missing values: samples without OP or PV, and values that were repeated to fill an even time grid."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.display.duration_format import format_seconds
from stiction.records.check_result import RECORD_LONGER, CheckResult, check_maximum
from stiction.records.runs import run_bounds, run_lengths

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["check_missing_values", "check_resampled"]


def check_missing_values(
    missing: NDArray[np.bool_], filled: NDArray[np.bool_], dt: float, is_cut_too_short: bool
) -> CheckResult:
    """Missing samples of the record, the longest gap, and the samples filled in the usable segment; `dt` in s."""
    percent, filled_percent = (100.0 * float(np.mean(mask)) if mask.size else 0.0 for mask in (missing, filled))
    longest = int(run_lengths(run_bounds(missing)).max(initial=0)) * dt
    name, finding = "missing values", "every sample has OP and PV"
    if percent:
        finding = (
            f"{percent:.3g} % of the samples have no OP or no PV, the longest gap lasts {format_seconds(longest)}, "
            f"{filled.sum()} were filled with the last value"
        )
    if filled_percent > 40.0:
        remedy = "repair the connection to the historian and record again"
        return CheckResult(name, "reject", filled_percent, 40.0, "%", finding, remedy)
    if percent > 2 and is_cut_too_short:
        return CheckResult(name, "reject", percent, 2, "%", finding, RECORD_LONGER)
    return check_maximum(name, percent, "%", warn=2, finding=finding)


def check_resampled(held: int, samples: int, samples_per_cycle: float | None) -> CheckResult | None:
    """Values that the reader repeated to fill an even time grid, of so many samples [samples]."""
    if not held or samples < held:
        return None
    percent = 100.0 * held / samples
    finding = f"{percent:.3g} % of the samples repeat an earlier value to fill an even time grid"
    if samples_per_cycle is not None:
        points = (1.0 - percent / 100.0) * samples_per_cycle
        finding += f", and a cycle has {points:.1f} recorded values"
        if points < 4:
            remedy = "export at an even and faster rate"
            return CheckResult("resampled", "reject", points, 4, "values per cycle", finding, remedy)
    return check_maximum(
        "resampled", percent, "%", warn=25, reject=50, finding=finding, remedy="export at an even rate"
    )
