"""Tables whose columns have types: those of polars frames, read column by column when they are asked for."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError
from stiction.sources.table import SNIFF_ROWS, Origin, RawTable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    import polars as pl

__all__ = ["damage_refused", "join_levels", "parse_json", "table_from_series", "typed_table"]

SAMPLED_NUMBER_COLUMNS = 12
"""Columns of numbers whose first rows stand in the sample of a table; those of the others stay empty, for speed."""
MAX_SAMPLED_CELLS = 4000
"""Cells in the sample of a wide table [-]."""


def typed_table(
    origin: Origin,
    frame: pl.DataFrame | pl.LazyFrame,
    *,
    units: Mapping[str, str] | None = None,
    metadata: dict[str, str] | None = None,
    notes: Sequence[str] = (),
    max_bytes: int | None = None,
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
    max_bytes : int, optional
        Size in memory up to which columns are read at once, at 8 bytes a cell [bytes].

    Returns
    -------
    RawTable
        Columns are numbers, text, bool, times or durations. `sample` holds fewer rows of a wide table, and of columns
        of floats only the first ones.

    Raises
    ------
    RecordError
        When the data are damaged; when columns are loaded, also when these are larger than `max_bytes`.

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
    with damage_refused(origin.name):
        schema = lazy.collect_schema()
    names, headings, stored_units = _read_pandas_names(schema.names(), metadata or {})

    def read(positions: Sequence[int]) -> pl.DataFrame:
        columns = [_plain(names[k], schema[names[k]]) for k in positions]
        with damage_refused(origin.name):
            n_rows = lazy.select(pl.len()).collect().item()
            if max_bytes is not None and 8 * n_rows * len(columns) > max_bytes:
                raise RecordError(
                    f"{origin.name}: {n_rows:,} rows of {len(columns)} columns are more than {max_bytes:,} bytes; "
                    "read one loop with tag, or allow more with max_bytes."
                )
            return lazy.select(columns).collect()

    n_rows = max(8, min(SNIFF_ROWS, MAX_SAMPLED_CELLS // max(1, len(names))))
    floats = [k for k, name in enumerate(names) if schema[name].is_float()]
    left_out = set(floats[SAMPLED_NUMBER_COLUMNS:])
    sampled = [_plain(name, schema[name]) for k, name in enumerate(names) if k not in left_out]
    with damage_refused(origin.name):
        texts = lazy.head(n_rows).select(sampled).collect().with_columns(_as_text(pl)) if sampled else pl.DataFrame()
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


@contextmanager
def damage_refused(name: str) -> Iterator[None]:
    """Turn what polars says about damaged data into a `RecordError` that names the file.

    Examples
    --------
    >>> import polars as pl
    >>> with damage_refused("a.parquet"):
    ...     raise pl.exceptions.ComputeError("page header is invalid")
    Traceback (most recent call last):
    stiction.errors.RecordError: a.parquet: is damaged (page header is invalid); copy or export it again.
    """
    from polars.exceptions import PanicException, PolarsError

    try:
        yield
    except (PolarsError, PanicException, OSError, ValueError, OverflowError) as error:
        if isinstance(error, RecordError):
            raise
        text = " ".join(str(error).split())[:200].rstrip(".")
    else:
        return
    raise RecordError(f"{name}: is damaged ({text}); copy or export it again.")


def table_from_series(
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
    return pl.when(column.is_null()).then(None).otherwise(None).cast(pl.String).alias(name)


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


def _read_pandas_names(names: list[str], metadata: Mapping[str, str]) -> tuple[list[str], list[str], dict[str, str]]:
    """Give the names with the index first, their headings, and units by heading, from what pandas stored."""
    stored = parse_json(metadata.get("pandas", ""))
    index = [name for name in stored.get("index_columns") or [] if isinstance(name, str) and name in names]
    names = index + [name for name in names if name not in index]
    headings = []
    for name in names:
        levels = _parse_tuple(name)
        headings.append(
            "Time" if name.startswith("__index_level_") else join_levels(name if levels is None else levels)
        )
    units = parse_json(metadata.get("PANDAS_ATTRS", "")).get("units")
    return names, headings, {join_levels(k): str(v) for k, v in units.items()} if isinstance(units, dict) else {}


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


def join_levels(name: Any) -> str:
    """Join a column name of several levels by dots."""
    levels = name if isinstance(name, tuple) else (name,)
    return ".".join(text for level in levels if (text := str(level).strip()))
