"""Time stamps as plants write them, to seconds: dates in any usual form, with or without a zone, or the clock alone.

Time elapsed (``25:00:00``, ``0 days 00:00:02``, minutes and seconds) is on the page `stiction.records.elapsed`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from datetime import UTC, date, datetime, timedelta
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError
from stiction.records.elapsed import is_elapsed, parse_elapsed, run_on
from stiction.records.table import LOOK_AHEAD

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

__all__ = ["Stamps", "is_clock", "is_date", "is_stamp", "parse_texts"]

_BLANKS = r"[^\S\t]*"  # a tab parts cells, and a word in the next cell is no zone
_CLOCK = re.compile(
    r"(\d{1,2}):(\d{2})(?::(\d{2})(?:[.,:](\d+))?)?"
    rf"(?:{_BLANKS}([AaPp])\.?[Mm]\.?)?{_BLANKS}(Z|[A-Z]{{3,4}}|[+-]\d{{2}}(?::?\d{{2}})?)?"
)
_CELL = re.compile(r"(?:([^:]+?)(?:T|[ ,]+|$))?(\d{1,2}:.*)?")
_YMD = re.compile(r"(\d{4})[-/.](\d{1,2})[-/.](\d{1,2})")
_COMPACT = re.compile(r"((?:19|20)\d{2})(\d{2})(\d{2})(?:[T ]?(\d{2})(\d{2})(\d{2}))?Z?")
_NUMBERED = re.compile(r"(\d{1,2})([-/.])(\d{1,2})[-/.](\d{4}|\d{2})")
_DAY_MONTH = re.compile(r"(?:[^\W\d]{2,9}\.?,? +)?(\d{1,2})[-/. ]*([^\W\d]{3,9})\.?[-/. ,]*(\d{4}|\d{2})")
_MONTH_DAY = re.compile(r"(?:[^\W\d]{2,9}\.?,? +)?([^\W\d]{3,9})\.?[-/. ]*(\d{1,2})[-/. ,]+(\d{4}|\d{2})")
_DMY, _MDY, _YMD_SHORT = (2, 1, 0), (2, 0, 1), (0, 1, 2)
_ORDERS = {
    _DMY: ("day before month", "day_first=True"),
    _MDY: ("month before day", "day_first=False"),
    _YMD_SHORT: ("year, month, day", "time_format='%y/%m/%d %H:%M:%S'"),
}
"""Which number of 01/02/26 is year, month and day -> the order in words, and the argument that asks for it."""
_REASONS = ("", "", "the days then follow each other", "the year is then a likely one", "as AM and PM are American")
_LIKELY_DAYS = (14610, 25568)
"""First days of 2010 and 2040 [d since 1970]: where two digits may be the year, the order that ends up between."""
_SHORTEST, _LONGEST = len("1:00"), 60
_MONTHS = {
    **{
        name: i + 1
        for i, name in enumerate(["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"])
    },
    "mär": 3,
    "mai": 5,
    "okt": 10,
    "dez": 12,
    "fév": 2,
    "avr": 4,
    "aoû": 8,
    "déc": 12,
    "mrt": 3,
    "ene": 1,
}
_EPOCH_DAY = date(1970, 1, 1).toordinal()
_TIME = r"\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?(?: ?[AaPp]\.?[Mm]\.?)?"
_HALF_DAY = re.compile(r"\d\s*[AaPp]\.?[Mm]")
_MONTH = r"[^\W\d]{3}"
_REWRITTEN = (
    (
        re.compile(rf"(?:{_MONTH},? )?({_MONTH}) +(\d{{1,2}}) ({_TIME})(?: ([A-Z]{{3,4}}))? (\d{{4}})"),
        r"\1 \2 \5 \3 \4",
    ),
    (re.compile(r"(\d[\d./-]{5,9}) +(\d{1,2})\.(\d{2})\.(\d{2})"), r"\1 \2:\3:\4"),
    (re.compile(r"(\d[\d./-]{5,9}) +(\d{1,2})\.(\d{2})"), r"\1 \2:\3"),
    (re.compile(rf"({_TIME})[ ,]+([^:]{{6,}})"), r"\2 \1"),
)
"""Rarer forms, each with the usual one that says the same: `Sun Feb 01 10:00:00 CET 2026` as Java prints a date,
`01.02.2026 10.00.00`, and the clock before the date."""


@dataclass
class Stamps:
    """Time of each row."""

    seconds: NDArray[np.float64]
    """Seconds since 1970 ("utc", "local") or since some zero ("relative"); NaN where a stamp was not understood."""
    kind: str
    """"utc" (a zone was given), "local" (a wall clock) or "relative"."""
    guesses: list[str] = field(default_factory=list)
    unread: tuple[int, str] | None = None
    """Row and text of the first cell that was not understood."""
    clock_jumps: int = 0
    """Times that the clock jumped, as far as that was mended."""
    summer_time: int = 0
    """How many of them were changes to or from summer time."""
    tick: float = 0.0
    """Step to which serial days are rounded [s]; 0 where none is known."""


def is_clock(cell: str) -> bool:
    """Whether a cell is a time of day."""
    return _CLOCK.fullmatch(cell.strip()) is not None


def is_date(cell: str) -> bool:
    """Whether a cell is a date without a time of day."""
    text = cell.strip()
    return bool(_NUMBERED.fullmatch(text) or _day(text, _DMY) is not None)


def is_stamp(cell: str) -> bool:
    """Whether a cell is a date, a time of day or both, or a time elapsed."""
    text = cell.strip()
    if not _SHORTEST <= len(text) <= _LONGEST:
        return False
    return _is_usual(text) or ((":" in text or " " in text) and (is_elapsed(text) or _rarer(text) is not None))


def _is_usual(text: str) -> bool:
    found = _CELL.fullmatch(text)
    if not found or not text:
        return False
    day, clock = found.groups()
    return (day is None or is_date(day) or _COMPACT.fullmatch(day) is not None) and (clock is None or is_clock(clock))


def _rarer(text: str) -> tuple[re.Pattern[str], str] | None:
    """The rarer form that a cell has, and how it is rewritten."""
    found = ((form.fullmatch(text), form, usual) for form, usual in _REWRITTEN)
    return next(
        ((form, usual) for match, form, usual in found if match and _is_usual(match.expand(usual).strip())), None
    )


def parse_texts(cells: Sequence[str], *, day_first: bool | None = None, time_format: str | None = None) -> Stamps:
    """Seconds of each cell.

    Parameters
    ----------
    cells : sequence of str, shape (n_rows,)
        Stamps as text.
    day_first : bool, optional
        Whether 01/02/2026 is the first of February; found out from the data, or guessed, when not given.
    time_format : str, optional
        A `datetime.strptime` format that all stamps have.

    Raises
    ------
    RecordError
        When `time_format` is no format.

    Examples
    --------
    >>> parse_texts(["2026-02-01T13:00:00Z", "01-Feb-26 13:00:10"]).seconds - 1769950800.0
    array([ 0., 10.])
    """
    if time_format is not None:
        return _parse_format(cells, time_format)
    given = cells
    sample = [text for cell in cells[:LOOK_AHEAD] if not _is_usual(text := cell.strip())]
    if form := next(filter(None, map(_rarer, sample)), None):
        rewrite = re.compile(f"^{form[0].pattern}$")
        cells = [rewrite.sub(form[1], cell.strip()) for cell in cells]
    elif elapsed := parse_elapsed(cells):
        return Stamps(elapsed[0], "relative", [elapsed[1]], _unread(given, elapsed[0]))
    days: dict[str | None, int] = {}
    clocks: dict[str | None, tuple[float, bool]] = {None: (0.0, False)}
    codes = np.empty(len(cells), dtype=np.int64)
    seconds = np.empty(len(cells))
    zoned = 0
    for k, cell in enumerate(cells):
        found = _CELL.fullmatch(cell.strip())
        day, clock = found.groups() if found and cell.strip() else ("no stamp", None)
        codes[k] = days.setdefault(day, len(days))
        if clock not in clocks:
            clocks[clock] = _clock(clock)
        seconds[k], has_zone = clocks[clock]
        zoned += has_zone
    guesses: list[str] = []
    if None in days and len(days) == 1:
        told = ["The time column holds a time of day without a date."]
        return Stamps(run_on(seconds, 86400.0), "relative", told, _unread(given, seconds))
    if day_first is None:
        order = _order([day for day in days if day is not None], clocks, guesses)
    else:
        order = _DMY if day_first else _MDY
    ordinals = [float("nan") if (value := _day(day or "", order)) is None else value for day in days]
    total = np.array(ordinals)[codes] * 86400.0 + seconds
    if (named := _CLOCK.fullmatch(next(filter(None, clocks), ""))) and named[6] and not zoned:
        guesses.append(f"The zone {named[6]} is not looked up: the stamps are taken as a wall clock.")
    if zoned and zoned < (read := int(np.isfinite(total).sum())):
        guesses.append(f"{zoned} of {read} stamps carry a zone; the others are taken as UTC.")
    return Stamps(total, "utc" if zoned else "local", guesses, _unread(given, total))


def _unread(cells: Sequence[str], seconds: NDArray[np.float64]) -> tuple[int, str] | None:
    rows = map(int, np.flatnonzero(np.isnan(seconds)))
    return next(((row, text) for row in rows if (text := cells[row].strip())), None)


def _clock(text: str | None) -> tuple[float, bool]:
    """Seconds since midnight (UTC where a zone was given), and whether there was a zone."""
    found = _CLOCK.fullmatch(text.strip()) if text else None
    if found is None:
        return float("nan"), False
    hour, minute, second, fraction, half, zone = found.groups()
    h = int(hour) % 12 + 12 * (half in "Pp") if half else int(hour)
    if h > 24 or int(minute) > 59 or int(second or 0) > 60:
        return float("nan"), False
    value = 3600.0 * h + 60.0 * int(minute) + int(second or 0) + (float(f"0.{fraction}") if fraction else 0.0)
    if zone is None or (zone.isalpha() and zone not in ("Z", "UTC", "GMT")):
        return value, False
    if not zone.isalpha():
        sign = -1.0 if zone[0] == "-" else 1.0
        value -= sign * (3600.0 * int(zone[1:3]) + 60.0 * int(zone[3:].lstrip(":") or 0))
    return value, True


def _day(text: str, order: tuple[int, int, int]) -> float | None:
    """Days since 1970 of a date; a compact stamp brings its time of day along."""
    clock = 0.0
    if found := _YMD.fullmatch(text):
        year, month, day = map(int, found.groups())
    elif found := _COMPACT.fullmatch(text):
        year, month, day = (int(part) for part in found.groups()[:3])
        if found.group(4):
            clock = (3600 * int(found.group(4)) + 60 * int(found.group(5)) + int(found.group(6))) / 86400.0
    elif found := _NUMBERED.fullmatch(text):
        numbers = found.group(1, 3, 4)
        year, month, day = (int(numbers[place]) for place in order)
    elif found := (_DAY_MONTH.fullmatch(text) or _MONTH_DAY.fullmatch(text)):
        first, second, last = found.groups()
        name, number = (second, first) if first.isdigit() else (first, second)
        year, month, day = int(last), _MONTHS.get(name[:3].lower(), 0), int(number)
    else:
        return None
    if year < 100:
        year += 2000 if year < 70 else 1900
    try:
        return date(year, month, day).toordinal() - _EPOCH_DAY + clock
    except ValueError:
        return None


def _order(days: list[str], clocks: Iterable[str | None], guesses: list[str]) -> tuple[int, int, int]:
    """Settle 01/02/26 from the other dates; where another order would do as well, say that it is a guess."""
    found = [match for day in days if (match := _NUMBERED.fullmatch(day))]
    if not found:
        return _DMY
    texts, pointed = [match.group() for match in found], all(match.group(2) == "." for match in found)
    short = not pointed and all(len(match.group(1)) == len(match.group(4)) == 2 for match in found)
    american = any(clock and _HALF_DAY.search(clock) for clock in clocks)
    ranks: dict[tuple[int, int, int], tuple[float, ...]] = {}
    for order in (_DMY, _MDY, _YMD_SHORT) if short else (_DMY, _MDY):
        values = np.array([np.nan if (value := _day(text, order)) is None else value for text in texts])
        known = values[np.isfinite(values)]
        far = bool(np.any((known < _LIKELY_DAYS[0]) | (known >= _LIKELY_DAYS[1])))
        lost, spread = len(values) - len(known), np.abs(np.diff(known)).sum()
        ranks[order] = (lost, pointed and order != _DMY, spread, far, american and order != _MDY)
    best, second, *_ = sorted(ranks, key=lambda order: ranks[order])
    parted = (reason for a, b, reason in zip(ranks[best], ranks[second], _REASONS, strict=True) if a != b)
    if why := next(parted, "nothing in the file tells"):
        (read, _), (_, remedy) = _ORDERS[best], _ORDERS[second]
        guesses.append(f"Dates such as {texts[0]} are read {read} ({why}); if that is wrong give {remedy}.")
    return best


def _parse_format(cells: Sequence[str], time_format: str) -> Stamps:
    origin = datetime(1970, 1, 1, tzinfo=UTC)
    seconds = np.full(len(cells), np.nan)
    zoned = False
    for k, cell in enumerate(cells):
        try:
            stamp = datetime.strptime(cell.strip(), time_format)
        except ValueError as error:
            if "format" in str(error) and "does not match" not in str(error):
                raise RecordError(f"time_format {time_format!r} is no strptime format ({error}).") from None
            continue
        zoned = zoned or stamp.tzinfo is not None
        stamp = stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)
        seconds[k] = (stamp - origin) / timedelta(seconds=1)
    unread = _unread(cells, seconds)
    if unread and np.isnan(seconds).all():
        raise RecordError(
            f"time_format {time_format!r} does not fit the stamps, such as {unread[1]!r}; "
            "write what they have in the codes of strptime, or leave it out."
        )
    return Stamps(seconds, "utc" if zoned else "local", unread=unread)
