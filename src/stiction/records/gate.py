"""What a gate is, what it looks at, and how a value is held against its limits."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from stiction.records.limits import saturated
from stiction.records.rests import filled
from stiction.records.storage import lattice

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["LEAST_CYCLES", "LEAST_SAMPLES", "Gate", "Severity", "View", "at_least", "at_most"]

Severity = Literal["ok", "lowers", "refuses"]

LEAST_SAMPLES = 60
"""Samples below which nothing is said about a valve."""
LEAST_CYCLES = 3
"""Cycles below which nothing is said about a valve."""


@dataclass(frozen=True, slots=True)
class Gate:
    """One check of a record."""

    name: str
    """What is checked."""
    severity: Severity
    """"ok", "lowers" the confidence, or "refuses" the record."""
    value: float
    """What was found [unit of the check: samples, cycles, %, ...]."""
    limit: float
    """The limit that counts: the one passed, or the next one to be passed [the same unit]."""
    why: str
    """A sentence on what was found and what to do."""

    def to_dict(self) -> dict[str, Any]:
        """Give the gate, ready for JSON."""
        return asdict(self)


@dataclass(frozen=True)
class View:
    """What a gate looks at; what several gates need is found once."""

    record: LoopRecord
    """The whole record."""
    part: LoopRecord
    """Its longest usable stretch."""
    period: float | None
    """Period of the oscillation [s], when known."""

    @cached_property
    def whole(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """OP and PV of the record, gaps bridged [units of the record]; PV is empty where it was not recorded."""
        pv = self.record.pv
        return filled(self.record.op), np.empty(0) if pv is None else filled(pv)

    @cached_property
    def steps(self) -> tuple[float, float]:
        """Lattices of OP and PV [units of the record]."""
        return lattice(self.whole[0]), lattice(self.whole[1])

    @cached_property
    def at_limit(self) -> NDArray[np.bool_]:
        """Where OP of the record rests at a limit, shape (n_samples,)."""
        return saturated(self.record)

    @cached_property
    def op(self) -> NDArray[np.float64]:
        """OP of the stretch, small gaps bridged [unit of the record], shape (n_samples,)."""
        return self.whole[0] if len(self.part) == len(self.record) else filled(self.part.op)

    @cached_property
    def pv(self) -> NDArray[np.float64] | None:
        """PV of the stretch, small gaps bridged [engineering units], shape (n_samples,)."""
        if self.part.pv is None or len(self.part) == len(self.record):
            return None if self.part.pv is None else self.whole[1]
        return filled(self.part.pv)

    @cached_property
    def cycle(self) -> float | None:
        """Time of a cycle [s]: the period, else from one upward crossing of OP's mean to the next, None below six."""
        if self.period is not None:
            return self.period
        above = self.whole[0] > np.nanmean(self.whole[0]) if np.isfinite(self.whole[0]).any() else np.zeros(2, bool)
        crossings = int(np.sum(above[1:] & ~above[:-1]))
        return self.record.duration / crossings if crossings >= 6 else None

    @cached_property
    def too_little(self) -> bool:
        """Whether the stretch is too short to judge while the whole record would not be."""
        least = max(LEAST_SAMPLES * self.record.dt, LEAST_CYCLES * (self.cycle or 0.0))
        return self.part.duration < least <= self.record.duration


def at_least(name: str, value: float, lowers: float, refuses: float, why: str) -> Gate:
    """Ask for a value of `lowers`, refuse below `refuses`."""
    severity: Severity = "refuses" if value < refuses else "lowers" if value < lowers else "ok"
    return Gate(name, severity, float(value), refuses if value < refuses else lowers, why)


def at_most(name: str, value: float, lowers: float, refuses: float, why: str) -> Gate:
    """Allow a value of `lowers`, refuse above `refuses`."""
    severity: Severity = "refuses" if value > refuses else "lowers" if value > lowers else "ok"
    return Gate(name, severity, float(value), refuses if value > refuses else lowers, why)
