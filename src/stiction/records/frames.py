"""Loop records as data frames."""

from __future__ import annotations

from datetime import UTC
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.display.frames import require_library
from stiction.errors import MissingExtraError, ParameterError, RecordError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

__all__ = ["SIGNALS", "as_records", "read_columns", "stack_records", "to_frame"]

SIGNALS = ("pv", "op", "sp", "mv", "valve_signal", "auto")
"""Signals of a record, in the order of the columns."""


def to_frame(records: Any, native: str = "polars") -> Any:
    """Make a data frame of one or several records.

    `native` is the library: "pandas", "polars" or "pyarrow". The columns are ``time``, then the signals that the record
    has: pv and sp [engineering units], op, mv and valve_signal [% of span], auto (bool); of several records a column
    ``tag`` is the first one. Time is the time of day when all records have a start, else the time since the start [s].
    A missing value is NaN (pandas) or null. ``frame.attrs`` of pandas holds ``units``, and the ``tag`` of a single
    record. Raises ParameterError for another library, MissingExtraError when it is not installed, and RecordError for
    what is no record.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> record = LoopRecord("FIC-101", 2.0, op=[50.0, 51.0], pv=[3.0, 3.1])
    >>> to_frame(record).rows()
    [(0.0, 3.0, 50.0), (2.0, 3.1, 51.0)]
    """
    require_library(native)
    is_single = _is_record(records)
    loops = as_records(records)
    names = [name for name in SIGNALS if any(getattr(loop, name) is not None for loop in loops)]
    frame = stack_records(loops, names)
    if is_single:
        frame = frame.drop("tag")
    if native == "polars":
        return frame
    try:
        if native == "pyarrow":
            return frame.to_arrow()
        result = _to_pandas(frame)
    except ImportError:
        raise MissingExtraError(f"{native} is not installed; install it with: pip install {native}") from None
    result.attrs["units"] = _units(loops, names)
    if is_single:
        result.attrs["tag"] = loops[0].tag
    return result


def read_columns(
    frame: Any, names: Mapping[str, str | None], *, time: str, dt: float | None, tag: str
) -> dict[str, Any]:
    """Read the named columns of a frame (signal -> column) as arguments of a record; see `LoopRecord.from_frame`."""
    import narwhals as nw

    try:
        table = nw.from_native(frame, eager_only=True)
    except TypeError:
        raise ParameterError(
            f"frame is of type {type(frame).__name__}; give a data frame of pandas, polars or pyarrow."
        ) from None
    columns = {name: column for name, column in names.items() if column is not None and column in table.columns}
    missing = [str(names[name]) for name in ("op", "pv") if name not in columns]
    missing += [time] if dt is None and time not in table.columns else []
    if missing:
        raise RecordError(
            f"the frame has no column {missing[0]!r}; its columns are "
            f"{', '.join(map(str, table.columns[:20]))}. Name the columns with op=, pv=, time= or give dt=.",
            where=tag,
        )
    start = None
    if dt is None:
        column = table[time]
        if column.dtype.is_temporal():
            start = getattr(column[0], "to_pydatetime", lambda first=column[0]: first)()
            column = (column - column[0]).dt.total_microseconds() / 1e6
        steps = np.diff(column.to_numpy().astype(np.float64))
        dt = float(np.median(steps)) if steps.size else 1.0
        if steps.size and not float(np.abs(steps - dt).max()) <= 0.01 * abs(dt):
            raise RecordError(
                f"the time steps of column {time!r} differ ({steps.min():g} to {steps.max():g} s); read the "
                "frame with stiction.read, which resamples it to an even time grid.",
                where=tag,
            )
    return {"dt": dt, "start": start, **{name: table[column].to_numpy() for name, column in columns.items()}}


def as_records(records: Any) -> list[Any]:
    """Give one or several records as a list, and refuse what is no record."""
    loops = [records] if _is_record(records) else list(records)
    for loop in loops:
        if not _is_record(loop):
            raise RecordError(
                f"cannot write {loop!r:.60} of type {type(loop).__name__}; give records, as stiction.read returns them."
            )
    return loops


def _is_record(item: object) -> bool:
    return all(hasattr(item, name) for name in (*SIGNALS, "provenance"))


def stack_records(loops: Sequence[Any], names: Sequence[str]) -> pl.DataFrame:
    """Put the rows of all records below each other; missing values are null."""
    import polars as pl

    types = {name: pl.Boolean if name == "auto" else pl.Float64 for name in names}
    frames = []
    for loop in loops:
        columns: list[Any] = [pl.lit(loop.tag, pl.String).alias("tag"), pl.col("time")]
        for name, dtype in types.items():
            signal = getattr(loop, name)
            columns.append(pl.lit(None, dtype).alias(name) if signal is None else pl.Series(name, signal, dtype))
        frames.append(pl.DataFrame({"time": _times(loop, loops)}).select(columns))
    if not frames:
        frames = [pl.DataFrame(schema={"tag": pl.String, "time": pl.Float64, **types})]
    frame = pl.concat(frames).with_columns(pl.col(pl.Float64).fill_nan(None))
    if frame.schema["time"] == pl.Datetime and loops[0].start is not None and loops[0].start.tzinfo is not None:
        frame = frame.with_columns(pl.col("time").dt.replace_time_zone("UTC"))
    return frame


def _to_pandas(frame: pl.DataFrame) -> Any:
    """Convert to pandas, without pyarrow."""
    import pandas as pd
    import polars as pl

    result = pd.DataFrame()
    for column in frame:
        if column.dtype == pl.Float64:
            result[column.name] = column.fill_null(np.nan).to_numpy()
        elif column.dtype == pl.Datetime:
            utc = column.dt.replace_time_zone(None).to_numpy()
            zone = getattr(column.dtype, "time_zone", None)
            result[column.name] = pd.Series(utc).dt.tz_localize(zone) if zone else utc
        else:
            result[column.name] = pd.Series(column.to_list(), dtype="boolean" if column.null_count() else None)
    return result


def _times(loop: Any, loops: Sequence[Any]) -> np.ndarray:
    """Time of each sample: of day when all loops have a start in one kind of clock, else since the start [s]."""
    starts = [each.start for each in loops]
    zoned = {start.tzinfo is not None for start in starts if start is not None}
    if None in starts or len(zoned) != 1 or loop.start is None:
        return loop.time
    start = loop.start.astimezone(UTC).replace(tzinfo=None) if loop.start.tzinfo else loop.start
    return np.datetime64(start, "us") + np.round(loop.time * 1e6).astype("timedelta64[us]")


def _units(loops: Sequence[Any], names: Sequence[str]) -> dict[str, str]:
    """Give the unit of each column in which all records agree."""
    pv = {loop.provenance.pv_unit for loop in loops}
    op = {loop.provenance.op_unit or "%" for loop in loops}
    of_pv, of_op = pv.pop() if len(pv) == 1 else "", op.pop() if len(op) == 1 else ""
    units = {"pv": of_pv, "sp": of_pv, "op": of_op, "valve_signal": of_op, "mv": "%"}
    return {name: unit for name, unit in units.items() if unit and name in names}
