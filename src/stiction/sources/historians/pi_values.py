"""Values of the PI Web API: numbers, digital states, flags and time stamps, and the pages of one tag put together."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import RecordError
from stiction.sources.historians.tag_history import TagHistory, make_history

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["PiPages", "parse_item", "parse_stamps"]


def parse_stamps(stamps: Sequence[str]) -> Any:
    """Seconds since 1970 of time stamps such as 2026-03-02T06:00:00.1234567Z, shape (n,).

    Raises
    ------
    ValueError
        When one is no time.

    Examples
    --------
    >>> parse_stamps(["1970-01-01T00:00:01.5Z", "1970-01-01T01:00:02+01:00"]).tolist()
    [1.5, 2.0]
    """
    import polars as pl

    texts = pl.Series(stamps, dtype=pl.String)
    parsed = texts.str.to_datetime("%Y-%m-%dT%H:%M:%S%.f%#z", time_unit="ns", strict=False, time_zone="UTC")
    if parsed.null_count():
        raise ValueError(f"{texts.filter(parsed.is_null())[0]!r} is not a time stamp with a zone")
    return parsed.to_physical().to_numpy() / 1e9


@dataclass
class PiPages:
    """The values of one tag, as its pages come; each page begins at the time at which the one before ended."""

    last: str = ""
    """Last time stamp as written."""
    at_last: int = 0
    """Values at the last time stamp, which the next page begins with [-]."""
    parts: list[TagHistory] = field(default_factory=list)
    """The pages, as arrays: the objects of their JSON do not outlive them."""

    def add(self, items: Sequence[dict[str, Any]]) -> int:
        """Add a page without the values that are known, and give the number of new ones.

        Raises
        ------
        RecordError
            When a time stamp cannot be read.
        """
        known = 0
        while known < min(self.at_last, len(items)) and items[known]["Timestamp"] == self.last:
            known += 1
        new = items[known:]
        if not new:
            return 0
        stamps = [one["Timestamp"] for one in new]
        try:
            seconds = parse_stamps(stamps)
        except ValueError as error:
            raise RecordError(f"{error}; check the answer of the server.") from None
        values, quality = zip(*map(parse_item, new), strict=True)
        self.parts.append(make_history(seconds, values, quality))
        same = 1
        while same < len(stamps) and stamps[-1 - same] == stamps[-1]:
            same += 1
        self.at_last = same + (known if same == len(stamps) and stamps[-1] == self.last else 0)
        self.last = str(stamps[-1])
        return len(new)

    def history(self, since: float, until: float) -> TagHistory:
        """All values from `since` on and before `until` [s]."""
        import polars as pl

        if not self.parts:
            return make_history([], [], [])
        seconds = np.concatenate([part.seconds for part in self.parts])
        kinds = {part.values.dtype for part in self.parts}
        kind = kinds.pop() if len(kinds) == 1 else pl.String
        values = pl.concat([part.values.cast(kind) for part in self.parts])
        quality = pl.concat([part.quality for part in self.parts])
        rows = np.flatnonzero((seconds >= since - 1e-6) & (seconds < until - 1e-9))
        return TagHistory(seconds[rows], values.gather(rows), quality.gather(rows))


def parse_item(item: dict[str, Any]) -> tuple[float | str | None, str]:
    """Value and quality of an item; a system state, such as "I/O Timeout", is no value."""
    value = item.get("Value")
    if item.get("Errors"):
        return None, "Bad"
    if isinstance(value, dict):  # a digital state, which the system gives instead of a number where something failed
        name = str(value.get("Name", value.get("Value", "")))
        if value.get("IsSystem") or not item.get("Good", True):
            return None, f"Bad: {name}" if name else "Bad"
        return name, _flags(item)
    if not item.get("Good", True):
        return None, "Bad"
    if isinstance(value, (bool, int, float)):
        return float(value), _flags(item)
    return (None, "Bad") if value is None else (str(value), _flags(item))


def _flags(item: dict[str, Any]) -> str:
    return "Questionable" if item.get("Questionable") else "Substituted" if item.get("Substituted") else "Good"
