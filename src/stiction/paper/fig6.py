"""Fig. 6: a self-regulating level loop cycles because its valve sticks, d = 5.1 %."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from stiction.display.json_form import json_as
from stiction.limitcycle import exact_limit_cycles
from stiction.models import FOPDT, PID, Loop, Stenman
from stiction.simulation import simulate

if TYPE_CHECKING:
    from stiction.limitcycle import LimitCycle
    from stiction.records.record import LoopRecord

__all__ = ["LEVEL_LOOP", "Figure6", "figure6"]

LEVEL_LOOP = Loop(PID(Kc=0.5, Ti=30.0), Stenman(5.1), FOPDT(K=1.0, tau=60.0, dead_time=5.0), dt=0.5)
"""The stiction band is the paper's; process and controller are assumed, as the paper gives none."""


@dataclass(frozen=True)
class Figure6:
    """Data of Fig. 6."""

    record: LoopRecord = field(metadata=json_as(series=True))
    """OP, PV, set point and stem [%]."""
    cycles: tuple[LimitCycle, ...]
    """The limit cycles of the loop, solved exactly."""
    note: str
    """Which values are from the paper and which are assumed."""


def figure6(duration: float = 3000.0) -> Figure6:
    """Simulate the level loop with d = 5.1 %.

    `duration`: length of the record [s]. Returns the record and the loop's limit cycles.

    References
    ----------
    srinivasan2008, Fig. 6.

    Examples
    --------
    >>> from stiction.paper.fig6 import figure6
    >>> data = figure6()
    >>> bool(data.record.mv[-2000:].max() - data.record.mv[-2000:].min() >= 5.1)
    True
    """
    rest = 50.0
    record = simulate(
        LEVEL_LOOP, sp=rest, duration=duration, op_start=rest - 2.0, pv_start=rest - 2.0, mv_start=rest - 2.0,
        tag="Fig. 6", loop_type="level",
    )  # fmt: skip
    note = "d = 5.1 % is from the paper; process and controller are assumed, so the period differs from the paper."
    return Figure6(record, exact_limit_cycles(LEVEL_LOOP), note)
