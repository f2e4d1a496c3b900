"""Time elapsed since some zero, as text: ``25:00:00``, ``0 days 00:00:02`` of pandas, ``00:02.0`` of Excel."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl
    from numpy.typing import NDArray

__all__ = ["is_elapsed_time", "parse_elapsed_time", "unwrap_clock"]

_SPAN = r"^(?:(\d+) days?,? *)?(\d{1,5}):(\d{2}):(\d{2}(?:[.,]\d+)?)$"
_BEYOND_A_DAY = r"^(?:\d+ day|2[5-9]:|[3-9]\d:|\d{3,}:)"
_MINUTES = r"^()()(\d{1,3}):(\d{2}[.,]\d+)$"
_WEIGHTS = (86400.0, 3600.0, 60.0, 1.0)


def is_elapsed_time(cell: str) -> bool:
    """Whether a cell may be a time elapsed; a time of day may be one, too."""
    return bool(re.match(_SPAN, cell.strip()) or re.match(_MINUTES, cell.strip()))


def parse_elapsed_time(cells: pl.Series, sample: Sequence[str]) -> tuple[NDArray[np.float64], str] | None:
    """Seconds of a column of elapsed times and the assumption made; None where the cells may be times of day.

    Examples
    --------
    >>> import polars as pl
    >>> parse_elapsed_time(pl.Series(["24:59:59", "25:00:00"]), ["24:59:59"])[0]
    array([89999., 90000.])
    """
    form = next(
        (form for form in (_SPAN, _MINUTES) if 2 * sum(bool(re.match(form, c)) for c in sample) > len(sample)), ""
    )
    if not form or (form == _SPAN and not cells.str.contains(_BEYOND_A_DAY).any()):
        return None
    parts = cells.str.extract_groups(form).struct.unnest().get_columns()
    columns = [part.str.replace(",", ".", literal=True).cast(float, strict=False).to_numpy() for part in parts]
    seconds = np.where(
        np.isfinite(columns[3]), sum(w * np.nan_to_num(c) for w, c in zip(_WEIGHTS, columns, strict=True)), np.nan
    )
    if form == _SPAN:
        return seconds, "The time column is taken as time elapsed, in days or in hours beyond a day."
    note = f"Times such as {sample[0]} are taken as minutes and seconds, and each fall as the next hour."
    return unwrap_clock(seconds, 3600.0), note


def unwrap_clock(seconds: NDArray[np.float64], turn: float) -> NDArray[np.float64]:
    """Let a clock [s] run on where it falls back to zero after `turn` [s].

    Examples
    --------
    >>> unwrap_clock(np.array([86390.0, 0.0, 10.0]), 86400.0)
    array([86390., 86400., 86410.])
    """
    known = np.isfinite(seconds)
    shown = seconds[known]
    falls = np.diff(shown, prepend=shown[:1]) < -turn / 2.0
    unwrapped = seconds.copy()
    unwrapped[known] = shown + turn * np.cumsum(falls)
    return unwrapped
