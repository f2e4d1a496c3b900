"""A record made ready for analysis, once: outliers masked, the part to analyse chosen, gaps filled."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.analysis_window import analysis_window, forward_fill_sp
from stiction.records.gaps import fill_short_gaps, interpolate_gaps, missing_mask
from stiction.records.masks import RecordMasks
from stiction.records.quality.quantisation import different_values, peak_to_peak, quantisation_step, robust_range
from stiction.records.record import mask_outliers

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["Conditioned", "condition"]


@dataclass(frozen=True, eq=False)
class Conditioned:
    """The part of one record that is analysed, as all stages take it, and what the data checks look at."""

    record: LoopRecord
    """The record, outliers missing."""
    masks: RecordMasks
    """Where OP of the record is at a limit or moved in manual, and where PV is frozen."""
    first: int
    """First sample of the part that is analysed."""
    last: int
    """One past its last sample."""
    part: LoopRecord
    """That part, gaps of OP and PV interpolated, and those of the set point filled with its last value. The valve
    position is as recorded."""
    missing: NDArray[np.bool_]
    """Whether OP or PV of a sample of the part was not recorded."""
    gaps: NDArray[np.bool_]
    """Whether that sample stands in a gap too long to fill with the last value."""
    op_values: NDArray[np.float64]
    """Different values of OP in the part, in ascending order [% of span]."""
    pv_values: NDArray[np.float64]
    """Different values of PV in the part, in ascending order [engineering units]."""
    op_swing: float
    """98 % range of OP [% of span]."""
    pv_swing: float
    """98 % range of PV [engineering units]."""
    op_step: float
    """Quantisation step of OP [% of span]; 0 when there is none."""
    pv_step: float
    """Quantisation step of PV [engineering units]; 0 when there is none."""

    @property
    def op(self) -> NDArray[np.float64]:
        """OP of the part [% of span]; empty when OP or PV is unknown in all of it."""
        return self.part.op if self._known else np.empty(0)

    @property
    def pv(self) -> NDArray[np.float64]:
        """PV of the part [engineering units]; empty when OP or PV is unknown in all of it."""
        return self.part.pv if self._known and self.part.pv is not None else np.empty(0)

    @property
    def _known(self) -> bool:
        return not bool(self.missing.all())

    @property
    def moves(self) -> bool:
        """Whether OP and PV vary, so that a valve can be searched for."""
        return all(peak_to_peak(x) > 1e-9 * float(np.abs(x).max(initial=0.0)) for x in (self.op, self.pv))

    def without(self, stretches: Iterable[tuple[int, int]]) -> Conditioned:
        """Leave out stretches of samples (first, one past the last), and choose the part to analyse again."""
        bounds = list(stretches)
        if not bounds or self.record.pv is None:
            return self
        op, pv = self.record.op.copy(), self.record.pv.copy()
        for first, last in bounds:
            op[first:last] = pv[first:last] = np.nan
        return _conditioned(replace(self.record, op=op, pv=pv))


def condition(record: LoopRecord) -> Conditioned:
    """Make a record ready for analysis; the part is empty when nothing can be analysed."""
    return _conditioned(mask_outliers(record))


def _conditioned(record: LoopRecord) -> Conditioned:
    masks = RecordMasks(record)
    first, last = analysis_window(record, masks)
    cut = record.window(first, last)
    part = _filled(record, first, last) if len(cut) else cut
    values = [np.empty(0) if x is None else different_values(x) for x in (cut.op, cut.pv)]
    missing = missing_mask(cut.op, cut.pv)
    gaps = missing_mask(fill_short_gaps(cut.op), None if cut.pv is None else fill_short_gaps(cut.pv))
    known = not missing.all()
    return Conditioned(
        record, masks, first, last, part, missing, gaps, op_values=values[0], pv_values=values[1],
        op_swing=robust_range(part.op) if known else 0.0,
        pv_swing=robust_range(part.pv) if known and part.pv is not None else 0.0,
        op_step=quantisation_step(cut.op, values[0]),
        pv_step=0.0 if cut.pv is None else quantisation_step(cut.pv, values[1]),
    )  # fmt: skip


def _filled(record: LoopRecord, first: int, last: int) -> LoopRecord:
    """Cut a segment and fill its gaps; its assumptions say what was filled."""
    part, (sp, about_sp) = record.window(first, last), forward_fill_sp(record, first, last)
    signals = {"op": part.op, "pv": part.pv}
    filled = {name: interpolate_gaps(x) for name, x in signals.items() if x is not None}
    count = int(missing_mask(part.op, part.pv).sum())
    about_gaps = f"{count} missing samples were filled by straight lines." if count else ""
    added = tuple(text for text in (about_gaps, about_sp) if text)
    origin = replace(part.provenance, assumptions=(*part.provenance.assumptions, *added))
    return replace(part, **filled, sp=sp, provenance=origin)
