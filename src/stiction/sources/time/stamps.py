"""Time of each row of a table, as every parser of time stamps gives it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError, Setting

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Stamps", "unread_stamp_error", "unwrap_clock"]


@dataclass
class Stamps:
    """Time of each row, in the order of the source."""

    seconds: NDArray[np.float64]
    """Seconds since 1970 ("utc", "local") or since some zero ("relative"); NaN where a stamp was not understood."""
    kind: str
    """"utc" (a zone was given), "local" (a wall clock) or "relative"."""
    notes: list[str] = field(default_factory=list)
    """Assumptions, a sentence each."""
    first_unread: tuple[int, str] | None = None
    """Row and text of the first cell that was not understood."""
    resolution: float = 0.0
    """Step to which the stamps are rounded [s]; 0 when unknown."""
    clock_jumps: int = 0
    """Times that the clock jumped and was corrected."""
    dst_changes: int = 0
    """How many of `clock_jumps` were changes to or from summer time."""


def unread_stamp_error(
    stamps: Stamps, name: str, first_line: int, *, other_remedy: tuple[str | Setting, ...] = ()
) -> RecordError:
    """Make the error of a source of which no two time stamps are understood."""
    row, cell = stamps.first_unread or (0, "")
    return RecordError(
        f"{cell!r} is not a known form of time stamp",
        remedy=("give ", Setting("time_format"), *other_remedy),
        where=f"{name}, line {first_line + row}",
    )


def unwrap_clock(seconds: NDArray[np.float64], turn: float = 86400.0) -> NDArray[np.float64]:
    """Let a clock [s] run on where it falls back to zero after `turn` [s]."""
    known = np.isfinite(seconds)
    shown = seconds[known]
    unwrapped = seconds.copy()
    unwrapped[known] = shown + turn * np.cumsum(np.diff(shown, prepend=shown[:1]) < -turn / 2.0)
    return unwrapped
