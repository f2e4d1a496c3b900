"""How far an audit is, and how long the rest takes."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

__all__ = ["LoopRate", "Progress"]


@dataclass(frozen=True)
class Progress:
    """How far a run is."""

    stage: str
    """"find", "compile", "plan", "screen", "diagnose", "group" or "done"."""
    done: int
    """Loops of this stage that are done, those of earlier runs included [-]."""
    total: int
    """Loops of this stage [-]."""
    new: int = 0
    """Loops of this stage that this run did [-]."""
    rate: float = 0.0
    """Loops per second [1/s]; 0 while it is not known."""
    seconds_left: float | None = None
    """Expected time to the end of screen and diagnosis [s]; None while it is not known."""
    sticky: int = 0
    """Sticky valves found so far [-]."""
    details: dict[str, Any] | None = None
    """Of "find": `tags`. Of "plan": `loops`, `parts` of the source, `samples` of a loop, loops `left` to do, `workers`,
    and the expected `seconds`."""


class LoopRate:
    """Loops per second of one stage, from its first batch on: the time in which the workers start does not count."""

    def __init__(self) -> None:
        self.done = 0
        self._first: tuple[int, float] | None = None
        self._last = 0.0

    def add(self, loops: int) -> None:
        """Count loops that are done now."""
        self.done += loops
        self._last = time.monotonic()
        if self._first is None:
            self._first = self.done, self._last

    @property
    def per_second(self) -> float:
        """The rate [1/s]; 0 before the second batch."""
        if self._first is None or self._last <= self._first[1]:
            return 0.0
        return (self.done - self._first[0]) / (self._last - self._first[1])
