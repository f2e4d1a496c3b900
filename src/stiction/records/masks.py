"""Masks of one record that several stages need, each computed once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.quality.frozen import find_frozen, find_manual
from stiction.records.quality.manual_steps import find_manual_steps
from stiction.records.quality.saturation import find_clipping, find_saturation

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["RecordMasks"]


@dataclass(frozen=True, eq=False)
class RecordMasks:
    """Where OP of a record is at a limit or moved in manual, and where PV is frozen."""

    record: LoopRecord
    """The record, outliers missing."""

    @cached_property
    def manual_steps(self) -> NDArray[np.bool_]:
        """Where OP steps between constant levels, shape (n_samples,)."""
        return find_manual_steps(self.record.op)

    @cached_property
    def clipped(self) -> NDArray[np.bool_]:
        """Where OP is clipped inside its span, shape (n_samples,)."""
        return find_clipping(self.record.op, self.record.pv, self.record.auto, steps=self.manual_steps)

    @cached_property
    def at_limit(self) -> NDArray[np.bool_]:
        """Where OP is at a limit, shape (n_samples,)."""
        return find_saturation(self.record.op, self.record.pv, self.record.auto, clipped=self.clipped)

    @cached_property
    def manual(self) -> NDArray[np.bool_]:
        """Where the loop is in manual, shape (n_samples,)."""
        op, pv, auto = self.record.op, self.record.pv, self.record.auto
        return find_manual(op, pv, auto, at_limit=self.at_limit, steps=self.manual_steps)

    @cached_property
    def frozen(self) -> NDArray[np.bool_]:
        """Where PV is frozen, shape (n_samples,); nowhere when it was not recorded."""
        pv = self.record.pv
        return np.zeros(len(self.record), dtype=bool) if pv is None else find_frozen(pv)
