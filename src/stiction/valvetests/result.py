"""Results of valve tests: estimates with their spread, slips and rests, open questions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from stiction.display.json_form import Result, fields_to_json, json_as

if TYPE_CHECKING:
    from stiction.records import LoopRecord

__all__ = ["Behaviour", "Estimate", "Ramp", "StemEvent", "TravelBin", "ValveTest", "Verdict"]

Verdict = Literal["within limit", "beyond limit", "undecided"]
Behaviour = Literal["staircase", "follow", "mixed", "did not slip", "cannot tell"]


@dataclass(frozen=True, slots=True)
class Estimate:
    """A quantity with its 95 % interval and its spread; NaN when unknown."""

    value: float = math.nan
    """Best value [unit of the quantity]."""
    low: float = math.nan
    """Lower end of the 95 % interval of the value [unit of the quantity]; NaN with fewer than three readings."""
    high: float = math.nan
    """Upper end of the 95 % interval of the value [unit of the quantity]; NaN with fewer than three readings."""
    spread: float = math.nan
    """Standard deviation of the single readings [unit of the quantity]; NaN with fewer than two."""
    n: int = 0
    """Number of readings [-]."""

    @property
    def known(self) -> bool:
        """Whether there is a value."""
        return math.isfinite(self.value)

    def text(self, unit: str = "%") -> str:
        """The value in words, such as '5.1 % (5.02 to 5.18)'."""
        if not self.known:
            return "cannot tell"
        band = f" ({self.low:.3g} to {self.high:.3g})" if math.isfinite(self.low) else ""
        return f"{self.value:.3g} {unit}{band}"


@dataclass(frozen=True, slots=True)
class StemEvent:
    """The stem broke loose or came to rest."""

    kind: Literal["slip", "stick"]
    """`slip` when the stem broke loose, `stick` when it came to rest."""
    time: float
    """Time since the start of the record [s]."""
    ramp: int
    """Index of the ramp in which it happened [-]."""
    direction: int
    """1 when the OP rose, -1 when it fell [-]."""
    op: float
    """OP at the event [% of span]."""
    position: float
    """Position at which the stem rested: before a slip, after a stick [% of span]."""
    stick_band: float
    """Slip: OP beyond the frictionless position when the stem broke loose, sb [% of span]; NaN for a stick."""
    jump: float
    """Slip: travel of the jump, sj [% of span]; NaN for a stick."""


@dataclass(frozen=True, slots=True)
class Ramp:
    """One ramp of the test and the motion of the stem in it."""

    start: float
    """Start [s]."""
    end: float
    """End [s]."""
    rate: float
    """Rate of the OP, negative when falling [% of span / s]."""
    op_start: float
    """OP at the start [% of span]."""
    op_end: float
    """OP at the end [% of span]."""
    behaviour: Behaviour
    """`staircase`: stick, slip, stick; `follow`: stick, slip, follow; or `mixed`, `did not slip`, `cannot tell`."""
    slips: int
    """Number of slips [-]."""
    sb: float
    """Mean stick band of its slips [% of span]; NaN when unknown."""
    sj: float
    """Mean jump of its slips [% of span]; NaN when unknown."""
    smallest_stair: float
    """Smallest stair visible above the noise at this rate [% of span]."""
    reason: str
    """Reason for the behaviour."""


@dataclass(frozen=True, slots=True)
class TravelBin:
    """Stick band and jump over one range of the travel in one direction."""

    low: float
    """Lower end [% of span]."""
    high: float
    """Upper end [% of span]."""
    direction: int
    """1 opening, -1 closing [-]."""
    n: int
    """Number of slips [-]."""
    sb: float
    """Mean stick band [% of span]."""
    sb_spread: float
    """Standard deviation of the stick band [% of span]; NaN for one slip."""
    sj: float
    """Mean jump [% of span]."""
    sj_spread: float
    """Standard deviation of the jump [% of span]; NaN for one slip."""


@dataclass(frozen=True)
class ValveTest(Result):
    """Result of a valve test.

    Examples
    --------
    >>> import stiction as st
    >>> plan = st.plan_ramp_test(40.0, 60.0, rates=[0.1])
    >>> test = st.analyse_ramp(st.stroke(st.Kano(3.0, 1.0), plan.op, dt=plan.dt))
    >>> isinstance(test, st.ValveTest), test.verdict
    (True, 'beyond limit')
    """

    record: LoopRecord = field(repr=False, compare=False, metadata=json_as(omit=True))
    """The record as analysed."""
    signal: str
    """Signal that shows the stem: `mv` (valve position) or `pv` (flow)."""
    verdict: Verdict
    """Whether deadband plus stickband is within the limit."""
    reason: str
    """Reason, in one or two sentences."""
    limit: float
    """Limit on deadband plus stickband [% of span]."""
    unknown: tuple[str, ...]
    """Quantities that this test does not show, and the test that would, one sentence each."""
    settings: dict[str, Any]
    """Settings of the analysis."""

    kind = "valve test"
    brackets = ""

    def quantities(self) -> dict[str, Estimate]:
        """Measured quantities by name; `compare_tests` compares these."""
        raise NotImplementedError

    def to_dict(self, *, series: bool = True) -> dict[str, Any]:
        """JSON-ready form; of the record its source, tag, sampling period and number of samples."""
        file, tag, dt, n = self.record.provenance.source, self.record.tag, self.record.dt, len(self.record)
        record = {"file": file, "tag": tag, "dt_s": dt, "samples": n}
        return {"kind": self.kind, "record": record, **fields_to_json(self, series=series)}

    def summary(self) -> str:
        """Summary in a few lines."""
        sizes = ", ".join(f"{name} = {value.text(unit_of(name))}" for name, value in self.quantities().items())
        lines = [f"{self.record.tag} ({self.kind}, read from {self.signal.upper()}): {self.verdict}. {self.reason}"]
        lines.append(f"{sizes}. In brackets: {self.brackets}.")
        lines += [f"Cannot tell: {line}" for line in self.unknown]
        return "\n".join(lines)


def unit_of(name: str) -> str:
    """Return the unit of a measured quantity, from its name."""
    if name == "r":
        return "%/s"
    return "s" if name in ("dead_time", "t63", "t86", "t98") else "%"
