"""The result of a data check, and the comparison of a value with its limits."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from stiction.display.json_form import Result, json_as
from stiction.display.number_format import count_noun
from stiction.records.runs import run_bounds

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "MIN_CYCLES",
    "MIN_SAMPLES",
    "RECORD_LONGER",
    "CheckResult",
    "Severity",
    "check_excluded",
    "check_maximum",
    "check_minimum",
]

Severity = Literal["ok", "warn", "reject"]

MIN_SAMPLES, MIN_CYCLES = 60, 3
"""Samples, and cycles of the oscillation, below which no record is diagnosed [-]."""
RECORD_LONGER = "the usable segment is too short: record longer"
"""Remedy when too few samples are left."""


@dataclass(frozen=True, slots=True)
class CheckResult(Result):
    """One data check of a record."""

    _json_keys = ("name", "severity", "value", "limit", "unit", "remedy", "why")

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
    """What was found, a sentence without capital and full stop."""
    remedy: str = ""
    """What to do, in the same form; empty when nothing is to be done."""

    @property
    def why(self) -> str:
        """The finding and the remedy as sentences."""
        return " ".join(f"{text[0].upper()}{text[1:]}." for text in (self.finding, self.remedy) if text)


def check_minimum(
    name: str, value: float, unit: str, *, finding: str, warn: float, reject: float = -np.inf, remedy: str = ""
) -> CheckResult:
    """Compare a value with the smallest ones that pass: below `warn` it warns, below `reject` it rejects [`unit`]."""
    mirrored = check_maximum(name, -value, unit, finding=finding, warn=-warn, reject=-reject, remedy=remedy)
    return replace(mirrored, value=float(value), limit=-mirrored.limit)


def check_maximum(
    name: str, value: float, unit: str, *, finding: str, warn: float, reject: float = np.inf, remedy: str = ""
) -> CheckResult:
    """Compare a value with the largest ones that pass: above `warn` it warns, above `reject` it rejects [`unit`]."""
    severity: Severity = "reject" if value > reject else "warn" if value > warn else "ok"
    limit = reject if severity == "reject" else warn
    return CheckResult(name, severity, float(value), limit, unit, finding, remedy if severity != "ok" else "")


def check_excluded(
    name: str, mask: NDArray[np.bool_], finding: str, *, reject: float, remedy: str, is_cut_too_short: bool
) -> CheckResult:
    """Warn above 5 % of excluded samples; reject above a share [%], or when the rest is too short."""
    percent = 100.0 * float(np.mean(mask)) if mask.size else 0.0
    finding = finding.format(share=f"{percent:.3g} %", segments=count_noun(len(run_bounds(mask)), "segment"))
    result = check_maximum(name, percent, "%", warn=5, reject=reject, finding=finding)
    if result.severity == "warn" and is_cut_too_short:
        return replace(result, severity="reject", remedy=RECORD_LONGER)
    return replace(result, remedy=remedy if result.severity == "reject" else "")
