"""A time of day without colons: ``080000``, ``80000`` where a spreadsheet cut the zero, ``0800``."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl
    from numpy.typing import NDArray

__all__ = ["insert_colons", "is_compact_clock", "numbers_as_clock"]

_DIGITS = r"^(\d{1,6})((?:[.,]\d+)?)$"
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
    found = [re.match(_DIGITS, text) for cell in cells if (text := cell.strip())]
    if len(found) < 2 or not all(found):
        return False
    values = np.array([int(match[1]) for match in found if match])
    steps = np.diff(values)
    moves = steps[steps != 0]
    is_one_way = moves.size > 0 and max(np.mean(moves > 0), np.mean(moves < 0)) >= MIN_SHARE_ONE_WAY
    return bool(is_one_way and (_is_shown(values).all() or _is_shown(100 * values).all()))


def insert_colons(cells: pl.Series) -> tuple[pl.Series, str]:
    """Write times of day with colons, and tell what was assumed; other cells stay as they are.

    Examples
    --------
    >>> import polars as pl
    >>> insert_colons(pl.Series(["75959", "80000.5"]))[0].to_list(), insert_colons(pl.Series(["0800"]))[0].to_list()
    (['07:59:59', '08:00:00.5'], ['08:00'])
    """
    import polars as pl

    digits = cells.str.extract(_DIGITS, 1)
    has_seconds = bool((digits.str.len_bytes() > 4).any() or (digits.cast(pl.Int64) >= 2400).any())
    width = 6 if has_seconds else 4
    full = digits.str.zfill(width)
    parts = [full.str.slice(start, 2) for start in range(0, width, 2)]
    colons = parts[0] + ":" + parts[1] + (":" + parts[2] if has_seconds else "") + cells.str.extract(_DIGITS, 2)
    clocks = pl.select(pl.coalesce(colons, cells)).to_series()
    short = digits.filter((digits.str.len_bytes() < width).fill_null(False)).head(1).to_list()
    if not short:
        return clocks, ""
    note = f"Times such as {short[0]} are read as hours and minutes{', and seconds' if has_seconds else ''}"
    remedy = "" if has_seconds else "; if seconds are among them give the sampling period with dt= (--dt)"
    return clocks, f"{note}{remedy}."


def numbers_as_clock(values: NDArray[np.float64]) -> tuple[pl.Series, str] | None:
    """Write numbers as times of day, and tell so, when they count as a clock does, from 59 to 100.

    Examples
    --------
    >>> seconds = np.arange(7000.0, 7100.0)
    >>> clock = seconds // 3600 * 10000 + seconds // 60 % 60 * 100 + seconds % 60
    >>> numbers_as_clock(clock)[0][19:21].to_list(), numbers_as_clock(seconds)
    (['01:56:59', '01:57:00'], None)
    """
    import polars as pl

    known = values[np.isfinite(values)]
    if known.size < MIN_NUMBERS or (known % 1.0).any() or known.min() < 0.0 or known.max() >= 240000.0:
        return None
    whole = known.astype(np.int64)
    steps = np.diff(whole)
    has_carry = np.isin(steps - np.median(steps), (40, 4040)).any()
    if not has_carry or not (_is_shown(whole).all() or _is_shown(100 * whole).all()):
        return None
    cells, _ = insert_colons(pl.Series(values).fill_nan(None).cast(pl.Int64).cast(pl.String))
    form = "hhmmss" if cells.str.len_bytes().max() == len("00:00:00") else "hhmm"
    return cells, f"The time column is taken as a clock without marks ({form}); if that is wrong give dt= (--dt)."


def _is_shown(values: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether a clock of hours, minutes and seconds shows such numbers, shape (n,)."""
    return (values < 240000) & (values // 100 % 100 < 60) & (values % 100 < 60)
