"""Data quality: all data checks of a record, and whether it can be diagnosed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from stiction.display.check_text import describe_check
from stiction.display.json_form import Result
from stiction.errors import require_positive
from stiction.records.check_result import CheckInput, CheckResult
from stiction.records.conditioned import Conditioned, condition
from stiction.records.loop_checks import LOOP_CHECKS
from stiction.records.storage_checks import STORAGE_CHECKS

if TYPE_CHECKING:
    from stiction.records.record import LoopRecord

__all__ = ["Quality", "assess_quality"]


@dataclass(frozen=True, slots=True)
class Quality(Result):
    """The data checks of a record."""

    _json_keys = ("usable", "rows", "duration as duration_s", "bad_percent", "first", "last", "checks as gates")

    checks: tuple[CheckResult, ...]
    """Every check that applies."""
    usable: bool
    """Whether no check rejects the record."""
    rows: int
    """Samples of the record."""
    duration: float
    """Length of the record [s]."""
    bad_percent: float
    """Samples in which OP or PV is missing [%]."""
    first: int
    """First sample of the segment to analyse."""
    last: int
    """One past the last sample of that segment."""

    @property
    def rejections(self) -> tuple[CheckResult, ...]:
        """Checks that reject the record."""
        return tuple(check for check in self.checks if check.severity == "reject")

    @property
    def warnings(self) -> tuple[CheckResult, ...]:
        """Checks that make the result less certain."""
        return tuple(check for check in self.checks if check.severity == "warn")

    def summary(self) -> str:
        """Return the findings as text, the worst first."""
        analysed = f"samples {self.first} to {self.last - 1}" if self.last > self.first else "no samples"
        head = (
            f"{'usable' if self.usable else 'not usable'}: {self.rows} samples, {self.duration:.6g} s, "
            f"{self.bad_percent:.3g} % without OP or PV, {analysed} analysed"
        )
        found = (f"{check.severity}: {describe_check(check)}" for check in (*self.rejections, *self.warnings))
        return "\n".join([head, *found])


def assess_quality(record: LoopRecord | Conditioned, period: float | None = None) -> Quality:
    """Apply every data check to a record.

    Parameters
    ----------
    record : LoopRecord or Conditioned
        A record of one loop, or one that is ready for analysis.
    period : float, optional
        Period of the oscillation [s]; cycles and samples per cycle are checked when it is given.

    Returns
    -------
    Quality
        Each check with its value, limit and remedy, and the segment to analyse.

    Raises
    ------
    ParameterError
        When `period` is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.records import LoopRecord, assess_quality
    >>> t = np.arange(400.0)
    >>> record = LoopRecord("FIC-101", 1.0, op=50 + np.sin(t / 6.1), pv=3 + np.cos(t / 6.1))
    >>> assess_quality(record, period=38.3).usable, assess_quality(record, period=200.0).rejections[0].name
    (True, 'cycles')
    """
    if period is not None:
        period = require_positive("period", period, "s")
    made = record if isinstance(record, Conditioned) else condition(record)
    record, data = made.record, CheckInput(made, period)
    checks = tuple(result for check in (*LOOP_CHECKS, *STORAGE_CHECKS) if (result := check(data)) is not None)
    usable = not any(check.severity == "reject" for check in checks)
    return Quality(checks, usable, len(record), record.duration, record.missing_percent, made.first, made.last)
