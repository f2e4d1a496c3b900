"""The signals of a record that several data checks look at, each computed once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.check_result import MIN_CYCLES, MIN_SAMPLES
from stiction.records.gaps import forward_fill
from stiction.records.quality.quantisation import quantisation_step, robust_range

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.conditioned import Conditioned
    from stiction.records.masks import RecordMasks
    from stiction.records.record import LoopRecord

__all__ = ["CheckInput"]


@dataclass(frozen=True)
class CheckInput:
    """A record and what several checks compute from it."""

    conditioned: Conditioned
    """The record, ready for analysis."""
    period: float | None
    """Period of the oscillation [s], when it is known."""

    @property
    def record(self) -> LoopRecord:
        """The whole record."""
        return self.conditioned.record

    @property
    def masks(self) -> RecordMasks:
        """Where its OP is at a limit or moved in manual, and where its PV is frozen."""
        return self.conditioned.masks

    @cached_property
    def part(self) -> LoopRecord:
        """Its longest usable segment, with all gaps."""
        return self.record.window(self.conditioned.first, self.conditioned.last)

    @cached_property
    def whole(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """OP and PV of the record without gaps [units of the record]; PV is empty when it was not recorded."""
        pv = self.record.pv
        return forward_fill(self.record.op), np.empty(0) if pv is None else forward_fill(pv)

    @cached_property
    def steps(self) -> tuple[float, float]:
        """Quantisation steps of OP and PV [units of the record]."""
        if len(self.part) == len(self.record):
            return self.conditioned.op_step, self.conditioned.pv_step
        return quantisation_step(self.whole[0]), quantisation_step(self.whole[1])

    @cached_property
    def op(self) -> NDArray[np.float64]:
        """OP of the segment without gaps [unit of the record], shape (n_samples,)."""
        return self.whole[0] if len(self.part) == len(self.record) else forward_fill(self.part.op)

    @cached_property
    def pv(self) -> NDArray[np.float64]:
        """PV of the segment without gaps [engineering units], shape (n_samples,); empty when it was not recorded."""
        whole = self.part.pv is None or len(self.part) == len(self.record)
        return self.whole[1] if whole or self.part.pv is None else forward_fill(self.part.pv)

    @cached_property
    def swings(self) -> tuple[float, float]:
        """98 % ranges of OP and PV of the segment [units of the record]."""
        known = self.conditioned
        if known.missing.size and not known.missing.any():
            return known.op_swing, known.pv_swing
        return robust_range(self.op), robust_range(self.pv)

    @cached_property
    def cycle(self) -> float | None:
        """Time of a cycle [s]: the period, else the mean time between upward crossings of OP's mean, if six or more."""
        if self.period is not None:
            return self.period
        above = self.whole[0] > np.nanmean(self.whole[0]) if np.isfinite(self.whole[0]).any() else np.zeros(2, bool)
        crossings = int(np.sum(above[1:] & ~above[:-1]))
        return self.record.duration / crossings if crossings >= 6 else None

    @cached_property
    def is_cut_too_short(self) -> bool:
        """Whether the segment is too short for a diagnosis and the whole record would not be."""
        needed = max(MIN_SAMPLES * self.record.dt, MIN_CYCLES * (self.cycle or 0.0))
        return self.part.duration < needed <= self.record.duration
