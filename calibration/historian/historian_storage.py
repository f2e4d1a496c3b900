"""Storage in a historian: slower sampling, averages, compression, rounding.

Deviations are in standard deviations of each signal, so that one number applies to OP, PV and SP.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.errors import ParameterError, require_not_negative, require_positive
from stiction.records.record import require_record

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = [
    "average_intervals",
    "compress_by_swinging_door",
    "interpolate_samples",
    "map_signals",
    "quantise_signals",
    "report_by_exception",
    "sample_slower",
]

SIGNALS = ("op", "pv", "sp", "mv")


def map_signals(record: LoopRecord, change: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> LoopRecord:
    """Apply `change` to every recorded signal.

    Parameters
    ----------
    record : LoopRecord
        The record.
    change : callable
        From a signal, shape (n_samples,), to its new form of the same shape.

    Returns
    -------
    LoopRecord
        The record with changed signals.
    """
    require_record(record)
    signals: dict[str, Any] = {name: getattr(record, name) for name in SIGNALS}
    return replace(record, **{name: change(x) for name, x in signals.items() if x is not None})


def sample_slower(record: LoopRecord, dt: float) -> LoopRecord:
    """Sample at a longer period: the last value at each tick.

    Parameters
    ----------
    record : LoopRecord
        The record.
    dt : float
        New sampling period [s], at least the record's own.

    Returns
    -------
    LoopRecord
        A shorter record.

    Raises
    ------
    ParameterError
        When `dt` is shorter than the record's sampling period.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from calibration.historian import sample_slower
    >>> sample_slower(LoopRecord("FC1", 1.0, op=[1.0, 2.0, 3.0, 4.0, 5.0]), dt=2.0).op.tolist()
    [1.0, 3.0, 5.0]
    """
    require_record(record)
    index = _tick_indices(record, dt)
    signals: dict[str, Any] = {name: getattr(record, name) for name in (*SIGNALS, "auto")}
    return replace(record, dt=dt, **{name: x[index] for name, x in signals.items() if x is not None})


def average_intervals(record: LoopRecord, dt: float) -> LoopRecord:
    """Store the mean of each interval.

    Parameters
    ----------
    record : LoopRecord
        The record.
    dt : float
        Interval [s]; rounded to whole samples of the record.

    Returns
    -------
    LoopRecord
        A shorter record; an interval in which the mode changed counts as in manual.

    Raises
    ------
    ParameterError
        When `dt` is shorter than the record's sampling period.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from calibration.historian import average_intervals
    >>> average_intervals(LoopRecord("FC1", 1.0, op=[1.0, 2.0, 3.0, 4.0, 5.0]), dt=2.0).op.tolist()
    [1.5, 3.5]
    """
    require_record(record)
    _require_longer_period(record, dt)
    m = round(dt / record.dt)
    n = len(record) // m
    signals: dict[str, Any] = {name: getattr(record, name) for name in SIGNALS}
    parts: dict[str, Any] = {
        name: x[: n * m].reshape(n, m).mean(axis=1) for name, x in signals.items() if x is not None
    }
    if record.auto is not None:
        parts["auto"] = record.auto[: n * m].reshape(n, m).all(axis=1)
    return replace(record, dt=m * record.dt, **parts)


def interpolate_samples(record: LoopRecord, dt: float) -> LoopRecord:
    """Sample every `dt` and interpolate linearly to the sampling period of the record.

    Parameters
    ----------
    record : LoopRecord
        The record.
    dt : float
        Sampling period of the historian [s].

    Returns
    -------
    LoopRecord
        A record of the same length.

    Raises
    ------
    ParameterError
        When `dt` is shorter than the record's sampling period.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from calibration.historian import interpolate_samples
    >>> interpolate_samples(LoopRecord("FC1", 1.0, op=[1.0, 9.0, 3.0, 9.0, 5.0]), dt=2.0).op.tolist()
    [1.0, 2.0, 3.0, 4.0, 5.0]
    """
    require_record(record)
    index, k = _tick_indices(record, dt), np.arange(len(record))
    return map_signals(record, lambda x: np.interp(k, index, x[index]))


def report_by_exception(record: LoopRecord, deviation: float, *, interpolate: bool = False) -> LoopRecord:
    """Report by exception: store a value that differs from the last stored value by more than the deviation.

    Parameters
    ----------
    record : LoopRecord
        The record.
    deviation : float
        Exception deviation, in standard deviations of each signal [-].
    interpolate : bool
        Interpolate linearly between the stored values instead of holding the last one.

    Returns
    -------
    LoopRecord
        A record of the same length.

    Raises
    ------
    ParameterError
        When `deviation` is negative.

    References
    ----------
    After Thornhill, Choudhury and Shah (Journal of Process Control 14, 2004, 389-398) on what compression does to
    records.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from calibration.historian import report_by_exception
    >>> record = LoopRecord("FC1", 1.0, op=[0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    >>> report_by_exception(record, deviation=1.0).op.tolist()
    [0.0, 0.0, 2.0, 2.0, 4.0, 4.0]
    """
    require_record(record)
    deviation = require_not_negative("deviation", deviation, "-")

    def change(x: NDArray[np.float64]) -> NDArray[np.float64]:
        stored = _exception_indices(x, deviation * float(np.nanstd(x)))
        return np.interp(np.arange(x.size), stored, x[stored]) if interpolate else _hold_last_value(x, stored)

    return map_signals(record, change)


def compress_by_swinging_door(record: LoopRecord, deviation: float) -> LoopRecord:
    """Compress by the swinging door algorithm and interpolate linearly between the stored values.

    A value is stored when no straight line from the last stored value is within the deviation of all later values. The
    interpolated line ends at a true value, so its error is below twice the deviation.

    Parameters
    ----------
    record : LoopRecord
        The record.
    deviation : float
        Half opening of the door, in standard deviations of each signal [-].

    Returns
    -------
    LoopRecord
        A record of the same length.

    Raises
    ------
    ParameterError
        When `deviation` is negative.

    References
    ----------
    After Bristol, Swinging door trending (ISA National Conference, 1990).

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from calibration.historian import compress_by_swinging_door
    >>> record = LoopRecord("FC1", 1.0, op=[0.0, 1.1, 1.9, 3.0, 2.1, 0.9, 0.0])
    >>> compress_by_swinging_door(record, deviation=0.2).op.tolist()
    [0.0, 1.0, 2.0, 3.0, 2.0, 1.0, 0.0]
    """
    require_record(record)
    deviation = require_not_negative("deviation", deviation, "-")

    def change(x: NDArray[np.float64]) -> NDArray[np.float64]:
        stored = _swinging_door_indices(x, deviation * float(np.nanstd(x)))
        return np.interp(np.arange(x.size), stored, x[stored])

    return map_signals(record, change)


def quantise_signals(record: LoopRecord, *, op: float = 0.0, pv: float = 0.0) -> LoopRecord:
    """Round OP, and PV with its SP, to whole steps.

    Parameters
    ----------
    record : LoopRecord
        The record.
    op, pv : float
        Step [% of span, PV units]; 0 does not round.

    Returns
    -------
    LoopRecord
        A record of the same length.

    Raises
    ------
    ParameterError
        When a step is negative.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> from calibration.historian import quantise_signals
    >>> quantise_signals(LoopRecord("FC1", 1.0, op=[50.2, 50.4, 50.6]), op=0.5).op.tolist()
    [50.0, 50.5, 50.5]
    """
    require_record(record)
    steps = {"op": op, "mv": op, "pv": pv, "sp": pv}
    changed: dict[str, Any] = {}
    for name, step in steps.items():
        x = getattr(record, name)
        if require_not_negative(f"step of {name}", step) > 0.0 and x is not None:
            changed[name] = np.round(x / step) * step
    return replace(record, **changed)


def _require_longer_period(record: LoopRecord, dt: float) -> None:
    if require_positive("dt", dt, "s") < record.dt * (1.0 - 1e-9):
        raise ParameterError(
            f"dt = {dt:g} s is shorter than the record's {record.dt:g} s; give {record.dt:g} s or more."
        )


def _tick_indices(record: LoopRecord, dt: float) -> NDArray[np.intp]:
    """Last sample at or before each tick of a slower clock, shape (n_ticks,)."""
    _require_longer_period(record, dt)
    if not len(record):
        return np.empty(0, dtype=np.intp)
    n = int((len(record) - 1) * record.dt / dt * (1.0 + 1e-12)) + 1
    return np.floor(np.arange(n) * (dt / record.dt) * (1.0 + 1e-12)).astype(np.intp)


def _hold_last_value(x: NDArray[np.float64], stored: NDArray[np.intp]) -> NDArray[np.float64]:
    """Hold the last stored value."""
    return x[stored][np.searchsorted(stored, np.arange(x.size), side="right") - 1]


def _exception_indices(x: NDArray[np.float64], deviation: float) -> NDArray[np.intp]:
    """Samples stored by exception, the start and end of missing values included."""
    stored, last = [], np.inf
    for k, value in enumerate(x.tolist()):
        if not abs(value - last) <= deviation and (value == value or last == last):
            stored.append(k)
            last = value
    return np.array(stored, dtype=np.intp)


def _swinging_door_indices(x: NDArray[np.float64], deviation: float) -> NDArray[np.intp]:
    """Samples that the swinging door algorithm stores; the first and the last always."""
    values = x.tolist()
    stored = [0] if values else []
    at, low, high = 0, -np.inf, np.inf
    for k in range(1, len(values)):
        span = k - at
        low = max(low, (values[k] - deviation - values[at]) / span)
        high = min(high, (values[k] + deviation - values[at]) / span)
        if low > high:
            at = k - 1
            stored.append(at)
            low, high = values[k] - deviation - values[at], values[k] + deviation - values[at]
    if len(values) > 1:
        stored.append(len(values) - 1)
    return np.array(stored, dtype=np.intp)
