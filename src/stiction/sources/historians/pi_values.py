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

    stamps: list[str] = field(default_factory=list)
    """Time stamps as written."""
    values: list[float | str | None] = field(default_factory=list)
    """Numbers and texts."""
    quality: list[str] = field(default_factory=list)
    """Good, Questionable, Substituted or Bad."""
    at_end: int = 0
    """Values at the last time stamp, which the next page begins with [-]."""

    def add(self, items: Sequence[dict[str, Any]]) -> int:
        """Add a page without the values that are known, and give the number of new ones."""
        new = items
        if self.at_end and items:
            same = 0
            while same < min(self.at_end, len(items)) and items[same]["Timestamp"] == self.stamps[-1]:
                same += 1
            new = items[same:]
        for one in new:
            value, words = parse_item(one)
            self.values.append(value)
            self.quality.append(words)
        self.stamps += [one["Timestamp"] for one in new]
        if new:
            last, count = self.stamps[-1], 0
            while count < len(self.stamps) and self.stamps[-1 - count] == last:
                count += 1
            self.at_end = count
        return len(new)

    def history(self, name: str, since: float, until: float) -> TagHistory:
        """All values from `since` on and before `until` [s].

        Raises
        ------
        RecordError
            When a time stamp cannot be read.
        """
        try:
            seconds = parse_stamps(self.stamps)
        except ValueError as error:
            raise RecordError(f"{error}; check the answer of the server.", where=name) from None
        found = make_history(seconds, self.values, self.quality)
        inside = (found.seconds >= since - 1e-6) & (found.seconds < until - 1e-9)
        if inside.all():
            return found
        rows = np.flatnonzero(inside)
        return TagHistory(found.seconds[rows], found.values.gather(rows), found.quality.gather(rows))


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
