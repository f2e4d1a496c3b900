"""One time stamp as text: is it one, which day does it name, and how rarer forms are written in the usual one."""

from __future__ import annotations

import math
import re
import unicodedata
from datetime import datetime
from functools import lru_cache

from stiction.sources.roles.vocabulary import MONTHS

__all__ = ["CLOCK", "ELAPSED", "NUMBERED", "REWRITES", "is_clock", "is_date", "is_timestamp", "parse_day", "rewrite"]

CLOCK = r"(?P<hour>\d{1,2}):(?P<minute>\d{2})(?::(?P<second>\d{2}(?:\.\d+)?))?(?: ?(?P<half>[AaPp])[Mm])?"
"""A time of day in a rewritten cell."""
ELAPSED = (
    r"^(?:(?P<day>\d+) days?,? *)?(?P<hour>\d{1,5}):(?P<minute>\d{2}):(?P<second>\d{2}(?:[.,]\d+)?)$",
    r"^(?P<minute>\d{1,3}):(?P<second>\d{2}[.,]\d+)$",
)
"""Time elapsed: ``25:00:00`` or ``0 days 00:00:02`` of pandas, and ``00:02.0`` of Excel."""
_SECOND = r"(:\d{2}(?:\.\d+)?(?: ?[AaPp][Mm])?)"
REWRITES = (
    (r"[\u00a0\u202f\u2009]", " "),  # spaces that do not break
    (r"^=?[\"'](.*?)[\"']?$", "${1}"),  # a spreadsheet's text
    (r"^(\d[\d./-]{5,10}),? +(\d{1,2})\.(\d{2})\.(\d{2})$", "${1} ${2}:${3}:${4}"),
    (r"^(\d[\d./-]{5,10}),? +(\d{1,2})\.(\d{2})$", "${1} ${2}:${3}"),
    (r"(:\d{2}:\d{2})[,:](\d)", "${1}.${2}"),
    (r"^(\d{1,2}:\d{2}:\d{2});(\d{3})$", "${1}.${2}"),
    (r"(:\d{2}(?:\.\d+)?) *([AaPp])(?:\. ?[Mm]\.?| [Mm]\.)", "${1} ${2}m"),
    (_SECOND + r" ?(?:UTC|GMT|Z)$", "${1}Z"),
    (_SECOND + r" ?(?:UTC|GMT)?([+-]\d{2})(?: ?\([^)]*\))?$", "${1}${2}:00"),
    (_SECOND + r" ?(?:UTC|GMT)?([+-]\d{2}):?(\d{2})(?: ?\([^)]*\))?$", "${1}${2}:${3}"),
)
"""Rarer forms of a cell, as regular expressions of Rust and Python, each with the usual form, in this order."""
_REWRITES = tuple((re.compile(form), usual.replace("${", "\\g<").replace("}", ">")) for form, usual in REWRITES)

_NUMBERS = {"d": r"(?P<day>\d{1,2})", "m": r"(?P<month>\d{1,2})", "y": r"(?P<year>\d{4}|\d{2})"}
NUMBERED = {order: re.compile("[-/.]".join(_NUMBERS[part] for part in order)) for order in ("dmy", "mdy", "ymd")}
"""Order of day, month and year in a date such as 01/02/26 -> its form."""
_WEEKDAY, _NAME = r"(?:[^\W\d]{2,12}\.?,? +)?", r"(?P<name>[^\W\d]{3,11})\.?"
_COMPACT = re.compile(
    r"(?P<year>(?:19|20)\d{2})(?P<month>\d{2})(?P<day>\d{2})"
    r"(?:[T ]?(?P<hour>\d{2})(?P<minute>\d{2})(?P<second>\d{2}))?(?P<zone>Z?)"
)
_DAYS = (
    NUMBERED["ymd"],
    _COMPACT,
    re.compile(r"(?P<year>\d{4})[-/. ](?P<number>[0-3]\d{2})"),
    re.compile(rf"{_WEEKDAY}{_NUMBERS['d']}[-/. ]*{_NAME}[-/. ,]*{_NUMBERS['y']}"),
    re.compile(rf"{_WEEKDAY}{_NAME}[-/. ]*{_NUMBERS['d']}[-/. ,]+{_NUMBERS['y']}"),
)
_FILLER = re.compile(r"\b(?:de|den|um|at|klo?|uhr|a las|alle|om)\b\.?", re.IGNORECASE)
_ZONE = re.compile(r"@ ?(?:(?P<sign>[+-])(?P<hours>\d{2}):(?P<minutes>\d{2})|(?P<name>Z|[A-Z]{3,5})\b)?")
_CLOCK_CELL = re.compile(rf"{CLOCK} ?(?:Z|[A-Z]{{3,4}}|[+-]\d{{2}}:\d{{2}})?")


def rewrite(cell: str) -> str:
    """Return a cell in the usual form where it has a rarer one."""
    text = cell.strip()
    for form, usual in _REWRITES:
        text = form.sub(usual, text)
    return text


@lru_cache
def _month_number(name: str) -> int:
    """Return the month (1 to 12) of a name, or of three or more letters that begin one name only; 0 for no month."""
    letters = re.sub(r"[^a-z]", "", unicodedata.normalize("NFKD", name.lower()))
    for months in MONTHS if len(letters) > 2 else ():
        numbers = [number for number, month in enumerate(months, 1) if month.startswith(letters)]
        if len(numbers) == 1:
            return numbers[0]
    return 0


def parse_day(text: str, order: str) -> tuple[float, str]:
    """Seconds since 1970 [s] of a cell with `@` for the time, NaN if no day, and its zone: UTC, as "CET", or empty."""
    zone, offset, form_match = "", 0.0, _ZONE.search(text)
    if form_match and not _month_number(form_match["name"] or ""):
        zone = form_match["name"] or ""
        if form_match["sign"] or zone in ("Z", "GMT"):
            zone = "UTC"
        if form_match["sign"]:
            offset = float(form_match["sign"] + "60") * (60 * int(form_match["hours"]) + int(form_match["minutes"]))
        text = _ZONE.sub(" ", text)
    text = " ".join(_FILLER.sub(" ", text.replace("@", " ")).split()).strip(" ,")
    text = re.sub(r"(?<=\d)T$", "", text)
    form_match = next(filter(None, (form.fullmatch(text) for form in (NUMBERED[order], *_DAYS))), None)
    if form_match is None:
        return math.nan, zone
    part = form_match.groupdict()
    year = int(part["year"]) + (0 if len(part["year"]) > 2 else 2000 if int(part["year"]) < 70 else 1900)
    try:
        if "number" in part:
            moment = datetime.strptime(f"{year:04d} {part['number']}", "%Y %j")
        else:
            month = _month_number(part["name"]) if "name" in part else int(part["month"])
            hour, minute, second = (int(part.get(name) or 0) for name in ("hour", "minute", "second"))
            moment = datetime(year, month, int(part["day"]), hour, minute, second)
    except ValueError:
        return math.nan, zone
    return (moment - datetime(1970, 1, 1)).total_seconds() - offset, zone or ("UTC" if part.get("zone") else "")


def is_clock(cell: str) -> bool:
    """Whether a cell is a time of day."""
    return ":" in cell and _CLOCK_CELL.fullmatch(rewrite(cell)) is not None


def is_date(cell: str) -> bool:
    """Whether a cell is a date without a time of day."""
    return len(cell) <= 60 and any(map(str.isdigit, cell)) and _is_day(rewrite(cell))


def _is_day(text: str) -> bool:
    return any(math.isfinite(parse_day(text, order)[0]) for order in NUMBERED)


def is_timestamp(cell: str) -> bool:
    """Whether a cell is a date, a time of day or both, or a time elapsed; a number is one only as yyyymmdd."""
    text = cell.strip()
    if not len("1:00") <= len(text) <= 60:
        return False
    try:
        float(text)
    except ValueError:
        return any(map(str.isdigit, text)) and _is_stamp_text(text)
    return len(text) >= len("20260201") and _COMPACT.fullmatch(text) is not None


@lru_cache(maxsize=4096)
def _is_stamp_text(text: str) -> bool:
    text = rewrite(text)
    is_bare_clock = _CLOCK_CELL.fullmatch(text) or any(re.match(form, text) for form in ELAPSED)
    return bool(is_bare_clock) or _is_day(re.sub(CLOCK, "@", text, count=1))
