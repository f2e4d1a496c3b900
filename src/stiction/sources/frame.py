"""Data frames as tables: pandas, polars, pyarrow and whatever else narwhals knows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import narwhals as nw
import polars as pl

from stiction.errors import RecordError
from stiction.sources.table import Origin, RawTable
from stiction.sources.typed_table import join_levels, make_series, typed_table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from narwhals import Series


__all__ = ["frame_to_table"]


def frame_to_table(frame: Any, name: str = "") -> RawTable:
    """Make a table of any data frame that narwhals knows, its pandas index a column.

    Units come from ``attrs["units"]`` or the fields of pyarrow; a loop without a tag has `name` or ``attrs["tag"]``.
    """
    attrs: dict[str, Any] = dict(getattr(frame, "attrs", None) or {})
    units = {join_levels(column): str(unit) for column, unit in dict(attrs.get("units") or {}).items()}
    origin = Origin("frame", name or str(attrs.get("tag") or "frame"))
    notes: list[str] = []
    metadata: dict[str, str] = {}
    if nw.dependencies.is_pandas_dataframe(frame):
        frame = _with_index_as_column(frame, units, notes)
    elif nw.dependencies.is_pyarrow_table(frame):
        frame, units, metadata = (
            pl.DataFrame(pl.from_arrow(frame)),
            _arrow_units(frame),
            _decoded(frame.schema.metadata),
        )
    try:
        data = nw.from_native(frame)
        if isinstance(data, nw.LazyFrame) and not data.implementation.is_polars():
            data = data.collect("polars")
    except nw.exceptions.DuplicateError as error:
        text = " ".join(str(error).split())
        raise RecordError(f"frame: {text}; give each column another name.") from None
    except TypeError:
        raise RecordError(
            f"cannot read an object of type {type(frame).__name__}; give a file name, an open binary file, a data "
            "frame or a database URL."
        ) from None
    native = nw.to_native(data)
    if isinstance(data, nw.DataFrame) and not data.implementation.is_polars():
        native = pl.DataFrame([_to_polars(data[name]).alias(name) for name in data.columns])
    return typed_table(origin, native, units=units, metadata=metadata, notes=notes)


def _to_polars(series: Series) -> pl.Series:
    """Convert one column of another library, without pyarrow."""
    dtype = series.dtype
    if dtype.is_numeric():
        return pl.Series(series.cast(nw.Float64).to_numpy()).fill_nan(None)
    if isinstance(dtype, nw.Datetime) and dtype.time_zone is not None:
        utc = series.dt.convert_time_zone("UTC").dt.replace_time_zone(None).to_numpy()
        return pl.Series(utc).dt.replace_time_zone("UTC").dt.convert_time_zone(dtype.time_zone)
    if isinstance(dtype, (nw.Datetime, nw.Duration)):
        return pl.Series(series.to_numpy())
    return make_series([None if cell is None or cell != cell else cell for cell in series.to_list()])


def _with_index_as_column(frame: Any, units: dict[str, str], notes: list[str]) -> Any:
    """Make a column of a pandas index that holds times, numbers or tags; join column names of several levels."""
    frame = frame.set_axis([join_levels(column) for column in frame.columns], axis=1)
    index = frame.index
    kind = type(index).__name__
    if kind == "MultiIndex":
        return frame.reset_index()
    if kind == "RangeIndex" and index.name is None:
        return frame
    if kind == "PeriodIndex":
        frame, kind = frame.set_axis(index.to_timestamp(), axis=0), "DatetimeIndex"
    if index.name is not None:
        heading = join_levels(index.name)
    elif kind in ("DatetimeIndex", "TimedeltaIndex"):
        heading = "Time"
    elif index.dtype.kind == "f":
        heading = "Time"
        units[heading] = "s"
        notes.append("The index of the frame was taken as time in seconds.")
    else:
        heading = "index" if index.dtype.kind in "iu" else ""
    if heading in frame.columns:
        return frame
    frame = frame.copy(deep=False)
    frame.insert(0, heading, frame.index)
    return frame.reset_index(drop=True)


def _arrow_units(table: Any) -> dict[str, str]:
    """Read the units that stand in the fields' metadata of a pyarrow table."""
    units = {}
    for one in table.schema:
        stored = {key.lower(): value for key, value in _decoded(one.metadata).items()}
        if unit := stored.get("unit") or stored.get("units"):
            units[one.name] = unit
    return units


def _decoded(metadata: Mapping[bytes, bytes] | None) -> dict[str, str]:
    return {key.decode("utf-8", "replace"): value.decode("utf-8", "replace") for key, value in (metadata or {}).items()}
