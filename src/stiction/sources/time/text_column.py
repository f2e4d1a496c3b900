"""A column of time stamps as text to seconds: one format for the whole column, and what is left by distinct text."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from stiction.errors import RecordError, Setting
from stiction.sources.table import SNIFF_ROWS
from stiction.sources.time.stamps import Stamps, unwrap_clock
from stiction.sources.time.text_stamps import CLOCK, ELAPSED, NUMBERED, REWRITES, parse_day

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["find_first_unread", "parse_by_strptime", "parse_text_stamps"]

_USUAL = re.compile(
    r"(?P<first>\d{1,4})(?P<mark>[-/. ])(?P<middle>\d{1,2}|[A-Z][A-Za-z]{2})(?P=mark)(?P<last>\d{1,4})(?P<between>[T ])"
    r"\d{1,2}:\d{2}(?P<second>:\d{2}(?:\.\d+)?)?(?P<half> ?[AaPp][Mm])?(?P<zone>Z|[+-]\d{2}:\d{2})?"
)
_COMPACT = re.compile(r"(?:19|20)\d{6}(?P<between>[T ]?)\d{6}(?P<zone>Z?)")
_DATE_ORDERS = {
    "dmy": ("day before month", "say that the day is first (day_first)"),
    "mdy": ("month before day", "say that the day is not first (day_first)"),
    "ymd": ("year, month, day", "give the format of the time (time_format), '%y/%m/%d %H:%M:%S'"),
}
"""Order -> its name, and how to ask for it."""


def parse_text_stamps(cells: pl.Series, *, day_first: bool | None = None, time_format: str | None = None) -> Stamps:
    """Parse dates, times of day or elapsed times; `day_first` for 01/02/2026, by the other dates when None."""
    head = cells.head(SNIFF_ROWS).drop_nulls()
    if (head != head.str.strip_chars()).any():  # a copy of a long column takes much memory
        cells = cells.str.strip_chars()
    head = head.str.strip_chars().unique(maintain_order=True)
    head = head.filter(head != "")
    if time_format is not None:
        stamps = _parse_format(cells, head.to_list(), time_format)
    else:
        plain = cells
        for form, usual in REWRITES:
            if head.str.contains(form).any():
                plain, head = plain.str.replace_all(form, usual), head.str.replace_all(form, usual)
        stamps = _parse_elapsed(plain, head.to_list()) or _parse_dates(plain, head.to_list(), day_first)
    stamps.first_unread = find_first_unread(cells, stamps.seconds)
    return stamps


def find_first_unread(cells: pl.Series, seconds: NDArray[np.float64]) -> tuple[int, str] | None:
    """Row and text of the first cell that is neither empty nor understood."""
    rows = np.flatnonzero(np.isnan(seconds))
    if not rows.size:
        return None
    texts = cells.gather(rows).cast(pl.String).fill_null("").str.strip_chars()
    row = (texts != "").arg_max()
    return (int(rows[row]), texts[row]) if row is not None and texts[row] else None


def _parse_dates(cells: pl.Series, sample: Sequence[str], day_first: bool | None) -> Stamps:
    """Parse dates, times of day or both: by the format of the first usual cell, then what is left by its parts."""
    notes: list[str] = []
    order = None if day_first is None else "dmy" if day_first else "mdy"
    has_am_pm = any(re.search(r"\d ?[AaPp][Mm]\b", cell) for cell in sample)
    seconds, is_zoned = np.full(len(cells), np.nan), np.zeros(len(cells), dtype=bool)
    if usual := next((cell for cell in sample if _USUAL.fullmatch(cell) or _COMPACT.fullmatch(cell)), None):
        if order is None and NUMBERED["dmy"].match(usual):
            order = choose_date_order(cells.str.slice(0, 10).unique(maintain_order=True).to_list(), has_am_pm, notes)
        form = _polars_format(usual, order or "dmy")
        seconds = _parse_by_format(cells, form)
        is_zoned = np.isfinite(seconds) & form.endswith(("Z", "z"))
    left = np.flatnonzero(np.isnan(seconds))
    rest = (cells if left.size == len(cells) else cells.gather(left)).fill_null("").str.strip_chars()
    left, rest = left[(rest != "").to_numpy()], rest.filter(rest != "")
    if left.size:
        clock, days = _sum_groups(rest, CLOCK), rest.str.replace(CLOCK, "@").str.strip_chars()
        texts = days.unique(maintain_order=True).to_list()
        if texts == ["@"] and np.isnan(seconds).all():
            seconds[left] = clock
            return Stamps(unwrap_clock(seconds), "relative", ["The time column contains times of day without a date."])
        order = order or choose_date_order(texts, has_am_pm, notes)
        days_by_text = {text: parse_day(text, order) for text in texts}
        midnight = days.replace_strict({text: day for text, (day, _) in days_by_text.items()}).to_numpy()
        seconds[left] = midnight + np.where(days.str.contains("@"), clock, 0.0)
        is_zoned[left] = days.is_in([text for text, (_, zone) in days_by_text.items() if zone == "UTC"])
        if other := next((zone for _, zone in days_by_text.values() if zone not in ("", "UTC")), None):
            notes.append(f"The time zone {other} is not known: the stamps are taken as local time.")
    known = np.isfinite(seconds)
    n_zoned, n_known = int((is_zoned & known).sum()), int(known.sum())
    if 0 < n_zoned < n_known:
        notes.append(f"{n_zoned} of {n_known} stamps have a time zone; the others are taken as UTC.")
    return Stamps(seconds, "utc" if n_zoned else "local", notes)


def _polars_format(cell: str, order: str) -> str:
    """Write the form of a usual cell in the codes of polars."""
    if match := _COMPACT.fullmatch(cell):
        return f"%Y%m%d{match['between']}%H%M%S{match['zone']}"
    match = _USUAL.fullmatch(cell)
    assert match
    is_year_first = len(match["first"]) == 4
    year = "%Y" if is_year_first or len(match["last"]) == 4 else "%y"
    codes = "ymd" if is_year_first else order if match["middle"].isdigit() else "dby"
    day = match["mark"].join(year if code == "y" else f"%{code}" for code in codes)
    half = (match["half"] or "")[:-2] + "%p" if match["half"] else ""
    zone = match["zone"] if match["zone"] in (None, "Z") else "%:z"
    return f"{day}{match['between']}{'%I' if half else '%H'}:%M{':%S%.f' if match['second'] else ''}{half}{zone or ''}"


def _parse_by_format(cells: pl.Series, text: str) -> NDArray[np.float64]:
    """Seconds since 1970 of cells by a format of polars; NaN where one does not have it."""
    parsed = cells.str.to_datetime(text, time_unit="us", strict=False)
    return parsed.dt.epoch("us").cast(float).to_numpy() / 1e6


def _sum_groups(cells: pl.Series, form: str) -> NDArray[np.float64]:
    """Sum the days, hours, minutes and seconds that the groups of a form catch [s]; NaN where it does not fit."""
    parts = cells.str.extract_groups(form).struct.unnest()
    units = {"day": 86400.0, "hour": 3600.0, "minute": 60.0, "second": 1.0}
    number = {name: pl.col(name).str.replace(",", ".", literal=True).cast(float) for name in units}
    total = pl.sum_horizontal(number[name] * unit for name, unit in units.items() if name in parts.columns)
    fits = pl.col("minute").is_not_null()
    if "half" in parts.columns:  # a time of day
        half = pl.col("half").str.to_lowercase()
        shift = 43200.0 * ((half == "p").cast(float) - (number["hour"] == 12.0).cast(float))
        total = total + shift.fill_null(0.0)
        fits = (number["hour"] <= 24.0) & (number["minute"] < 60.0) & (number["second"].fill_null(0.0) < 61.0)
    return parts.select(pl.when(fits).then(total)).to_series().to_numpy()


def _parse_elapsed(cells: pl.Series, sample: Sequence[str]) -> Stamps | None:
    """Parse elapsed times; None where the cells may be times of day."""
    form = next((form for form in ELAPSED if 2 * sum(bool(re.match(form, cell)) for cell in sample) > len(sample)), "")
    if not form or (form == ELAPSED[0] and not cells.str.contains(r"^(?:\d+ day|2[5-9]:|[3-9]\d:|\d{3,}:)").any()):
        return None
    seconds = _sum_groups(cells, form)
    if form == ELAPSED[0]:
        note = "The time column is taken as time elapsed, in days or in hours beyond a day."
    else:
        note = f"Times such as {sample[0]} are taken as minutes and seconds, and each step back as the next hour."
        seconds = unwrap_clock(seconds, 3600.0)
    return Stamps(seconds, "relative", [note])


def choose_date_order(texts: Sequence[str], has_am_pm: bool, notes: list[str]) -> str:
    """Choose the order of dates such as 01/02/26 by their distinct texts; `notes` says if another fits too.

    First of: most dates read, points (day first), days in sequence, a year 2010 to 2039, AM and PM (month first).
    """
    dates = [match[0] for text in texts if (match := re.search(r"\b\d\d?[-/.]\d\d?[-/.](?:\d{4}|\d\d)\b", text or ""))]
    days = [*dict.fromkeys(dates)]
    if not days:
        return "dmy"
    has_points = all("." in day for day in days)
    may_be_year_first = not has_points and all(re.fullmatch(r"\d\d\D\d\d?\D\d\d", day) for day in days)
    ranks = {}
    for order in _DATE_ORDERS if may_be_year_first else ("dmy", "mdy"):
        values = np.array([parse_day(day, order)[0] for day in days]) / 86400.0
        known = values[np.isfinite(values)]
        is_unlikely = bool(np.any((known < 14610.0) | (known >= 25568.0)))
        travel = float(np.abs(np.diff(known)).sum())
        is_foreign = has_am_pm and order != "mdy"
        ranks[order] = (len(values) - len(known), has_points and order != "dmy", travel, is_unlikely, is_foreign)
    best, second, *_ = sorted(ranks, key=lambda order: ranks[order])
    reasons = (
        "",
        "",
        "because the days are then in order",
        "because the year is then plausible",
        "because AM and PM are usual in America",
    )
    differing = (reason for a, b, reason in zip(ranks[best], ranks[second], reasons, strict=True) if a != b)
    if reason := next(differing, "nothing in the file shows the order"):
        (text, _), (_, remedy) = _DATE_ORDERS[best], _DATE_ORDERS[second]
        notes.append(f"Dates such as {days[0]} are read {text} ({reason}); if that is wrong {remedy}.")
    return best


def _parse_format(cells: pl.Series, sample: Sequence[str], time_format: str) -> Stamps:
    """Parse cells by the user's format: by polars where it agrees with Python on the first cells, else one by one."""
    seconds, has_zone = np.full(len(cells), np.nan), False
    expected = [parse_by_strptime(cell, time_format)[0] for cell in sample]
    if not re.search(r"%[^YmdHMSIpbyjf]", time_format):
        fast = time_format.replace(".%f", "%.f")
        head = _parse_by_format(pl.Series(sample, dtype=pl.String), fast)
        if np.allclose(head, expected, rtol=0.0, atol=1e-6, equal_nan=True):
            seconds = _parse_by_format(cells, fast)
    left = np.flatnonzero(np.isnan(seconds))
    if left.size:
        rest = cells.gather(left).fill_null("")
        parsed = {text: parse_by_strptime(text, time_format) for text in rest.unique()}
        has_zone = any(zoned for _, zoned in parsed.values())
        seconds[left] = rest.replace_strict({text: value for text, (value, _) in parsed.items()}).to_numpy()
    if sample and np.isnan(seconds).all():
        raise RecordError(
            f"time_format {time_format!r} does not fit the stamps, such as {sample[0]!r}; "
            "write a format in the codes of strptime that fits them, or leave it out."
        )
    return Stamps(seconds, "utc" if has_zone else "local")


def parse_by_strptime(cell: str, time_format: str) -> tuple[float, bool]:
    """Parse one cell by Python's own codes: seconds since 1970, NaN if it does not fit, and whether it has a zone."""
    try:
        stamp = datetime.strptime(cell, time_format)
    except ValueError as error:
        if "format" in str(error) and "does not match" not in str(error):
            raise RecordError(
                Setting("time_format"), f" {time_format!r} is not a format of strptime ({error})",
                remedy="give one such as '%d.%m.%Y %H:%M:%S'",
            ) from None  # fmt: skip
        return np.nan, False
    aware = stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)
    return (aware - datetime(1970, 1, 1, tzinfo=UTC)) / timedelta(seconds=1), stamp.tzinfo is not None
