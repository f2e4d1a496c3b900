"""Samples: how many a record and a cycle have, and whether a sample resembles the one before."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.display.duration_format import format_seconds
from stiction.records.check_result import MIN_CYCLES, MIN_SAMPLES, CheckResult, check_maximum, check_minimum

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["check_averages", "check_cycles", "check_length", "check_sampling", "last_value_correlation"]


def last_value_correlation(x: NDArray[np.float64]) -> float:
    """Correlation of a signal with its last value.

    Parameters
    ----------
    x : ndarray, shape (n_samples,)
        A signal without NaN [any unit].

    Returns
    -------
    float
        The correlation, by von Neumann's ratio [-]: 0 for white noise, 1 for a constant, cos(2 pi / n) for a sine of
        n samples per cycle.

    Examples
    --------
    >>> round(last_value_correlation(np.sin(np.arange(6000) * np.pi / 3)), 2)
    0.5
    """
    variance = float(np.var(x))
    return 1.0 - float(np.mean(np.diff(x) ** 2)) / (2.0 * variance) if variance > 0.0 else 1.0


def check_length(usable: int, samples: int) -> CheckResult:
    """Samples of the longest usable segment, and of the record [samples]."""
    finding = (
        "the longest segment without manual control, a clipped OP, a frozen PV, a clock jump or a gap has "
        f"{usable} of {samples} samples"
    )
    return check_minimum(
        "length", usable, "samples", warn=300, reject=MIN_SAMPLES, finding=finding,
        remedy="record some hundreds of samples",
    )  # fmt: skip


def check_cycles(duration: float, period: float) -> CheckResult:
    """Cycles of the oscillation in the usable segment: its length and the period [s]."""
    count = duration / period
    return check_minimum(
        "cycles", count, "-", warn=8, reject=MIN_CYCLES, remedy="record ten cycles or more",
        finding=f"the usable segment contains {count:.1f} cycles of {format_seconds(period)}",
    )  # fmt: skip


def check_averages(spread: float) -> CheckResult | None:
    """Movement within the intervals of averages over their range [-]: half for a sine of four averages a cycle."""
    if not spread:
        return None
    return check_maximum(
        "averages", spread, "-", warn=0.5, remedy="export raw values",
        finding=f"within the interval of an average the signal moves by {spread:.2g} times the range of the averages",
    )  # fmt: skip


def check_sampling(
    op: NDArray[np.float64], pv: NDArray[np.float64], dt: float, period: float | None
) -> CheckResult | None:
    """Samples per cycle; without a known cycle [s], the resemblance of a sample to the one before."""
    if period is not None:
        count, is_short = period / dt, len(op) < 200
        reject = 6 if is_short else 4
        finding = f"a cycle has {count:.1f} samples" + (" in a short record" if is_short and count < reject else "")
        return check_minimum(
            "sampling", count, "samples per cycle", warn=12, reject=reject, finding=finding,
            remedy=f"record every {period / 40:.2g} s or faster",
        )  # fmt: skip
    if not pv.size or len(op) < MIN_SAMPLES:
        return None
    memory = max(last_value_correlation(op), last_value_correlation(pv))
    if memory >= 0.1:
        return None
    if memory < -0.6:  # a cycle of three samples has cos(2 pi / 3) = -0.5
        remedy = "record ten times as fast"
        finding = (
            f"OP and PV alternate (correlation with the last sample {memory:.2f}): a cycle takes less than "
            f"{format_seconds(3 * dt)}"
        )
    else:
        remedy = "record faster"
        finding = (
            f"OP and PV are almost uncorrelated with their last samples (correlation {memory:.2f}): the record "
            f"contains only noise, or cycles shorter than {format_seconds(4 * dt)}"
        )
    return check_minimum("sampling", memory, "-", warn=0.1, reject=-0.6, finding=finding, remedy=remedy)
