"""Result of a step test, with the terms of ISA-75.25.01."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from stiction.valvetests.result import Estimate, ValveTest

__all__ = ["BandReading", "Step", "StepTest"]


@dataclass(frozen=True, slots=True)
class Step:
    """One step of the OP and the stem's response to it."""

    time: float
    """Time of the step [s]."""
    op_before: float
    """OP before [% of span]."""
    op_after: float
    """OP after [% of span]."""
    stem_before: float
    """Stem at rest before [% of span, or the unit of the flow]."""
    stem_after: float
    """Stem at the end of the hold [% of span, or the unit of the flow]."""
    responded: bool
    """Whether the stem moved by more than the noise."""
    reversal: bool
    """Whether the step goes against the last motion of the stem."""
    dead_time: float
    """From the step to the first response [s]; NaN when unknown."""
    t63: float
    """From the step to 63.2 % of the response [s]; NaN when unknown."""
    t86: float
    """From the step to 86.5 % of the response [s]; NaN when unknown."""
    t98: float
    """From the step to 98 % of the response [s]; NaN when the noise exceeds 2 % of it."""
    overshoot: float
    """Overshoot beyond the final value [% of the response]; NaN when unknown."""


@dataclass(frozen=True, slots=True)
class BandReading:
    """One reading of the travel on a reversal or of the resolution."""

    kind: Literal["reversal", "resolution"]
    """`reversal` on a reversal, `resolution` onwards in the same direction."""
    position: float
    """Rest position of the stem [% of span, or the unit of the flow]."""
    direction: int
    """1 opening, -1 closing [-]."""
    reading: float
    """OP from the turning point (reversal) or from the last response (resolution) to the response [% of span]."""
    from_last_move: float
    """OP from the last response to this one: S on a reversal, J onwards, rounded up to a step [% of span]."""
    step: float
    """Step by which it may be rounded up [% of span]."""


@dataclass(frozen=True)
class StepTest(ValveTest):
    """Result of a step test."""

    deadband: Estimate
    """Deadband without stickband, S - J [% of span]: OP lost in the response to a reversing step; without such a
    step, S minus the resolution."""
    resolution: Estimate
    """OP onwards in the same direction until the next response [% of span]: J, rounded up to a step."""
    S: Estimate
    """Deadband plus stickband, read from the last response [% of span]; the interval is the rounding to a step."""
    reversal_travel: Estimate
    """OP on a reversal, from the turning point, until the stem moves back [% of span]: what ISA-75.25.01 calls dead
    band. It is no property of the valve alone, but lies between S and S + J."""
    reversal_range: tuple[float, float]
    """S and S + J: where `reversal_travel` lies, depending on where in the stick band the reversal starts
    [% of span]."""
    dead_time: Estimate
    """Dead time [s]."""
    t63: Estimate
    """Time to 63.2 % of the response [s]."""
    t86: Estimate
    """Time to 86.5 % of the response [s]."""
    t98: Estimate
    """Time to 98 % of the response [s]."""
    overshoot: Estimate
    """Overshoot [% of the response]."""
    smallest_response: float
    """Smallest motion visible above the noise [% of span, or the unit of the flow]."""
    steps: tuple[Step, ...]
    """Every step."""
    readings: tuple[BandReading, ...]
    """Every reading on a reversal and of the resolution, over the travel."""

    kind = "step test"
    brackets = "for S, resolution and reversal_travel the rounding to a step, else the range of 95 % of the steps"

    def quantities(self) -> dict[str, Estimate]:
        """Measured quantities by name."""
        names = ("S", "deadband", "resolution", "reversal_travel", "dead_time", "t63", "t86", "t98", "overshoot")
        return {name: getattr(self, name) for name in names}
