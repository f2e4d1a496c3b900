"""Time stamps as plants write them, to seconds: dates in any usual form, with or without a zone, or the clock alone."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from datetime import UTC, date, datetime, timedelta
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["Stamps", "is_clock", "is_date", "is_stamp", "parse_texts"]

_CLOCK = re.compile(
    r"(\d{1,2}):(\d{2})(?::(\d{2})(?:[.,:](\d+))?)?(?:\s*([AaPp])\.?[Mm]\.?)?\s*(Z|[A-Z]{3,4}|[+-]\d{2}(?::?\d{2})?)?"
)
_CELL = re.compile(r"(?:([^:]+?)(?:T|[ ,]+|$))?(\d{1,2}:.*)?")
_YMD = re.compile(r"(\d{4})[-/.](\d{1,2})[-/.](\d{1,2})")
_COMPACT = re.compile(r"((?:19|20)\d{2})(\d{2})(\d{2})(?:T?(\d{2})(\d{2})(\d{2}))?Z?")
_DMY = re.compile(r"(\d{1,2})([-/.])(\d{1,2})[-/.](\d{4}|\d{2})")
_DAY_MONTH = re.compile(r"(?:[^\W\d]{2,9}\.?,? +)?(\d{1,2})[-/. ]*([^\W\d]{3,9})\.?[-/. ,]*(\d{4}|\d{2})")
_MONTH_DAY = re.compile(r"(?:[^\W\d]{2,9}\.?,? +)?([^\W\d]{3,9})\.?[-/. ]*(\d{1,2})[-/. ,]+(\d{4}|\d{2})")
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


@dataclass
class Stamps:
    """Time of each row."""

    seconds: NDArray[np.float64]
    """Seconds since 1970 ("utc", "local") or since some zero ("relative"); NaN where a stamp was not understood."""
    kind: str
    """"utc" (a zone was given), "local" (a wall clock) or "relative"."""
    guesses: list[str] = field(default_factory=list)


def is_clock(cell: str) -> bool:
    """Whether a cell is a time of day."""
    return _CLOCK.fullmatch(cell.strip()) is not None


def is_date(cell: str) -> bool:
    """Whether a cell is a date without a time of day."""
    text = cell.strip()
    return bool(_DMY.fullmatch(text) or _day(text, day_first=True) is not None)


def is_stamp(cell: str) -> bool:
    """Whether a cell is a date, a time of day or both."""
    found = _CELL.fullmatch(cell.strip())
    if not found or not cell.strip():
        return False
    day, clock = found.groups()
    return (day is None or is_date(day) or _COMPACT.fullmatch(day) is not None) and (clock is None or is_clock(clock))


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
        return Stamps(_unwrap(seconds), "relative", ["The time column holds a time of day without a date."])
    if day_first is None:
        day_first = _day_first([day for day in days if day is not None], guesses)
    ordinals = [float("nan") if (value := _day(day or "", day_first)) is None else value for day in days]
    total = np.array(ordinals)[codes] * 86400.0 + seconds
    if zoned and zoned < len(cells):
        guesses.append(f"{zoned} of {len(cells)} stamps carry a zone; the others are taken as UTC.")
    return Stamps(total, "utc" if zoned else "local", guesses)


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


def _day(text: str, day_first: bool) -> float | None:
    """Days since 1970 of a date; a compact stamp brings its time of day along."""
    clock = 0.0
    if found := _YMD.fullmatch(text):
        year, month, day = map(int, found.groups())
    elif found := _COMPACT.fullmatch(text):
        year, month, day = (int(part) for part in found.groups()[:3])
        if found.group(4):
            clock = (3600 * int(found.group(4)) + 60 * int(found.group(5)) + int(found.group(6))) / 86400.0
    elif found := _DMY.fullmatch(text):
        first, _, second, last = found.groups()
        year = int(last)
        day, month = (int(first), int(second)) if day_first else (int(second), int(first))
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


def _day_first(days: list[str], guesses: list[str]) -> bool:
    """Settle 01/02/2026 from the other dates; where nothing tells, say that it is a guess."""
    found = [match for day in days if (match := _DMY.fullmatch(day))]
    if not found or any(int(match.group(1)) > 12 for match in found):
        return True
    if any(int(match.group(3)) > 12 for match in found):
        return False
    if all(match.group(2) == "." for match in found):
        return True
    texts = [match.group() for match in found]
    spread = {first: np.abs(np.diff([_day(text, first) or 0.0 for text in texts])).sum() for first in (True, False)}
    choice = bool(spread[True] <= spread[False])
    why = "the days then follow each other" if spread[True] != spread[False] else "nothing in the file tells"
    order, argument = ("day before month", "False") if choice else ("month before day", "True")
    guesses.append(f"Dates such as {texts[0]} are read {order} ({why}); if that is wrong give day_first={argument}.")
    return choice


def _unwrap(seconds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Let a time of day run on over midnight."""
    backward = np.diff(seconds, prepend=seconds[:1]) < -43200.0
    return seconds + 86400.0 * np.cumsum(backward)


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
    return Stamps(seconds, "utc" if zoned else "local")
