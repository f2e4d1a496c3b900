"""A time of day without marks: ``080000``, ``80000`` where a spreadsheet cut the zero, ``0800``."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["is_compact_clock", "ticks_as_clock", "with_colons"]

_DIGITS = re.compile(r"(\d{1,6})([.,]\d+)?")
MOSTLY = 0.9
"""Share of the steps of a clock that go one way [-]."""
ENOUGH = 60
"""Numbers among which a counter of seconds would show one that no clock shows [-]."""


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
    one_way = moves.size > 0 and max(np.mean(moves > 0), np.mean(moves < 0)) >= MOSTLY
    return bool(one_way and (_shown(values).all() or _shown(100 * values).all()))


def with_colons(cells: Sequence[str]) -> tuple[list[str], str]:
    """Times of day with colons, and what was guessed; what is none stays as it is.

    Examples
    --------
    >>> with_colons(["75959", "80000.5"])[0], with_colons(["0800", "0801"])
    (['07:59:59', '08:00:00.5'], (['08:00', '08:01'], ''))
    """
    found = [_DIGITS.fullmatch(cell.strip()) for cell in cells]
    digits = [match[1] for match in found if match]
    seconds = any(len(text) > 4 or int(text) >= 2400 for text in digits)
    width = 6 if seconds else 4
    marked = [
        re.sub(r"(?<=\d)(?=(?:\d\d)+$)", ":", match[1].zfill(width)) + (match[2] or "") if match else cell
        for cell, match in zip(cells, found, strict=True)
    ]
    cut = next((text for text in digits if len(text) < width), "")
    if not cut:
        return marked, ""
    told = f"Times such as {cut} are read as hours and minutes{', and seconds' if seconds else ''}"
    return marked, told + ("." if seconds else "; if seconds are among them give the sampling period with dt= (--dt).")


def ticks_as_clock(values: NDArray[np.float64]) -> tuple[list[str], str] | None:
    """A column of numbers as times of day, and a sentence; None where it counts.

    A clock goes from 59 to 100 and from 5959 to 10000, and shows nothing between.

    Examples
    --------
    >>> seconds = np.arange(7000.0, 7100.0)
    >>> clock = seconds // 3600 * 10000 + seconds // 60 % 60 * 100 + seconds % 60
    >>> ticks_as_clock(clock)[0][19:21], ticks_as_clock(seconds)
    (['01:56:59', '01:57:00'], None)
    """
    known = values[np.isfinite(values)]
    if known.size < ENOUGH or (known % 1.0).any() or known.min() < 0.0 or known.max() >= 240000.0:
        return None
    whole = known.astype(np.int64)
    steps = np.diff(whole)
    carried = np.isin(steps - np.median(steps), (40, 4040)).any()
    if not carried or not (_shown(whole).all() or _shown(100 * whole).all()):
        return None
    cells, _ = with_colons([f"{value:.0f}" if value == value else "" for value in values])
    form = "hhmmss" if max(map(len, cells)) == len("00:00:00") else "hhmm"
    return cells, f"The time column is taken as a clock without marks ({form}); if that is wrong give dt= (--dt)."


def _shown(values: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether a clock of hours, minutes and seconds shows such numbers, shape (n,)."""
    return (values < 240000) & (values // 100 % 100 < 60) & (values % 100 < 60)
