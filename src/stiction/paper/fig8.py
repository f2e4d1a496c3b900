"""Fig. 8: a disturbance at t = 200 s moves the example loop from limit cycle A to limit cycle C."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.json_form import json_as
from stiction.errors import require_positive
from stiction.limitcycle import exact_limit_cycles, smallest_pulse
from stiction.paper.fig7 import EXAMPLE_LOOP
from stiction.simulation import simulate

if TYPE_CHECKING:
    from stiction.limitcycle import LimitCycle
    from stiction.records.record import LoopRecord

__all__ = ["Figure8", "figure8"]


@dataclass(frozen=True)
class Figure8:
    """Data of Fig. 8."""

    record: LoopRecord = field(metadata=json_as(series=True))
    """OP, PV, set point and stem; the pulse acts at the process inlet.

    The loop starts at PV 0 with its stem at 0.25 % and finds its point of rest at stem 0.
    """
    pulse: tuple[float, float, float]
    """Size [% of span], begin [s] and length [s] of the pulse."""
    cycles: tuple[LimitCycle, ...]
    """All four stable cycles: A, C and the two of the family with levels 0, +-d, ..."""
    smallest: tuple[float, float] | None
    """Size [% of span] and phase [-] of the smallest pulse of this length that moves the loop from A to C."""


def figure8(pulse: float = 1.0, begin: float = 200.0, length: float = 5.0, duration: float = 400.0) -> Figure8:
    """Simulate the example loop in cycle A and disturb it.

    `pulse`: size of the pulse at the process inlet [% of span]; the paper does not give it. `begin`, `length`,
    `duration`: begin and length of the pulse and length of the record [s]. Returns the record, the four stable cycles,
    and the smallest pulse that does it.

    References
    ----------
    srinivasan2008, Fig. 8.

    Examples
    --------
    >>> import numpy as np
    >>> from stiction.paper.fig8 import figure8
    >>> mv = np.round(figure8().record.mv / 0.5, 1)
    >>> len(np.unique(mv[10000:19000])), len(np.unique(mv[30000:36000]))
    (2, 4)
    """
    for name, value in (("begin", begin), ("length", length), ("duration", duration)):
        require_positive(name, value, "s")
    n = round(duration / EXAMPLE_LOOP.dt)
    time = np.arange(n) * EXAMPLE_LOOP.dt
    level = 0.25
    load = np.where((time >= begin) & (time < begin + length), pulse, 0.0) + level
    record = simulate(EXAMPLE_LOOP, sp=0.0, duration=duration, disturbance=load, op_start=level, tag="Fig. 8")
    cycles = exact_limit_cycles(EXAMPLE_LOOP)
    small, large = (cycle for cycle in cycles if cycle.family == "half")
    return Figure8(record, (pulse, begin, length), cycles, smallest_pulse(EXAMPLE_LOOP, small, large, length))
