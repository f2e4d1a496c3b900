"""Result of a ramp test."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from stiction.display.json_form import json_as
from stiction.valvetests.result import Estimate, Ramp, StemEvent, TravelBin, ValveTest

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from stiction.models import Srinivasan

__all__ = ["RampTest"]


@dataclass(frozen=True)
class RampTest(ValveTest):
    """Result of a ramp test: the three parameters of the paper's valve, and every stick and slip."""

    sb: Estimate
    """Stick band of eq. 5: OP beyond the frictionless position at which the stem breaks loose [% of span]. It is not
    the stickband in S, which is the jump sj."""
    sj: Estimate
    """Jump of the stem when it breaks loose [% of span]."""
    r_low: float
    """Fastest rate with stairs: r is above it [% of span / s]; NaN when there is none. If ramps contradict each other,
    the slowest rate that the stem followed: r is between the two."""
    r_high: float
    """Slowest rate that the stem followed: r is at most this [% of span / s]; NaN when there is none. If ramps
    contradict each other, the fastest rate with stairs."""
    deadband: Estimate
    """Twice the distance of the moving stem from its frictionless line, 2 (sb - sj) [% of span]."""
    S: Estimate
    """Deadband plus stickband, 2 sb - sj [% of span]."""
    offset: float
    """OP of the frictionless valve at position (or flow) 0 [% of span]."""
    slope: float
    """OP per stem travel of the frictionless valve [% per %, or % of span per unit of the flow]."""
    delay: float
    """Lag of the following stem behind its input: viscous friction, transducer, flow sensor [s]; 0 when fewer than two
    rates were followed; NaN without a slip."""
    ramps: tuple[Ramp, ...]
    """Every ramp."""
    events: tuple[StemEvent, ...]
    """Every stick and slip, in order of time."""
    travel: tuple[TravelBin, ...]
    """Stick band and jump over the travel, by direction."""
    valve: Srinivasan | None = field(metadata=json_as(omit=True))
    """The fitted three-parameter valve; None when sb or sj is unknown."""
    residual: float
    """Rms difference of the fitted valve, stroked with the recorded OP, from the stem [% of span]; NaN without one."""
    position: NDArray[np.float64] = field(repr=False, compare=False, metadata=json_as(omit=True))
    """Stem as read [% of span of the OP], shape (n_samples,); NaN where missing."""
    model: NDArray[np.float64] = field(repr=False, compare=False, metadata=json_as(omit=True))
    """Position of the fitted valve over the same OP [% of span], shape (n_samples,); NaN without one."""

    kind = "ramp test"
    brackets = "95 % intervals; for r the rates tested between which it lies"

    def quantities(self) -> dict[str, Estimate]:
        """Measured quantities by name."""
        middle = math.sqrt(self.r_low * self.r_high) if self.r_low > 0.0 and self.r_high > 0.0 else math.nan
        rate = Estimate(middle, self.r_low, self.r_high, n=len(self.ramps))
        return {"sb": self.sb, "sj": self.sj, "r": rate, "deadband": self.deadband, "S": self.S}
