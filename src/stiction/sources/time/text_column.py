"""A column of time stamps as text to seconds: one format for the whole column, and what is left by distinct text."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError
from stiction.sources.table import SNIFF_ROWS
from stiction.sources.time.date_order import choose_date_order
from stiction.sources.time.elapsed_time import parse_elapsed_time, unwrap_clock
from stiction.sources.time.stamps import Stamps
from stiction.sources.time.text_stamps import (
    CLOCK,
    DAY_MONTH_YEAR,
    MONTH_DAY_YEAR,
    REWRITES,
    clock_seconds,
    parse_day,
    rewrite,
)

if TYPE_CHECKING:
    import polars as pl
    from numpy.typing import NDArray

    Order = tuple[int, int, int]

__all__ = ["parse_text_stamps"]

_USUAL = re.compile(
    r"(?:(?P<ymd>\d{4}(?P<a>[-/.])\d{1,2}(?P=a)\d{1,2})|(?P<numbered>\d{1,2}(?P<b>[-/.])\d{1,2}(?P=b)(?P<year>\d{4}|\d{2}))"
    r"|(?P<named>\d{1,2}(?P<c>[-/ ])[A-Z][A-Za-z]{2}(?P=c)(?P<short>\d{4}|\d{2})))"
    r"(?P<between>[T ])(?P<clock>\d{1,2}:\d{2}(?P<second>:\d{2}(?:\.\d+)?)?)(?P<half> ?[AaPp][Mm])?"
    r"(?P<zone>Z|[+-]\d{2}:\d{2})?"
)
_COMPACT = re.compile(r"(?:19|20)\d{6}(?P<between>[T ]?)\d{6}(?P<zone>Z?)")
_NUMBERED = r"\b(\d{1,2}[-/.]\d{1,2}[-/.](?:\d{4}|\d{2}))\b"
_ORDER_CODES = {DAY_MONTH_YEAR: ("%d", "%m", "%Y"), MONTH_DAY_YEAR: ("%m", "%d", "%Y"), (0, 1, 2): ("%Y", "%m", "%d")}
_MAX_PYTHON_CLOCKS = 200
"""Distinct times of day up to which a loop in Python is faster than formats in polars [-]."""


def parse_text_stamps(cells: pl.Series, *, day_first: bool | None = None, time_format: str | None = None) -> Stamps:
    """Parse a column of dates with or without a zone, of times of day, or of elapsed times.

    `day_first` tells whether 01/02/2026 is the first of February; when None, the other dates tell, or it is assumed.

    Raises
    ------
    RecordError
        When `time_format` is no format of `datetime.strptime`, or fits no stamp.

    Examples
    --------
    >>> import polars as pl
    >>> parse_text_stamps(pl.Series(["2026-02-01T13:00:00Z", "01-Feb-26 13:00:10"])).seconds - 1769950800.0
    array([ 0., 10.])
    """
    sample = [text for cell in cells.head(SNIFF_ROWS).unique(maintain_order=True) if cell and (text := cell.strip())]
    if time_format is not None:
        return _parse_format(cells, sample, time_format)
    plain = _rewrite_column(cells, sample)
    if elapsed := parse_elapsed_time(plain, [rewrite(cell) for cell in sample]):
        return Stamps(elapsed[0], "relative", [elapsed[1]], _first_unread(cells, elapsed[0]))
    given = None if day_first is None else (DAY_MONTH_YEAR if day_first else MONTH_DAY_YEAR)
    notes: list[str] = []
    seconds, has_zone, order = _parse_usual(plain, next(map(rewrite, sample), ""), given, notes)
    left = np.flatnonzero(np.isnan(seconds))
    if left.size:
        rest = plain if left.size == len(plain) else plain.gather(left)
        if not (rest.is_null() | (rest == "")).all():
            seconds[left], has_zone[left], clock_only = _parse_parts(rest, order, notes)
            if clock_only and left.size == len(plain):
                note = "The time column holds a time of day without a date."
                return Stamps(unwrap_clock(seconds, 86400.0), "relative", [note], _first_unread(cells, seconds))
    n_zoned, n_read = int(has_zone.sum()), int(np.isfinite(seconds).sum())
    if 0 < n_zoned < n_read:
        notes.append(f"{n_zoned} of {n_read} stamps carry a zone; the others are taken as UTC.")
    return Stamps(seconds, "utc" if n_zoned else "local", notes, _first_unread(cells, seconds))


def _rewrite_column(cells: pl.Series, sample: list[str]) -> pl.Series:
    """Write rarer forms as usual ones, as far as the first cells have them."""
    for form, usual in REWRITES:
        written = [re.sub(form, usual.replace("${", "\\g<").replace("}", ">"), cell) for cell in sample]
        if written != sample:
            cells = cells.str.replace_all(form, usual) if form.startswith("[") else cells.str.replace(form, usual)
            sample = written
    return cells


def _parse_usual(
    cells: pl.Series, first: str, order: Order | None, notes: list[str]
) -> tuple[NDArray[np.float64], NDArray[np.bool_], Order | None]:
    """Parse the cells that have the form of the first one: seconds, which have a zone, and the order of the date."""
    found = _USUAL.fullmatch(first)
    if found and found["numbered"] and order is None:
        # The day is within the first ten characters, and these take few values.
        days = cells.str.slice(0, 10).unique(maintain_order=True).str.extract(_NUMBERED).drop_nulls()
        order = choose_date_order(days.unique(maintain_order=True).to_list(), bool(found["half"]), notes)
    if compact := _COMPACT.fullmatch(first):
        form = f"%Y%m%d{compact['between']}%H%M%S{compact['zone']}"
    elif found:
        form = _format_of(found, order or DAY_MONTH_YEAR)
    else:
        return np.full(len(cells), np.nan), np.zeros(len(cells), dtype=bool), order
    seconds = _to_seconds(cells, form)
    return seconds, np.isfinite(seconds) & form.endswith(("Z", "z")), order


def _format_of(found: re.Match[str], order: Order) -> str:
    """Give the format of polars for a stamp in the usual form."""
    mark = found["a"] or found["b"] or found["c"]
    codes = _ORDER_CODES[order] if found["numbered"] else ("%d", "%b", "%Y") if found["named"] else ("%Y", "%m", "%d")
    day = mark.join(codes)
    if len(found["year"] or found["short"] or "2026") == 2:
        day = day.replace("%Y", "%y")
    half = found["half"] or ""
    clock = ("%I" if half else "%H") + ":%M" + (":%S%.f" if found["second"] else "")
    zone = {"": "", "Z": "Z"}.get(found["zone"] or "", "%:z")
    return day + found["between"] + clock + half[:-2] + ("%p" if half else "") + zone


def _to_seconds(cells: pl.Series, text: str) -> NDArray[np.float64]:
    """Parse cells by a format of polars; NaN where one does not have it."""
    parsed = cells.str.to_datetime(text, time_unit="us", strict=False)
    return parsed.dt.epoch("us").cast(float).to_numpy() / 1e6


def _parse_parts(
    cells: pl.Series, order: Order | None, notes: list[str]
) -> tuple[NDArray[np.float64], NDArray[np.bool_], bool]:
    """Take the time of day out of each cell and parse each distinct rest; tell whether no cell has a date."""
    clocks = cells.str.extract(f"({CLOCK})")
    days, day_codes = _distinct(cells.str.replace(CLOCK, "@").str.strip_chars())
    if order is None:
        texts = cells.str.extract(_NUMBERED).drop_nulls().unique(maintain_order=True).to_list()
        has_am_pm = bool(clocks.head(SNIFF_ROWS).str.contains("(?i)m$").any())
        order = choose_date_order(texts, has_am_pm, notes)
    parts = [parse_day(day, order) for day in days]
    if all(day == "@" for day in days if day):
        return _parse_clocks(clocks), np.zeros(len(cells), dtype=bool), True
    if zone := next((part.zone for part in parts if part.zone), ""):
        notes.append(f"The zone {zone} is not looked up: the stamps are taken as a wall clock.")
    day = np.array([part.day for part in parts])[day_codes]
    offset = np.array([np.nan if part.offset is None else part.offset for part in parts])[day_codes]
    clock = np.where(clocks.is_null().to_numpy(), 0.0, _parse_clocks(clocks))
    seconds = day * 86400.0 + clock - np.nan_to_num(offset)
    return seconds, np.isfinite(seconds) & np.isfinite(offset), False


def _distinct(cells: pl.Series) -> tuple[list[str], NDArray[np.int64]]:
    """Give the distinct texts of a column, and which of them stands in each row."""
    texts = cells.fill_null("")
    return texts.unique().sort().to_list(), texts.rank("dense").to_numpy().astype(np.int64) - 1


def _parse_clocks(clocks: pl.Series) -> NDArray[np.float64]:
    """Parse times of day [s]; NaN where there is none."""
    seconds = np.full(len(clocks), np.nan)
    dated = "1970-01-01 " + clocks
    if len(clocks) > _MAX_PYTHON_CLOCKS:
        first = clocks.drop_nulls().head(1).to_list()
        half = (" %p" if " " in first[0] else "%p") if first and first[0][-1:] in "mM" else ""
        hour = "%I" if half else "%H"
        seconds = _to_seconds(dated, f"%Y-%m-%d {hour}:%M{':%S%.f' if first and first[0].count(':') > 1 else ''}{half}")
    left = np.flatnonzero(np.isnan(seconds) & clocks.is_not_null().to_numpy())
    if left.size:
        texts, codes = _distinct(clocks.gather(left))
        seconds[left] = np.array([clock_seconds(text) for text in texts])[codes]
    return seconds


def _first_unread(cells: pl.Series, seconds: NDArray[np.float64]) -> tuple[int, str] | None:
    """Row and text of the first cell that is neither empty nor understood."""
    rows = np.flatnonzero(np.isnan(seconds))
    if rows.size == 0:
        return None
    texts = cells.gather(rows).fill_null("").str.strip_chars()
    row = (texts != "").arg_max()
    return (int(rows[row]), texts[row]) if row is not None and texts[row] else None


def _parse_format(cells: pl.Series, sample: list[str], time_format: str) -> Stamps:
    """Parse cells by the user's format: by polars where it agrees with Python on the first cells, else one by one."""
    expected = [_strptime(cell, time_format) for cell in sample]
    read = [value for value in expected if value is not None]
    seconds = np.full(len(cells), np.nan)
    stripped = cells.str.strip_chars()
    if read and not re.search(r"%[^YmdHMSIpbyjf]", time_format):
        import polars as pl

        fast = time_format.replace(".%f", "%.f")
        if np.allclose(_to_seconds(pl.Series([t for t, v in zip(sample, expected, strict=True) if v]), fast),
                       [value for value, _ in read], rtol=0.0, atol=1e-6):  # fmt: skip
            seconds = _to_seconds(stripped, fast)
    zoned = any(zone for _, zone in read)
    left = np.flatnonzero(np.isnan(seconds))
    if left.size:
        texts, codes = _distinct(stripped.gather(left))
        values = [_strptime(text, time_format) for text in texts]
        zoned = zoned or any(value[1] for value in values if value)
        seconds[left] = np.array([value[0] if value else np.nan for value in values])[codes]
    unread = _first_unread(cells, seconds)
    if unread and np.isnan(seconds).all():
        raise RecordError(
            f"time_format {time_format!r} does not fit the stamps, such as {unread[1]!r}; "
            "write what they have in the codes of strptime, or leave it out."
        )
    return Stamps(seconds, "utc" if zoned else "local", first_unread=unread)


def _strptime(cell: str, time_format: str) -> tuple[float, bool] | None:
    """Parse one cell by Python's own codes: seconds since 1970, and whether it has a zone."""
    try:
        stamp = datetime.strptime(cell, time_format)
    except ValueError as error:
        if "format" in str(error) and "does not match" not in str(error):
            raise RecordError(f"time_format {time_format!r} is no strptime format ({error}).") from None
        return None
    aware = stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)
    return (aware - datetime(1970, 1, 1, tzinfo=UTC)) / timedelta(seconds=1), stamp.tzinfo is not None
