"""A time of day without colons: ``080000``, ``80000`` where a spreadsheet cut the zero, ``0800``."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["compact_clock_seconds", "is_compact_clock", "numbers_as_clock"]

_DIGITS = re.compile(r"([0-9]{1,6})([.,][0-9]+)?")
MIN_SHARE_ONE_WAY = 0.9
"""Share of the steps of a clock that have the same direction [-]."""
MIN_NUMBERS = 60
"""Numbers among which a counter of seconds would have one that no clock shows [-]."""


def is_compact_clock(cells: Sequence[str]) -> bool:
    """Whether cells beside dates are times of day: digits that a clock can show and that go one way.

    Examples
    --------
    >>> is_compact_clock(["75958", "75959", "80000"]), is_compact_clock(["75958", "75970", "80000"])
    (True, False)
    >>> is_compact_clock(["45", "46", "45", "46"])
    False
    """
    found = [_DIGITS.fullmatch(text) for cell in cells if (text := cell.strip())]
    if len(found) < 2 or not all(found):
        return False
    values = np.array([int(match[1]) for match in found if match])
    steps = np.diff(values)
    moves = steps[steps != 0]
    is_one_way = moves.size > 0 and max(np.mean(moves > 0), np.mean(moves < 0)) >= MIN_SHARE_ONE_WAY
    return bool(is_one_way and (_is_shown(values).all() or _is_shown(100 * values).all()))


def compact_clock_seconds(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], bool]:
    """Seconds since midnight of numbers hhmmss or hhmm, NaN for other numbers, and whether there are seconds.

    Examples
    --------
    >>> compact_clock_seconds(np.array([75959.0, 80000.5])), compact_clock_seconds(np.array([800.0]))
    ((array([28799. , 28800.5]), True), (array([28800.]), False))
    """
    has_seconds = bool(np.nanmax(values, initial=0.0) >= 2400.0)
    digits = values if has_seconds else 100.0 * values
    whole = np.floor(np.nan_to_num(digits, nan=-1.0)).astype(np.int64)
    seconds = whole // 10000 * 3600.0 + whole // 100 % 100 * 60.0 + digits % 100.0
    return np.where(_is_shown(whole) & (whole >= 0), seconds, np.nan), has_seconds


def numbers_as_clock(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], str] | None:
    """Read numbers as times of day [s], and tell so, when they count as a clock does, from 59 to 100.

    Examples
    --------
    >>> seconds = np.arange(7000.0, 7100.0)
    >>> clock = seconds // 3600 * 10000 + seconds // 60 % 60 * 100 + seconds % 60
    >>> bool((numbers_as_clock(clock)[0] == seconds).all()), numbers_as_clock(seconds)
    (True, None)
    """
    known = values[np.isfinite(values)]
    if known.size < MIN_NUMBERS or (known % 1.0).any() or known.min() < 0.0 or known.max() >= 240000.0:
        return None
    whole = known.astype(np.int64)
    steps = np.diff(whole)
    has_carry = np.isin(steps - np.median(steps), (40, 4040)).any()
    if not has_carry or not (_is_shown(whole).all() or _is_shown(100 * whole).all()):
        return None
    seconds, has_seconds = compact_clock_seconds(values)
    form = "hhmmss" if has_seconds else "hhmm"
    return seconds, f"The time column is taken as a clock without marks ({form}); if that is wrong give dt= (--dt)."


def _is_shown(values: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether a clock of hours, minutes and seconds shows such numbers, shape (n,)."""
    return (values < 240000) & (values // 100 % 100 < 60) & (values % 100 < 60)
