"""One time stamp as text: is it one, which day does it name, and how rarer forms are written in the usual one."""

from __future__ import annotations

import math
import re
from datetime import date
from functools import lru_cache
from typing import NamedTuple

from stiction.sources.time.elapsed_time import is_elapsed_time
from stiction.sources.time.months import month_number

__all__ = [
    "CLOCK",
    "DAY_MONTH_YEAR",
    "MONTH_DAY_YEAR",
    "NUMBERED_DATE",
    "REWRITES",
    "YEAR_MONTH_DAY",
    "DayText",
    "clock_seconds",
    "is_clock",
    "is_date",
    "is_timestamp",
    "parse_day",
    "rewrite",
]

DAY_MONTH_YEAR, MONTH_DAY_YEAR, YEAR_MONTH_DAY = (2, 1, 0), (2, 0, 1), (0, 1, 2)
"""Which number of 01/02/26 is the year, the month and the day."""

CLOCK = r"\d{1,2}:\d{2}(?::\d{2}(?:\.\d+)?)?(?: ?[AaPp][Mm])?"
"""A time of day in a rewritten cell."""
REWRITES = (
    (r"[\u00a0\u202f\u2009]", " "),  # spaces that do not break
    (r"^=?[\"'](.*?)[\"']?$", "${1}"),  # a spreadsheet's text
    (r"^(\d[\d./-]{5,10}),? +(\d{1,2})\.(\d{2})\.(\d{2})$", "${1} ${2}:${3}:${4}"),
    (r"^(\d[\d./-]{5,10}),? +(\d{1,2})\.(\d{2})$", "${1} ${2}:${3}"),
    (r"(:\d{2}:\d{2})[,:](\d)", "${1}.${2}"),
    (r"(:\d{2}(?:\.\d+)?) *([AaPp])(?:\. ?[Mm]\.?| [Mm]\.)", "${1} ${2}m"),
    (r"(:\d{2}(?:\.\d+)?(?: ?[AaPp][Mm])?) ?(?:UTC|GMT|Z)$", "${1}Z"),
    (r"(:\d{2}(?:\.\d+)?(?: ?[AaPp][Mm])?) ?(?:UTC|GMT)?([+-]\d{2}):?(\d{2})?(?: ?\([^)]*\))?$", "${1}${2}:${3}"),
    (r"(:\d{2}(?:\.\d+)?(?: ?[AaPp][Mm])?[+-]\d{2}):$", "${1}:00"),
)
"""Rarer forms of a cell, as regular expressions of Rust and Python, each with the usual form, in this order."""
_COMPILED = tuple((re.compile(form), usual.replace("${", "\\g<").replace("}", ">")) for form, usual in REWRITES)
NUMBERED_DATE = re.compile(r"(\d{1,2})([-/.])(\d{1,2})[-/.](\d{4}|\d{2})")
_CLOCK = re.compile(CLOCK)
_CLOCK_PARTS = re.compile(r"(\d{1,2}):(\d{2})(?::(\d{2})(?:\.(\d+))?)?(?: ?([AaPp])[Mm])?")
_CLOCK_CELL = re.compile(rf"{CLOCK} ?(?:Z|[A-Z]{{3,4}}|[+-]\d{{2}}:\d{{2}})?")
_YMD = re.compile(r"(\d{4})[-/.](\d{1,2})[-/.](\d{1,2})")
_COMPACT = re.compile(r"((?:19|20)\d{2})(\d{2})(\d{2})(?:[T ]?(\d{2})(\d{2})(\d{2}))?Z?")
_DAY_OF_YEAR = re.compile(r"(\d{4})[-/. ]([0-3]\d{2})")
_DAY_MONTH = re.compile(r"(?:[^\W\d]{2,12}\.?,? +)?(\d{1,2})[-/. ]*([^\W\d]{3,11})\.?[-/. ,]*(\d{4}|\d{2})")
_MONTH_DAY = re.compile(r"(?:[^\W\d]{2,12}\.?,? +)?([^\W\d]{3,11})\.?[-/. ]*(\d{1,2})[-/. ,]+(\d{4}|\d{2})")
_FILLER = re.compile(r"\b(?:de|den|um|at|klo?|uhr|a las|alle|om)\b\.?", re.IGNORECASE)
_ZONE = re.compile(r"@ ?(?:([+-])(\d{2}):(\d{2})|(Z|[A-Z]{3,5})\b)?")
_MIN_LENGTH, _MAX_LENGTH = len("1:00"), 60
_EPOCH_DAY = date(1970, 1, 1).toordinal()


class DayText(NamedTuple):
    """What stands beside the time of day."""

    day: float
    """Days since 1970; NaN when not understood."""
    offset: float | None
    """Clock minus UTC [s]; None when the cell names none."""
    zone: str
    """Abbreviation of a zone that is not looked up, such as CET; empty when there is none."""


def rewrite(cell: str) -> str:
    """Return a cell in the usual form where it has a rarer one.

    Examples
    --------
    >>> rewrite('="2026-11-21 14:03:05"'), rewrite("01.02.2026 10.00.00"), rewrite("1/2/2026 9:00 p. m.")
    ('2026-11-21 14:03:05', '01.02.2026 10:00:00', '1/2/2026 9:00 pm')
    """
    text = cell.strip()
    for form, usual in _COMPILED:
        text = form.sub(usual, text)
    return text


def parse_day(text: str, order: tuple[int, int, int]) -> DayText:
    """Parse what stands beside the time of day of a rewritten cell; `@` marks the place of the time.

    Examples
    --------
    >>> parse_day("Sun Feb 01 @ CET 2026", DAY_MONTH_YEAR), parse_day("2026-325T@Z", DAY_MONTH_YEAR).day
    (DayText(day=20485.0, offset=None, zone='CET'), 20778.0)
    """
    offset, zone, day = None, "", text
    if found := _ZONE.search(text):
        sign, hours, minutes, name = found.groups()
        is_month = bool(name) and month_number(name) > 0
        if sign:
            offset = float(f"{sign}1") * (3600.0 * int(hours) + 60.0 * int(minutes))
        elif name in ("Z", "UTC", "GMT"):
            offset = 0.0
        elif name and not is_month:
            zone = name
        day = f"{text[: found.start()].rstrip()} {text[found.start() + 1 if is_month else found.end() :].lstrip()}"
    if day[:1].isalpha() or " " in day:
        day = " ".join(_FILLER.sub(" ", day).split())
    day = re.sub(r"(?<=\d)T$", "", day.strip(" ,"))
    value = _days_since_1970(day, order)
    if offset is None and value is not None and day.endswith("Z"):
        offset = 0.0
    return DayText(float("nan") if value is None else value, offset, zone)


def _days_since_1970(text: str, order: tuple[int, int, int]) -> float | None:
    clock = 0.0
    if found := _YMD.fullmatch(text):
        year, month, day = map(int, found.groups())
    elif found := _COMPACT.fullmatch(text):
        year, month, day = (int(part) for part in found.groups()[:3])
        if found.group(4):
            clock = (3600 * int(found.group(4)) + 60 * int(found.group(5)) + int(found.group(6))) / 86400.0
    elif found := NUMBERED_DATE.fullmatch(text):
        numbers = found.group(1, 3, 4)
        year, month, day = _full_year(numbers[order[0]]), int(numbers[order[1]]), int(numbers[order[2]])
    elif found := _DAY_OF_YEAR.fullmatch(text):
        year, number = map(int, found.groups())
        return date(year, 1, 1).toordinal() + number - 1.0 - _EPOCH_DAY if year and 1 <= number <= 366 else None
    elif found := (_DAY_MONTH.fullmatch(text) or _MONTH_DAY.fullmatch(text)):
        first, second, last = found.groups()
        name, number = (second, first) if first.isdigit() else (first, second)
        year, month, day = _full_year(last), month_number(name), int(number)
    else:
        return None
    try:
        return date(year, month, day).toordinal() - _EPOCH_DAY + clock
    except ValueError:
        return None


def _full_year(text: str) -> int:
    return int(text) + (0 if len(text) > 2 else 2000 if int(text) < 70 else 1900)


def clock_seconds(text: str) -> float:
    """Return the seconds since midnight of a time of day, NaN when it is none.

    Examples
    --------
    >>> clock_seconds("1:00:00.5 pm"), clock_seconds("24:00"), clock_seconds("10:61")
    (46800.5, 86400.0, nan)
    """
    found = _CLOCK_PARTS.fullmatch(text)
    if found is None:
        return float("nan")
    hour, minute, second, fraction, half = found.groups()
    h = int(hour) % 12 + 12 * (half in "Pp") if half else int(hour)
    if h > 24 or int(minute) > 59 or int(second or 0) > 60:
        return float("nan")
    return 3600.0 * h + 60.0 * int(minute) + int(second or 0) + (float(f"0.{fraction}") if fraction else 0.0)


def is_clock(cell: str) -> bool:
    """Whether a cell is a time of day.

    Examples
    --------
    >>> is_clock("13:00:05,2"), is_clock("2026-02-01")
    (True, False)
    """
    return ":" in cell and _CLOCK_CELL.fullmatch(rewrite(cell)) is not None


def is_date(cell: str) -> bool:
    """Whether a cell is a date without a time of day.

    Examples
    --------
    >>> is_date("1. helmikuuta 2026"), is_date("31/12/26"), is_date("2026.325"), is_date("3.5")
    (True, True, True, False)
    """
    return len(cell) <= _MAX_LENGTH and any(map(str.isdigit, cell)) and _is_day(rewrite(cell))


def _is_day(text: str) -> bool:
    return bool(NUMBERED_DATE.fullmatch(text)) or math.isfinite(parse_day(text, DAY_MONTH_YEAR).day)


def is_timestamp(cell: str) -> bool:
    """Whether a cell is a date, a time of day or both, or a time elapsed; a number is one only as yyyymmdd.

    Examples
    --------
    >>> is_timestamp("21-Nov-26 14:03:05"), is_timestamp("25:00:00"), is_timestamp("FIC-101"), is_timestamp("3.5")
    (True, True, False, False)
    """
    text = cell.strip()
    if not _MIN_LENGTH <= len(text) <= _MAX_LENGTH:
        return False
    try:
        float(text)
    except ValueError:
        return any(map(str.isdigit, text)) and _is_stamp_text(text)
    return len(text) >= len("20260201") and _COMPACT.fullmatch(text) is not None


@lru_cache(maxsize=4096)
def _is_stamp_text(text: str) -> bool:
    text = rewrite(text)
    found = _CLOCK.search(text)
    if found is None:
        return _is_day(text)
    rest = f"{text[: found.start()]}@{text[found.end() :]}"
    is_bare_clock = is_elapsed_time(text) or _CLOCK_CELL.fullmatch(text) is not None
    return is_bare_clock or bool(NUMBERED_DATE.fullmatch(_ZONE.sub(" ", rest).strip(" ,T"))) or _is_day(rest)
