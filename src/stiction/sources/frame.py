"""Data frames as tables: pandas, polars, pyarrow and whatever else narwhals knows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError
from stiction.sources.table import SNIFF_ROWS, Origin, RawTable

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import polars as pl
    from narwhals import Series

__all__ = ["frame_to_table", "is_frame", "parse_json", "typed_table"]

SAMPLED_NUMBER_COLUMNS = 12
"""Columns of numbers whose first rows stand in the sample of a table; those of the others stay empty, for speed."""
MAX_SAMPLED_CELLS = 4000
"""Cells in the sample of a wide table [-]."""


def is_frame(source: object) -> bool:
    """Say whether an object is a data frame that can be read.

    Examples
    --------
    >>> import polars as pl
    >>> is_frame(pl.DataFrame({"pv": [1.0]})), is_frame("FIC-101.csv")
    (True, False)
    """
    if isinstance(source, str | bytes) or source is None:
        return False
    from narwhals import exceptions, from_native

    try:
        return hasattr(from_native(source, pass_through=True), "collect_schema")
    except exceptions.DuplicateError:  # two columns of one name, which `frame_to_table` refuses
        return True


def frame_to_table(frame: Any, name: str = "") -> RawTable:
    """Make a table of a data frame; columns are converted when they are asked for.

    Parameters
    ----------
    frame : data frame
        Of pandas, polars (eager or lazy), pyarrow or another library that narwhals knows. The index of a pandas frame
        is a column where it holds anything but row numbers. Column names of several levels are joined by a dot. Units
        are read from ``frame.attrs["units"]`` (column -> unit, pandas) and from the fields' metadata (pyarrow).
    name : str, optional
        Tag of a loop whose columns name none; by default ``frame.attrs["tag"]``, or "frame".

    Returns
    -------
    RawTable
        With the types of the frame.

    Raises
    ------
    RecordError
        When it is no data frame, or two columns have the same name.

    Examples
    --------
    >>> import polars as pl
    >>> table = frame_to_table(pl.DataFrame({"time_s": [0.0, 1.0], "FIC-101.PV": [3.0, 3.1]}))
    >>> table.header, table.column(1).to_list()
    ([['time_s', 'FIC-101.PV']], [3.0, 3.1])
    """
    import narwhals as nw

    if not is_frame(frame):
        raise RecordError(f"{type(frame).__name__} is no data frame; give one of pandas, polars or pyarrow.")
    attrs: dict[str, Any] = dict(getattr(frame, "attrs", None) or {})
    units = {_joined(column): str(unit) for column, unit in dict(attrs.get("units") or {}).items()}
    origin = Origin("frame", name or str(attrs.get("tag") or "frame"))
    notes: list[str] = []
    metadata: dict[str, str] = {}
    if nw.dependencies.is_pandas_dataframe(frame):
        frame = _with_index_as_column(frame, units, notes)
    elif nw.dependencies.is_pyarrow_table(frame):
        import polars as pl

        frame, units, metadata = (
            pl.DataFrame(pl.from_arrow(frame)),
            _arrow_units(frame),
            _decoded(frame.schema.metadata),
        )
    try:
        data = nw.from_native(frame)
        native = nw.to_native(data)
        if isinstance(data, nw.LazyFrame) and not data.implementation.is_polars():
            native = nw.to_native(data.collect("polars"))
    except nw.exceptions.DuplicateError as error:
        raise RecordError(f"frame: {str(error).splitlines()[0]}; give each column a name of its own.") from None
    if nw.dependencies.is_polars_dataframe(native) or nw.dependencies.is_polars_lazyframe(native):
        return typed_table(origin, native, units=units, metadata=metadata, notes=notes)
    eager = nw.from_native(native, eager_only=True)
    return _table_of_series(origin, eager.columns, lambda column: _to_polars(eager[column]), units, metadata, notes)


def typed_table(
    origin: Origin,
    frame: pl.DataFrame | pl.LazyFrame,
    *,
    units: Mapping[str, str] | None = None,
    metadata: dict[str, str] | None = None,
    notes: Sequence[str] = (),
) -> RawTable:
    """Make a table of a polars frame; of a lazy one only the columns asked for are read.

    Parameters
    ----------
    origin : Origin
        Where it comes from.
    frame : polars.DataFrame or polars.LazyFrame
        The columns.
    units : mapping, optional
        Heading -> unit; a second header row.
    metadata : dict, optional
        Key and value pairs stored with the frame; those that pandas stores give the index, the levels of column names
        and ``attrs["units"]``.
    notes : sequence of str, optional
        Assumptions made so far.

    Returns
    -------
    RawTable
        Columns are numbers, text, bool, times or durations. `sample` holds fewer rows of a wide table, and of columns
        of floats only the first ones.

    Examples
    --------
    >>> import polars as pl
    >>> frame = pl.LazyFrame({"time_s": [0, 1], "PV": [3.0, None]})
    >>> table = typed_table(Origin("a.parquet", "a"), frame, units={"PV": "m3/h"})
    >>> table.header, table.sample
    ([['time_s', 'PV'], ['', 'm3/h']], [['0', '3.0'], ['1', '']])
    """
    import polars as pl

    lazy = frame.lazy()
    schema = lazy.collect_schema()
    names, headings, stored_units = _read_pandas_names(schema.names(), metadata or {})

    def read(positions: Sequence[int]) -> pl.DataFrame:
        columns = [_plain(names[k], schema[names[k]]) for k in positions]
        return lazy.select(columns).collect()

    n_rows = max(8, min(SNIFF_ROWS, MAX_SAMPLED_CELLS // max(1, len(names))))
    floats = [k for k, name in enumerate(names) if schema[name].is_float()]
    left_out = set(floats[SAMPLED_NUMBER_COLUMNS:])
    sampled = [_plain(name, schema[name]) for k, name in enumerate(names) if k not in left_out]
    texts = lazy.select(sampled).head(n_rows).collect().with_columns(_as_text(pl)) if sampled else pl.DataFrame()
    sample = _fill_sample(texts.rows(), len(names), left_out)
    return RawTable(
        origin,
        _header(headings, stored_units | dict(units or {})),
        sample,
        len(names),
        read,
        notes=list(notes),
        metadata=metadata or {},
    )


def _table_of_series(
    origin: Origin,
    names: Sequence[str],
    load: Callable[[str], pl.Series],
    units: Mapping[str, str],
    metadata: dict[str, str],
    notes: list[str],
) -> RawTable:
    """Make a table of columns that are converted one by one."""
    import polars as pl

    loaded: dict[str, pl.Series] = {}

    def read(positions: Sequence[int]) -> pl.DataFrame:
        for k in positions:
            if names[k] not in loaded:
                loaded[names[k]] = load(names[k])
        frame = pl.DataFrame([loaded[names[k]].alias(names[k]) for k in positions])
        return frame.select(_plain(name, dtype) for name, dtype in frame.schema.items())

    n_rows = max(8, min(SNIFF_ROWS, MAX_SAMPLED_CELLS // max(1, len(names))))
    texts = read(range(len(names))).head(n_rows).with_columns(_as_text(pl)) if names else pl.DataFrame()
    sample = _fill_sample(texts.rows(), len(names), set())
    return RawTable(origin, _header(names, units), sample, len(names), read, notes=notes, metadata=metadata)


def _header(headings: Sequence[str], units: Mapping[str, str]) -> list[list[str]]:
    rows = [list(headings)]
    if any(heading in units for heading in headings):
        rows.append([units.get(heading, "") for heading in headings])
    return rows


def _fill_sample(rows: list[tuple[str, ...]], width: int, left_out: set[int]) -> list[list[str]]:
    """Put the cells read into rows of full width."""
    if not left_out:
        return [list(row) for row in rows]
    places = [k for k in range(width) if k not in left_out]
    sample = []
    for row in rows:
        cells = [""] * width
        for place, cell in zip(places, row, strict=True):
            cells[place] = cell
        sample.append(cells)
    return sample


def _plain(name: str, dtype: pl.DataType) -> pl.Expr:
    """Give a column as numbers, text, bool, times or durations; lists and structures are missing."""
    import polars as pl

    column = pl.col(name)
    if dtype.is_decimal():
        return column.cast(pl.Float64)
    if dtype.is_numeric() or dtype.base_type() in (pl.String, pl.Boolean, pl.Datetime, pl.Date, pl.Duration):
        return column
    if dtype.base_type() in (pl.Categorical, pl.Enum, pl.Time, pl.Binary, pl.Null):
        return column.cast(pl.String, strict=False)
    return pl.lit(None, pl.String).alias(name)


def _as_text(pl: Any) -> list[pl.Expr]:
    """Give plain columns as text: ISO 8601 stamps, durations in seconds, empty for missing ones."""
    import polars.selectors as cs

    stamps = cs.datetime()
    zoned = cs.datetime(time_zone="*")
    forms = [
        (stamps - zoned).dt.strftime("%Y-%m-%dT%H:%M:%S%.f"),
        zoned.dt.strftime("%Y-%m-%dT%H:%M:%S%.f%:z"),
        cs.duration().dt.total_microseconds() / 1e6,
        cs.exclude(stamps, cs.duration()),
    ]
    return [form.cast(pl.String).fill_null("") for form in forms]


def _to_polars(series: Series) -> pl.Series:
    """Convert one column of another library, without pyarrow."""
    import narwhals as nw
    import polars as pl

    dtype = series.dtype
    if dtype.is_numeric():
        return pl.Series(series.cast(nw.Float64).to_numpy()).fill_nan(None)
    if isinstance(dtype, nw.Datetime) and dtype.time_zone is not None:
        utc = series.dt.convert_time_zone("UTC").dt.replace_time_zone(None).to_numpy()
        return pl.Series(utc).dt.replace_time_zone("UTC").dt.convert_time_zone(dtype.time_zone)
    if isinstance(dtype, (nw.Datetime, nw.Duration)):
        return pl.Series(series.to_numpy())
    cells = [None if cell is None or cell != cell else cell for cell in series.to_list()]
    if isinstance(dtype, (nw.Boolean, nw.Date)):
        return pl.Series(cells)
    return pl.Series([None if cell is None else str(cell) for cell in cells], dtype=pl.String)


def _with_index_as_column(frame: Any, units: dict[str, str], notes: list[str]) -> Any:
    """Make a column of a pandas index that holds times, numbers or tags; join column names of several levels."""
    frame = frame.set_axis([_joined(column) for column in frame.columns], axis=1)
    index = frame.index
    kind = type(index).__name__
    if kind == "MultiIndex":
        return frame.reset_index()
    if kind == "RangeIndex" and index.name is None:
        return frame
    if kind == "PeriodIndex":
        frame, kind = frame.set_axis(index.to_timestamp(), axis=0), "DatetimeIndex"
    if index.name is not None:
        heading = _joined(index.name)
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


def _joined(name: Any) -> str:
    """Join a column name of several levels by dots."""
    levels = name if isinstance(name, tuple) else (name,)
    return ".".join(text for level in levels if (text := str(level).strip()))


def _read_pandas_names(names: list[str], metadata: Mapping[str, str]) -> tuple[list[str], list[str], dict[str, str]]:
    """Give the names with the index first, their headings, and units by heading, from what pandas stored."""
    stored = parse_json(metadata.get("pandas", ""))
    index = [name for name in stored.get("index_columns") or [] if isinstance(name, str) and name in names]
    names = index + [name for name in names if name not in index]
    headings = []
    for name in names:
        levels = _parse_tuple(name)
        headings.append("Time" if name.startswith("__index_level_") else _joined(name if levels is None else levels))
    units = parse_json(metadata.get("PANDAS_ATTRS", "")).get("units")
    return names, headings, {_joined(k): str(v) for k, v in units.items()} if isinstance(units, dict) else {}


def _parse_tuple(name: str) -> tuple[Any, ...] | None:
    """Read a column name of several levels as pandas stores it: ``('FIC101', 'PV')``."""
    from ast import literal_eval

    try:
        levels = literal_eval(name) if name.startswith("(") else None
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return None
    return levels if isinstance(levels, tuple) else None


def parse_json(text: str) -> dict[str, Any]:
    """Read a JSON object; what is none gives an empty one.

    Examples
    --------
    >>> parse_json('{"units": {}}'), parse_json("none")
    ({'units': {}}, {})
    """
    import json

    try:
        value = json.loads(text)
    except ValueError:
        return {}
    return value if isinstance(value, dict) else {}


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
