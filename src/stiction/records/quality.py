"""Is a record good enough to judge a valve by? Every gate with its reason."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import require_positive
from stiction.records.gates import GATES, Gate, View
from stiction.records.missing_values import missing, without_outliers
from stiction.records.stretches import analysis_window, usable_part

if TYPE_CHECKING:
    from stiction.records.record import LoopRecord

__all__ = ["Gate", "Quality", "analysis_window", "assess", "usable_part"]


@dataclass(frozen=True, slots=True)
class Quality:
    """What a record is worth."""

    gates: tuple[Gate, ...]
    """Every check that applied."""
    usable: bool
    """Whether no gate refuses the record."""
    rows: int
    """Samples of the record."""
    duration: float
    """Length of the record [s]."""
    bad_percent: float
    """Samples in which OP or PV is missing [%]."""
    first: int
    """First sample of the stretch to analyse."""
    last: int
    """One past the last sample of that stretch."""

    @property
    def refusals(self) -> tuple[Gate, ...]:
        """Gates that refuse the record."""
        return tuple(gate for gate in self.gates if gate.severity == "refuses")

    @property
    def reservations(self) -> tuple[Gate, ...]:
        """Gates that lower the confidence."""
        return tuple(gate for gate in self.gates if gate.severity == "lowers")

    def summary(self) -> str:
        """Say what is wrong, the worst first."""
        analysed = f"samples {self.first} to {self.last - 1}" if self.last > self.first else "no samples"
        head = (
            f"{'usable' if self.usable else 'not usable'}: {self.rows} samples, {self.duration:.6g} s, "
            f"{self.bad_percent:.3g} % without OP or PV, {analysed} analysed"
        )
        return "\n".join([head, *(f"{gate.severity}: {gate.why}" for gate in (*self.refusals, *self.reservations))])

    def to_dict(self) -> dict[str, Any]:
        """Give the quality, ready for JSON."""
        return {
            "usable": self.usable,
            "rows": self.rows,
            "duration_s": self.duration,
            "bad_percent": self.bad_percent,
            "first": self.first,
            "last": self.last,
            "gates": [gate.to_dict() for gate in self.gates],
        }


def assess(record: LoopRecord, period: float | None = None) -> Quality:
    """Check a record against every gate.

    Parameters
    ----------
    record : LoopRecord
        What was recorded.
    period : float, optional
        Period of the oscillation [s]; cycles and samples per cycle are checked when it is given.

    Returns
    -------
    Quality
        Each gate with its value, limit and reason, and the stretch to analyse.

    Raises
    ------
    ParameterError
        When `period` is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.records import LoopRecord, assess
    >>> t = np.arange(400.0)
    >>> record = LoopRecord("FIC-101", 1.0, op=50 + np.sin(t / 6.1), pv=3 + np.cos(t / 6.1))
    >>> assess(record, period=38.3).usable, assess(record, period=200.0).refusals[0].name
    (True, 'cycles')
    """
    if period is not None:
        period = require_positive("period", period, "s")
    record = without_outliers(record)
    first, last = analysis_window(record)
    view = View(record, record.window(first, last), period)
    gates = tuple(gate for check in GATES if (gate := check(view)) is not None)
    gone = missing(record)
    return Quality(
        gates,
        usable=not any(gate.severity == "refuses" for gate in gates),
        rows=len(record),
        duration=record.duration,
        bad_percent=100.0 * float(np.mean(gone)) if gone.size else 0.0,
        first=first,
        last=last,
    )
