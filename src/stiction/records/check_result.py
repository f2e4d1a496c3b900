"""The result of a data check, the signals that checks look at, and the comparison with limits."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from stiction.display.check_text import describe_check
from stiction.display.json_form import Result, fields_to_json, json_as
from stiction.records.gaps import forward_fill
from stiction.records.quality.quantisation import quantisation_step

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.conditioned import Conditioned
    from stiction.records.masks import RecordMasks
    from stiction.records.record import LoopRecord

__all__ = ["MIN_CYCLES", "MIN_SAMPLES", "CheckInput", "CheckResult", "Severity", "check_maximum", "check_minimum"]

Severity = Literal["ok", "warn", "reject"]

MIN_SAMPLES, MIN_CYCLES = 60, 3
"""Samples, and cycles of the oscillation, below which no record is diagnosed [-]."""


@dataclass(frozen=True, slots=True)
class CheckResult(Result):
    """One data check of a record, as numbers; `stiction.display.describe_check` makes the sentence."""

    name: str
    """What is checked."""
    severity: Severity
    """"ok", "warn" (the result is less certain) or "reject" (no diagnosis)."""
    value: float
    """The value found [`unit`]."""
    limit: float
    """The limit that was passed, or the next one [`unit`]."""
    unit: str
    """Unit of value and limit: samples, cycles, %, ..."""
    finding: str = field(metadata=json_as(omit=True))
    """Code of the finding, a key of `stiction.display.check_text.FINDINGS`."""
    fields: dict[str, float | str] = field(default_factory=dict, metadata=json_as(omit=True))
    """Further numbers and names of the finding; a name that ends in `_s` is a time [s], `_percent` a share [%]."""
    remedy: str = ""
    """Code of the remedy, a key of `stiction.display.check_text.REMEDIES`; empty when nothing is to be done."""

    def to_dict(self, *, series: bool = True) -> dict[str, Any]:
        """JSON-ready form, with the sentence of the check."""
        return {**fields_to_json(self, series=series), "why": describe_check(self)}


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


def check_minimum(
    name: str, value: float, unit: str, *, warn: float, reject: float = -np.inf, **codes: Any
) -> CheckResult:
    """Compare a value with the smallest ones that pass: below `warn` it warns, below `reject` it rejects [`unit`]."""
    mirrored = check_maximum(name, -value, unit, warn=-warn, reject=-reject, **codes)
    return replace(mirrored, value=float(value), limit=-mirrored.limit)


def check_maximum(
    name: str,
    value: float,
    unit: str,
    *,
    warn: float,
    reject: float = np.inf,
    finding: str = "",
    remedy: str = "",
    fields: dict[str, float | str] | None = None,
) -> CheckResult:
    """Compare a value with the largest ones that pass: above `warn` it warns, above `reject` it rejects [`unit`]."""
    severity: Severity = "reject" if value > reject else "warn" if value > warn else "ok"
    limit = reject if severity == "reject" else warn
    code, remedy = finding or name.replace(" ", "_"), remedy if severity != "ok" else ""
    return CheckResult(name, severity, float(value), limit, unit, code, fields or {}, remedy)
