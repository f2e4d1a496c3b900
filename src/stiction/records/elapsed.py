"""Time elapsed since some zero, as text: ``25:00:00``, ``0 days 00:00:02`` of pandas, ``00:02.0`` of Excel."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from stiction.records.table import LOOK_AHEAD

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["is_elapsed", "parse_elapsed", "run_on"]

_SPAN = re.compile(r"(?:(\d+) days?,? *)?(\d{1,5}):(\d{2}):(\d{2}(?:[.,]\d+)?)")
_MINUTES = re.compile(r"()()(\d{1,3}):(\d{2}[.,]\d+)")
_WEIGHTS = (86400.0, 3600.0, 60.0, 1.0)


def is_elapsed(cell: str) -> bool:
    """Whether a cell may be a time elapsed; a time of day may be one, too."""
    text = cell.strip()
    return bool(_SPAN.fullmatch(text) or _MINUTES.fullmatch(text))


def parse_elapsed(cells: Sequence[str]) -> tuple[NDArray[np.float64], str] | None:
    """Seconds of each cell, and what was guessed; None where the cells may be times of day.

    Parameters
    ----------
    cells : sequence of str, shape (n_rows,)
        Times as text.

    Returns
    -------
    tuple of ndarray and str, or None
        Seconds since the first zero, NaN where a cell was not understood, shape (n_rows,); and a sentence.

    Examples
    --------
    >>> parse_elapsed(["24:59:59", "25:00:00"])[0], parse_elapsed(["59:59.5", "00:00.0"])[0]
    (array([89999., 90000.]), array([3599.5, 3600. ]))
    """
    sample = [text for cell in cells[:LOOK_AHEAD] if (text := cell.strip())]
    form = next(
        (form for form in (_SPAN, _MINUTES) if 2 * sum(map(bool, map(form.fullmatch, sample))) > len(sample)), None
    )
    if form is None:
        return None
    found = [form.fullmatch(cell.strip()) for cell in cells]
    if form is _SPAN and not any(match and (match[1] or int(match[2]) > 24) for match in found):
        return None
    seconds = np.array([_seconds(match.groups()) if match else np.nan for match in found])
    if form is _SPAN:
        return seconds, "The time column is taken as time elapsed, in days or in hours beyond a day."
    told = f"Times such as {sample[0]} are taken as minutes and seconds, and each fall as the next hour."
    return run_on(seconds, 3600.0), told


def _seconds(parts: Sequence[str | None]) -> float:
    values = (float((part or "0").replace(",", ".")) for part in parts)
    return sum(weight * value for weight, value in zip(_WEIGHTS, values, strict=True))


def run_on(seconds: NDArray[np.float64], turn: float) -> NDArray[np.float64]:
    """Let a clock run on where it falls back to zero.

    Parameters
    ----------
    seconds : ndarray, shape (n_rows,)
        What the clock shows [s]; NaN where nothing was read.
    turn : float
        After how long it starts again from zero [s].

    Returns
    -------
    ndarray, shape (n_rows,)
        The time without the falls [s].
    """
    known = np.isfinite(seconds)
    shown = seconds[known]
    falls = np.diff(shown, prepend=shown[:1]) < -turn / 2.0
    through = seconds.copy()
    through[known] = shown + turn * np.cumsum(falls)
    return through
