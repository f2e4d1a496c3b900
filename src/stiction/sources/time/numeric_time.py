"""Time columns of numbers: seconds, counts since some date, serial days, yyyymmddhhmmss, a clock without marks."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import polars as pl

from stiction.sources.time.stamps import Stamps, unwrap_clock
from stiction.sources.time.text_column import parse_text_stamps

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["compact_clock_seconds", "find_epoch", "is_compact_clock", "parse_numeric_time"]


class _Epoch(NamedTuple):
    """Numbers that count from some date."""

    name: str
    low: float
    high: float
    scale: float
    """Seconds per unit."""
    zero: float
    """Value on 1970-01-01."""
    kind: str
    max_step: float = np.inf
    """Median step above which the numbers are something else."""
    named: float | None = None
    """Seconds per unit that the header names, where that is not `scale`."""


# The years 1980 to 2100, less where two notations overlap; serial days must also step by less than an hour, since they
# may be seconds.
_EPOCHS = (
    _Epoch("Excel serial days", 29221, 73051, 86400.0, 25569.0, "local", 1.0 / 24.0),
    _Epoch("MATLAB serial days", 723181, 767011, 86400.0, 719529.0, "local", 1.0 / 24.0),
    _Epoch(
        "millionths of a day since 1899 (WinCC)", 2.9221e10, 7.3051e10, 0.0864, 2.5569e10, "local", 1e6 / 24.0, 1e-3
    ),
    _Epoch("seconds since 1970 (UTC)", 3.15e8, 3.5e9, 1.0, 0.0, "utc"),
    _Epoch("seconds since 1904 (LabVIEW, UTC)", 3.5e9, 6.19e9, 1.0, 2082844800.0, "utc"),
    _Epoch("milliseconds since 1970 (UTC)", 3.15e11, 4.11e12, 1e-3, 0.0, "utc"),
    _Epoch("microseconds since 1970 (UTC)", 3.15e14, 4.11e15, 1e-6, 0.0, "utc"),
    _Epoch("100 ns since 1601 (FILETIME, UTC)", 1.196e17, 1.575e17, 1e-7, 1.16444736e17, "utc"),
    _Epoch("100 ns since the year 1 (.NET ticks)", 6.31e17, 6.47e17, 1e-7, 6.21355968e17, "local"),
    _Epoch("nanoseconds since 1970 (UTC)", 3.15e17, 4.11e18, 1e-9, 0.0, "utc"),
)
_DATE_DIGITS = ((1.98e13, 2.1e13, "yyyymmddhhmmss"), (1.98e11, 2.1e11, "yyyymmddhhmm"))


def find_epoch(values: NDArray[np.float64], unit: float | None = None) -> _Epoch | None:
    """Recognise numbers that count from some date, given two or more of them and the seconds per unit where known."""
    low, high, step = float(values.min()), float(values.max()), float(np.median(np.abs(np.diff(values))))
    for epoch in _EPOCHS:
        fits = epoch.low <= low and high <= epoch.high and step <= epoch.max_step
        if fits and (unit is None or np.isclose(unit, epoch.named or epoch.scale)):
            return epoch
    return None


def parse_numeric_time(values: NDArray[np.float64], unit: float | None) -> Stamps:
    """Parse a time column of numbers, NaN where a cell is none; `unit` is in seconds, None where no header names it."""
    finite = values[np.isfinite(values)]
    if finite.size < 2:
        return Stamps(values * (unit or 1.0), "relative")
    for low, high, form in _DATE_DIGITS:
        if low <= finite.min() and finite.max() <= high:
            digits = pl.Series(values).fill_nan(None).cast(pl.Int64).cast(pl.String)
            stamps = parse_text_stamps(digits if form.endswith("ss") else digits + "00")
            stamps.notes.append(f"The time column is taken as {form}.")
            return stamps
    if epoch := find_epoch(finite, unit):
        seconds, resolution = (values - epoch.zero) * epoch.scale, 0.0
        if np.isfinite(epoch.max_step):  # a serial day carries about a microsecond of rounding
            seconds = np.round(seconds, 3)
        if epoch.scale == 86400.0:  # with seven decimals the rounding does not matter
            rounding = (10.0**-k for k in range(2, 7) if np.abs(finite * 10**k - np.round(finite * 10**k)).max() < 1e-3)
            resolution = epoch.scale * next(rounding, 0.0)
        return Stamps(seconds, epoch.kind, [f"The time column is taken as {epoch.name}."], resolution=resolution)
    if unit is not None:
        return Stamps(values * unit, "relative")
    if _counts_as_clock(finite):
        seconds, form = compact_clock_seconds(values)
        note = f"The time column is taken as a clock without marks ({form}); if not, give the sampling period (dt)."
        return Stamps(unwrap_clock(seconds), "relative", [note])
    step = float(np.median(np.abs(np.diff(finite))))
    if step >= 500.0 and step % 300.0:  # no loop is recorded so slowly, other than at multiples of five minutes
        note = f"The time column steps by {step:.6g} and is taken as milliseconds; if these are seconds name it time_s."
        return Stamps(values * 1e-3, "relative", [note])
    return Stamps(values, "relative", ["The time column is taken as seconds."])


def compact_clock_seconds(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], str]:
    """Seconds since midnight of numbers hhmmss or hhmm, NaN for other numbers, and which of the two they are."""
    form = "hhmmss" if np.nanmax(values, initial=0.0) >= 2400.0 else "hhmm"
    digits = values if form == "hhmmss" else 100.0 * values
    seconds = digits // 10000.0 * 3600.0 + digits // 100.0 % 100.0 * 60.0 + digits % 100.0
    return np.where(_is_on_clock(np.floor(digits)), seconds, np.nan), form


def is_compact_clock(cells: Sequence[str]) -> bool:
    """Whether cells beside dates are times of day: digits that a clock can show and that go one way."""
    matches = [re.fullmatch(r"(\d{1,6})([.,]\d+)?", cell.strip(), re.ASCII) for cell in cells if cell.strip()]
    if len(matches) < 2 or not all(matches):
        return False
    values = np.array([int(match[1]) for match in matches if match])
    steps = np.diff(values)
    moves = steps[steps != 0]
    is_one_way = moves.size > 0 and max(np.mean(moves > 0), np.mean(moves < 0)) >= 0.9
    return bool(is_one_way and (_is_on_clock(values).all() or _is_on_clock(100 * values).all()))


def _counts_as_clock(values: NDArray[np.float64]) -> bool:
    """Whether 60 or more whole numbers, among which a counter would have one that no clock shows, go from 59 to 100."""
    if values.size < 60 or (values % 1.0).any():
        return False
    steps = np.diff(values)
    has_carry = np.isin(steps - np.median(steps), (40.0, 4040.0)).any()
    return bool(has_carry and (_is_on_clock(values).all() or _is_on_clock(100.0 * values).all()))


def _is_on_clock(values: NDArray) -> NDArray[np.bool_]:
    """Whether a clock of hours, minutes and seconds shows such whole numbers, shape (n,)."""
    return (values >= 0) & (values < 240000) & (values // 100 % 100 < 60) & (values % 100 < 60)
