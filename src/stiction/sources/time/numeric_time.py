"""Time columns of numbers: seconds, milliseconds, counts since some date, serial days, yyyymmddhhmmss."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.sources.time.compact_clock import numbers_as_clock
from stiction.sources.time.elapsed_time import unwrap_clock
from stiction.sources.time.stamps import Stamps
from stiction.sources.time.text_column import parse_text_stamps

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["epoch_of", "parse_numeric_time"]

DAY_SECONDS = 86400.0


class _Epoch(NamedTuple):
    """Numbers that count from some date."""

    name: str
    low: float
    high: float
    scale: float
    """Seconds per unit."""
    zero: float
    """Value on 1970-01-01."""
    max_step: float
    """Median step above which the numbers are something else."""
    kind: str
    named: float | None = None
    """Seconds per unit that the header names, where that is not `scale`."""


# The years 1980 to 2100, less where two notations overlap; serial days must also step by less than an hour, since they
# may be seconds.
_EPOCHS = (
    _Epoch("Excel serial days", 29221, 73051, DAY_SECONDS, 25569.0, 1.0 / 24.0, "local"),
    _Epoch("MATLAB serial days", 723181, 767011, DAY_SECONDS, 719529.0, 1.0 / 24.0, "local"),
    _Epoch(
        "millionths of a day since 1899 (WinCC)", 2.9221e10, 7.3051e10, 0.0864, 2.5569e10, 1e6 / 24.0, "local", 1e-3
    ),
    _Epoch("seconds since 1970 (UTC)", 3.15e8, 3.5e9, 1.0, 0.0, np.inf, "utc"),
    _Epoch("seconds since 1904 (LabVIEW, UTC)", 3.5e9, 6.19e9, 1.0, 2082844800.0, np.inf, "utc"),
    _Epoch("milliseconds since 1970 (UTC)", 3.15e11, 4.11e12, 1e-3, 0.0, np.inf, "utc"),
    _Epoch("microseconds since 1970 (UTC)", 3.15e14, 4.11e15, 1e-6, 0.0, np.inf, "utc"),
    _Epoch("100 ns since 1601 (FILETIME, UTC)", 1.196e17, 1.575e17, 1e-7, 1.16444736e17, np.inf, "utc"),
    _Epoch("100 ns since the year 1 (.NET ticks)", 6.31e17, 6.47e17, 1e-7, 6.21355968e17, np.inf, "local"),
    _Epoch("nanoseconds since 1970 (UTC)", 3.15e17, 4.11e18, 1e-9, 0.0, np.inf, "utc"),
)
_DATE_DIGITS = ((1.98e13, 2.1e13, "yyyymmddhhmmss"), (1.98e11, 2.1e11, "yyyymmddhhmm"))
_DECIMALS = range(2, 7)
"""Decimals of rounded serial days [-]: with seven a step is less than a hundredth of a second."""
_MIN_STEP_MILLISECONDS = 500.0
"""Median step from which numbers are milliseconds, whole multiples of five minutes excepted: no loop is recorded so
slowly [s]."""


def epoch_of(values: NDArray[np.float64], unit: float | None = None) -> _Epoch | None:
    """Recognise numbers that count from some date, given two or more of them and the seconds per unit where known.

    Examples
    --------
    >>> epoch_of(np.array([1.34e17, 1.34e17 + 1e7])).name
    '100 ns since 1601 (FILETIME, UTC)'
    """
    low, high, step = float(values.min()), float(values.max()), float(np.median(np.abs(np.diff(values))))
    for epoch in _EPOCHS:
        fits = epoch.low <= low and high <= epoch.high and step <= epoch.max_step
        if fits and (unit is None or np.isclose(unit, epoch.named or epoch.scale)):
            return epoch
    return None


def parse_numeric_time(values: NDArray[np.float64], unit: float | None) -> Stamps:
    """Parse a time column of numbers, NaN where a cell is none; `unit` is in seconds, None where the header names none.

    Examples
    --------
    >>> parse_numeric_time(np.array([46054.5, 46054.5 + 1 / 1440]), None).seconds - 1769947200.0
    array([ 0., 60.])
    """
    import polars as pl

    finite = values[np.isfinite(values)]
    if finite.size < 2:
        return Stamps(values * (unit or 1.0), "relative")
    for low, high, form in _DATE_DIGITS:
        if low <= finite.min() and finite.max() <= high:
            digits = pl.Series(values).fill_nan(None).cast(pl.Int64).cast(pl.String)
            stamps = parse_text_stamps(digits if form.endswith("ss") else digits + "00")
            stamps.notes.append(f"The time column is taken as {form}.")
            return stamps
    if epoch := epoch_of(finite, unit):
        seconds = (values - epoch.zero) * epoch.scale
        if np.isfinite(epoch.max_step):  # a serial day carries about a microsecond of rounding
            seconds = np.round(seconds, 3)
        resolution = DAY_SECONDS * _rounding_step(finite) if epoch.scale == DAY_SECONDS else 0.0
        return Stamps(seconds, epoch.kind, [f"The time column is taken as {epoch.name}."], resolution=resolution)
    if unit is not None:
        return Stamps(values * unit, "relative")
    if clock := numbers_as_clock(values):
        return Stamps(unwrap_clock(clock[0], DAY_SECONDS), "relative", [clock[1]])
    step = float(np.median(np.abs(np.diff(finite))))
    if step >= _MIN_STEP_MILLISECONDS and step % 300.0:
        note = f"The time column steps by {step:.6g} and is taken as milliseconds; if these are seconds name it time_s."
        return Stamps(values * 1e-3, "relative", [note])
    return Stamps(values, "relative", ["The time column is taken as seconds."])


def _rounding_step(days: NDArray[np.float64]) -> float:
    """Step to which serial days are rounded, a power of ten [d]; 0 when they have all their decimals."""
    for decimals in _DECIMALS:
        scaled = days * 10.0**decimals
        if np.abs(scaled - np.round(scaled)).max() < 1e-3:
            return 10.0**-decimals
    return 0.0
