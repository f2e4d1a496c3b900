"""The longest segment of a record that can be analysed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.records.gaps import (
    MAX_BRIDGED_GAP,
    MAX_BRIDGED_SHARE,
    MAX_FILLED_GAP,
    forward_fill,
    missing_mask,
)
from stiction.records.masks import RecordMasks
from stiction.records.quality.clock_jumps import find_discontinuities
from stiction.records.quality.saturation import find_shutdown
from stiction.records.runs import runs

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["analysis_window", "forward_fill_sp"]


def analysis_window(record: LoopRecord, masks: RecordMasks | None = None) -> tuple[int, int]:
    """Find the longest segment in automatic, OP not clipped or shut down, PV not frozen, no clock jump or long gap.

    Parameters
    ----------
    record : LoopRecord
        A record of one loop.
    masks : RecordMasks, optional
        Those of the record, when they are known.

    Returns
    -------
    first, last : int
        The samples ``first <= k < last``; equal when there is none.

    Notes
    -----
    The segment may contain gaps of up to 20 samples. If more than a fifth of it is missing, only gaps of up to 5
    samples, which are filled, are allowed.

    Examples
    --------
    >>> from stiction.records import LoopRecord, analysis_window
    >>> op = [50.0, 51.0, float("nan"), 52.0] + 30 * [float("nan")] + [50.0, 51.0]
    >>> analysis_window(LoopRecord("FIC-101", 1.0, op=op, pv=op))
    (0, 4)
    """
    op, pv, auto = record.op, record.pv, record.auto
    masks = masks or RecordMasks(record)
    missing = missing_mask(op, pv)
    blocked = masks.manual | masks.frozen | find_shutdown(op, auto)
    if not _swings_between_limits(op, masks.clipped):
        blocked |= masks.clipped
    if pv is not None:
        blocked |= find_discontinuities(op, pv, max_count=min(record.provenance.clock_jumps, 20))
    first, last = _longest_run(missing, blocked, MAX_BRIDGED_GAP)
    if missing[first:last].sum() > MAX_BRIDGED_SHARE * (last - first):
        return _longest_run(missing, blocked, MAX_FILLED_GAP)
    return first, last


def _swings_between_limits(
    op: NDArray[np.float64],
    clipped: NDArray[np.bool_],
    *,
    min_swing: float = 20.0,
    min_stays: int = 10,
    max_stay: float = 0.02,
    max_share: float = 0.9,
) -> bool:
    """Whether OP goes to limits far apart [% of span] again and again: these stays are part of the oscillation."""
    known = op[np.isfinite(op)]
    if known.size == 0 or float(np.ptp(known)) < min_swing:
        return False
    stays = np.array([last - first for first, last in runs(clipped)])
    return (
        stays.size >= min_stays and stays.max() <= max_stay * clipped.size and stays.sum() <= max_share * clipped.size
    )


def _longest_run(missing: NDArray[np.bool_], blocked: NDArray[np.bool_], max_gap: int) -> tuple[int, int]:
    """The longest run of samples that are not blocked, gaps of up to `max_gap` missing samples among them."""
    good = ~(missing | blocked)
    for first, last in runs(missing):
        inside = first > 0 and last < len(missing) and good[first - 1] and good[last]
        if inside and last - first <= max_gap and not blocked[first:last].any():
            good[first:last] = True
    return max(runs(good), key=lambda run: run[1] - run[0], default=(0, 0))


def forward_fill_sp(
    record: LoopRecord, first: int = 0, last: int | None = None
) -> tuple[NDArray[np.float64] | None, str]:
    """Hold the set point in its gaps, samples `first` to `last`; also the assumption made, if any.

    Before the first stored value it has that value; None when it is unknown in their first half.
    """
    if record.sp is None:
        return None, ""
    sp = forward_fill(record.sp)[first:last]
    unknown = int(np.count_nonzero(~np.isfinite(sp)))
    which = f"The set point of the first {unknown} of {sp.size} samples"
    if 2 * unknown > sp.size:
        return None, f"{which} is unknown, so the set point is not used."
    if not unknown:
        return sp, ""
    return forward_fill(sp, fill_start=True), f"{which} is assumed to be the first stored one."
