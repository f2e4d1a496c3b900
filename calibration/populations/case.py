"""One loop of a population: its record, and what is true of it."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stiction.models import Loop
    from stiction.records.record import LoopRecord

__all__ = ["CAUSES", "Case"]

CAUSES = ("stiction", "deadband", "tight tuning", "external disturbance", "sensor", "saturation", "none")
"""What can be wrong with a loop of the population."""


@dataclass(frozen=True)
class Case:
    """A simulated record and what is true of its loop."""

    record: LoopRecord
    """What the historian gives back; without the stem's position where none was asked for."""
    cause: str
    """One of `CAUSES`, or `dead zone`."""
    loop: Loop
    """The loop that made it, with its sampling period; the record may be slower."""
    cycles: float
    """Oscillation periods in the record [-]; NaN where the loop does not oscillate."""
    kind: str = ""
    """How the cause shows: the shape of a disturbance, the fault of a sensor."""
    period: float = nan
    """Period of the oscillation, without noise [s]; NaN where the loop does not oscillate."""
    S: float = nan
    """Deadband plus stickband of the valve [% of span]; 0 of a good valve."""
    J: float = nan
    """Slip jump of the valve [% of span]; 0 of a good valve."""
    noise: float = 0.0
    """Standard deviation of the measurement noise [PV units as simulated]."""
    load: float = 0.0
    """Standard deviation of the random load at the process inlet [% of span]."""
    sticking: tuple[tuple[int, int], ...] = ()
    """Where the valve sticks [samples simulated for the record], first and one past the last; empty where it always
    does or never."""
    effects: tuple[str, ...] = ()
    """What the historian did, names of `historian.EFFECTS`."""
    position: str = ""
    """What the record's `mv` is, one of `position.POSITIONS`; empty where there is none."""

    @property
    def sticky(self) -> bool:
        """Whether the valve sticks."""
        return self.cause == "stiction"
