"""What is missing of a record: samples without a value, and values far off all others."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.digits import number_of
from stiction.records.outliers import outlier_masks

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["missing", "without_outliers"]


def missing(record: LoopRecord) -> NDArray[np.bool_]:
    """Mark where OP or PV is missing, shape (n_samples,)."""
    gone = ~np.isfinite(record.op)
    return gone if record.pv is None else gone | ~np.isfinite(record.pv)


def without_outliers(record: LoopRecord) -> LoopRecord:
    """The record with what stands alone far off in OP, PV or the valve's position missing, and counted.

    Parameters
    ----------
    record : LoopRecord
        What was recorded.

    Returns
    -------
    LoopRecord
        The same one where there is none, or where they were taken out before: what is left would show others.
    """
    if record.provenance.outliers:
        return record
    signals = {name: getattr(record, name) for name in ("op", "pv", "sp", "mv")}
    marks = outlier_masks(signals, record.samples_per_value)
    count = int(sum(mark.sum() for mark in marks.values()))
    if not count:
        return record
    kept = {name: np.where(mark, np.nan, signals[name]) for name, mark in marks.items()}
    told = ", ".join(f"{name.upper()} {signals[name][mark][0]:.4g}" for name, mark in marks.items() if mark.any())
    guess = f"Missing: {number_of(count, 'value')} far off all others (such as {told})."
    origin = record.provenance
    origin = replace(origin, guesses=(*origin.guesses, guess), outliers=origin.outliers + count)
    return replace(record, **kept, provenance=origin)
