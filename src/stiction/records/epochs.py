"""Time columns of numbers: seconds, milliseconds, Unix epochs, serial days (Excel, MATLAB, WinCC), yyyymmddhhmmss."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.records.compact import ticks_as_clock
from stiction.records.timestamps import Stamps, parse_texts

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["parse_numbers"]


DAY = 86400.0
"""A day [s]."""


class _Epoch(NamedTuple):
    name: str
    low: float
    high: float
    scale: float
    """Seconds per unit."""
    zero: float
    """Value on 1970-01-01."""
    longest_step: float
    """Median step above which the numbers are something else."""
    kind: str
    named: float | None = None
    """Seconds per unit that the header names, where that is not `scale`."""


# Years 1980 to 2100 in each notation; serial days must also step by less than an hour, else they may be seconds.
_EPOCHS = (
    _Epoch("Excel serial days", 29221, 73051, DAY, 25569.0, 1.0 / 24.0, "local"),
    _Epoch("MATLAB serial days", 723181, 767011, DAY, 719529.0, 1.0 / 24.0, "local"),
    _Epoch(
        "millionths of a day since 1899 (WinCC)", 2.9221e10, 7.3051e10, 0.0864, 2.5569e10, 1e6 / 24.0, "local", 1e-3
    ),
    _Epoch("seconds since 1970 (UTC)", 3.15e8, 4.11e9, 1.0, 0.0, np.inf, "utc"),
    _Epoch("milliseconds since 1970 (UTC)", 3.15e11, 4.11e12, 1e-3, 0.0, np.inf, "utc"),
    _Epoch("microseconds since 1970 (UTC)", 3.15e14, 4.11e15, 1e-6, 0.0, np.inf, "utc"),
    _Epoch("nanoseconds since 1970 (UTC)", 3.15e17, 4.11e18, 1e-9, 0.0, np.inf, "utc"),
)

PLACES = range(2, 7)
"""Decimals with which serial days may be written [-]: from seven on a step is less than a hundredth of a second."""
_LONG_STEP = 500.0
"""Median step from which numbers are milliseconds, whole multiples of five minutes excepted: nobody records a loop so
slowly [s]."""


def parse_numbers(values: NDArray[np.float64], unit: float | None) -> Stamps:
    """Seconds of a time column of numbers.

    Parameters
    ----------
    values : ndarray, shape (n_rows,)
        The column; NaN where a cell was no number.
    unit : float, optional
        Seconds per unit where the header names the unit [s]; None where it does not.

    Examples
    --------
    >>> parse_numbers(np.array([46054.5, 46054.5 + 1 / 1440]), None).seconds - 1769947200.0
    array([ 0., 60.])
    """
    finite = values[np.isfinite(values)]
    if finite.size < 2:
        return Stamps(values * (unit or 1.0), "relative")
    low, high = float(finite.min()), float(finite.max())
    if low >= 1.98e13 and high <= 2.1e13:
        stamps = parse_texts([f"{value:.0f}" if value == value else "" for value in values])
        stamps.guesses.append("The time column is taken as yyyymmddhhmmss.")
        return stamps
    step = float(np.median(np.abs(np.diff(finite))))
    for epoch in _EPOCHS:
        fits = epoch.low <= low and high <= epoch.high and step <= epoch.longest_step
        if fits and (unit is None or np.isclose(unit, epoch.named or epoch.scale)):
            seconds = (values - epoch.zero) * epoch.scale
            if epoch.longest_step < np.inf:  # a serial day carries about a microsecond of rounding
                seconds = np.round(seconds, 3)
            told = [f"The time column is taken as {epoch.name}."]
            tick = DAY * _last_place(finite) if epoch.scale == DAY else 0.0
            return Stamps(seconds, epoch.kind, told, tick=tick)
    if unit is None and (clock := ticks_as_clock(values)):
        stamps = parse_texts(clock[0])
        stamps.guesses.append(clock[1])
        return stamps
    if unit is None and step >= _LONG_STEP and step % 300.0:
        told = f"The time column steps by {step:.6g} and is taken as milliseconds; if these are seconds name it time_s."
        return Stamps(values * 1e-3, "relative", [told])
    if unit is None:
        return Stamps(values, "relative", ["The time column is taken as seconds."])
    return Stamps(values * unit, "relative")


def _last_place(days: NDArray[np.float64]) -> float:
    """Step to which serial days are rounded, a power of ten [d]; 0 where they are written with all their decimals."""
    for places in PLACES:
        counted = days * 10.0**places
        if np.abs(counted - np.round(counted)).max() < 1e-3:
            return 10.0**-places
    return 0.0
