"""Which number of a date such as 01/02/26 is the day, the month and the year: by the other dates of the column."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.sources.time.text_stamps import (
    DAY_MONTH_YEAR,
    MONTH_DAY_YEAR,
    NUMBERED_DATE,
    YEAR_MONTH_DAY,
    parse_day,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["choose_date_order"]

_ORDERS = {
    DAY_MONTH_YEAR: ("day before month", "day_first=True"),
    MONTH_DAY_YEAR: ("month before day", "day_first=False"),
    YEAR_MONTH_DAY: ("year, month, day", "time_format='%y/%m/%d %H:%M:%S'"),
}
"""Order -> its name, and the argument that asks for it."""
_REASONS = ("", "", "the days then follow each other", "the year is then a likely one", "as AM and PM are American")
"""Reason for each criterion of `choose_date_order`; empty when the criterion leaves no doubt."""
_LIKELY_DAYS = (14610, 25568)
"""First days of 2010 and 2040 [d since 1970]."""


def choose_date_order(days: Sequence[str], has_am_pm: bool, notes: list[str]) -> tuple[int, int, int]:
    """Choose the order of the numbers of dates such as 01/02/26, given the distinct ones in the order of the file.

    The order is taken that reads most dates; then points mean the day first; then the one in which the days follow
    each other; then a likely year; then month first where the clock has AM and PM. `notes` gets a sentence when another
    order would read all dates too.

    Examples
    --------
    >>> choose_date_order(["31/01/26", "01/02/26"], False, []), choose_date_order(["01/31/26"], False, [])
    ((2, 1, 0), (2, 0, 1))
    """
    found = [match for day in days if (match := NUMBERED_DATE.fullmatch(day))]
    if not found:
        return DAY_MONTH_YEAR
    texts, has_points = [match.group() for match in found], all(match.group(2) == "." for match in found)
    may_be_year_first = not has_points and all(len(match.group(1)) == len(match.group(4)) == 2 for match in found)
    ranks: dict[tuple[int, int, int], tuple[float, ...]] = {}
    for order in _ORDERS if may_be_year_first else (DAY_MONTH_YEAR, MONTH_DAY_YEAR):
        values = np.array([parse_day(text, order).day for text in texts])
        known = values[np.isfinite(values)]
        is_unlikely = bool(np.any((known < _LIKELY_DAYS[0]) | (known >= _LIKELY_DAYS[1])))
        n_lost, travel = len(values) - len(known), np.abs(np.diff(known)).sum()
        is_foreign = has_am_pm and order != MONTH_DAY_YEAR
        ranks[order] = (n_lost, has_points and order != DAY_MONTH_YEAR, travel, is_unlikely, is_foreign)
    best, second, *_ = sorted(ranks, key=lambda order: ranks[order])
    reasons = (reason for a, b, reason in zip(ranks[best], ranks[second], _REASONS, strict=True) if a != b)
    if reason := next(reasons, "nothing in the file tells"):
        (text, _), (_, remedy) = _ORDERS[best], _ORDERS[second]
        notes.append(f"Dates such as {texts[0]} are read {text} ({reason}); if that is wrong give {remedy}.")
    return best
