"""Durations and moments that a user writes as text."""

from __future__ import annotations

import math
import re
from datetime import datetime

from stiction.errors import ParameterError, Setting

__all__ = ["parse_duration", "parse_moment"]

SECONDS = {"s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0, "d": 86400.0, "": 1.0}


def parse_duration(name: str, value: str | float) -> float:
    """Read a duration such as "10m", "1.5h" or 600 [s].

    Examples
    --------
    >>> [parse_duration("budget", text) for text in ("10m", "1.5 h", 30)]
    [600.0, 5400.0, 30.0]
    """
    found = re.fullmatch(r"\s*([0-9.]+)\s*([a-z]*)\s*", str(value).lower())
    try:
        seconds = float(found[1]) * SECONDS[found[2]] if found else math.nan
    except (KeyError, ValueError):
        seconds = math.nan
    if not 0.0 < seconds < math.inf:
        raise ParameterError(
            Setting(name), f" = {value!r} is not a duration", remedy="give for example 10m, 90s or 1.5h"
        )
    return seconds


def parse_moment(name: str, value: str | datetime | None) -> datetime | None:
    """Read a moment as ISO 8601.

    Examples
    --------
    >>> parse_moment("since", "2026-03-02T06:00")
    datetime.datetime(2026, 3, 2, 6, 0)
    """
    if value is None or isinstance(value, datetime):
        return value
    try:
        return datetime.fromisoformat(value)
    except (TypeError, ValueError):
        raise ParameterError(
            Setting(name), f" = {value!r} is not a time", remedy="write it as 2026-03-02 or 2026-03-02T06:00"
        ) from None
