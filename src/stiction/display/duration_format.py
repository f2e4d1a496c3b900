"""Durations and times as text."""

from __future__ import annotations

import math
from datetime import datetime

from stiction.display.number_format import format_number

__all__ = ["format_duration", "format_seconds", "format_time", "time_unit"]


def format_seconds(duration: float) -> str:
    """Return a duration [s] for a sentence: as `format_duration`, with an ordinary space.

    Examples
    --------
    >>> format_seconds(95.25), format_seconds(0.123456), format_seconds(43200.0)
    ('95.2 s', '0.123 s', '12 h')
    """
    return format_duration(duration).replace("\u00a0", " ")


def format_duration(seconds: float) -> str:
    r"""Return a duration [s] in the unit a person would use.

    Examples
    --------
    >>> format_duration(95.0), format_duration(600.0), format_duration(86400.0), format_duration(float("nan"))
    ('95\xa0s', '10\xa0min', '24\xa0h', '–')
    """
    if not math.isfinite(seconds):
        return "–"
    name, size = time_unit(seconds)
    return format_number(seconds / size, name)


def time_unit(seconds: float) -> tuple[str, float]:
    """Return name and length [s] of the unit for a duration [s]: s, min, h or d."""
    for name, size, least in (("d", 86400.0, 3 * 86400.0), ("h", 3600.0, 7200.0), ("min", 60.0, 120.0)):
        if seconds >= least:
            return name, size
    return "s", 1.0


def format_time(time: datetime | str | None, *, local: bool = False) -> str:
    """Return a time as text with its time zone, where that is known; empty without a time.

    `time`: the time, or its text in the form of ISO 8601. Returns date, clock time of 24 hours to the minute, or to the
    second where it is not a whole minute, and the zone. `local`: in the zone of this computer, where the zone of the
    time is known.

    Examples
    --------
    >>> format_time("2026-11-28T09:09:28+00:00"), format_time(datetime(2026, 3, 2, 6)), format_time(None)
    ('2026-11-28 09:09:28 UTC', '2026-03-02 06:00', '')
    """
    if not time:
        return ""
    moment = datetime.fromisoformat(time) if isinstance(time, str) else time
    if local and moment.tzinfo is not None:
        moment = moment.astimezone()
    clock = "%H:%M:%S" if moment.second else "%H:%M"
    return f"{moment:%Y-%m-%d {clock} %Z}".strip()
