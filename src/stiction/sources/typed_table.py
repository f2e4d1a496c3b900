"""Tables whose columns have types: those of polars frames, read column by column when they are asked for."""

from __future__ import annotations

import json
from ast import literal_eval
from functools import cache
from typing import TYPE_CHECKING, Any

import polars as pl

from stiction.errors import RecordError, Setting
from stiction.foreign_errors import damage_refused
from stiction.sources.table import SNIFF_ROWS, Origin, RawTable

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

__all__ = ["join_levels", "make_series", "stack_series", "typed_table"]

MAX_SAMPLED_CELLS = 4000
"""Cells in the sample of a wide table [-]."""
MAX_SAMPLED_FLOAT_COLUMNS = 12
"""Columns of floats of which the sample holds cells; those of the others are empty, as reading all takes long."""
MIN_SPARSE_ROWS = 20
"""Rows below which the sample does not show that columns are sparse, so that one column of floats is enough [-]."""


def typed_table(
    origin: Origin,
    frame: pl.DataFrame | pl.LazyFrame,
    *,
    units: Mapping[str, str] | None = None,
    metadata: dict[str, str] | None = None,
    notes: Sequence[str] = (),
    max_bytes: int | None = None,
    keep: object = None,
) -> RawTable:
    """Make a table of a polars frame, of a lazy one only the columns asked for; it keeps `keep` alive.

    `units` by heading are a second header row; `metadata` of pandas give index, levels and units. At most `max_bytes`
    are read at once. The sample has fewer rows of a wide table, and of floats only the first columns.
    """
    lazy = frame.lazy()
    with damage_refused(origin.name):
        schema = lazy.collect_schema()
    names, headings, stored_units = _read_pandas_names(schema.names(), metadata or {})
    units = stored_units | dict(units or {})

    types = dict(schema)
    n_rows = max(8, min(SNIFF_ROWS, MAX_SAMPLED_CELLS // max(1, len(names))))
    n_floats = MAX_SAMPLED_FLOAT_COLUMNS if n_rows >= MIN_SPARSE_ROWS else 1
    unsampled = set([name for name in names if types[name].is_float()][n_floats:])

    @cache
    def count_rows() -> int:
        return lazy.select(pl.len()).collect().item()

    def read(positions: Sequence[int], first_row: int = 0, _keep: object = keep) -> pl.DataFrame:
        with damage_refused(origin.name):
            if max_bytes is not None and 8 * (count_rows() - first_row) * len(positions) > max_bytes:
                raise RecordError(
                    f"{count_rows():,} rows of {len(positions)} columns exceed {max_bytes:,} bytes",
                    remedy=("read one loop with ", Setting("tag"), ", or allow more with ", Setting("max_bytes")),
                    where=origin.name,
                )
            rows = lazy.slice(first_row) if first_row else lazy
            return rows.select(_to_plain_type(names[k], types[names[k]]) for k in positions).collect()

    with damage_refused(origin.name):
        columns = [pl.lit("").alias(name) if name in unsampled else _to_plain_type(name, types[name]) for name in names]
        head = lazy.head(n_rows).select(columns).collect().with_columns(_to_text())
    sample = [list(cells) for cells in head.rows()]
    header = [headings, *([[units.get(one, "") for one in headings]] if units.keys() & set(headings) else [])]
    return RawTable(
        origin, header, sample, len(names), read, notes=list(notes), metadata=metadata or {}, count_rows=count_rows
    )


def make_series(cells: Sequence[Any]) -> pl.Series:
    """Make a column of Python values; of several types it is text."""
    try:
        return pl.Series(cells, strict=False)
    except (pl.exceptions.PolarsError, TypeError, ValueError, OverflowError):
        return pl.Series([None if cell is None else str(cell) for cell in cells], dtype=pl.String)


def stack_series(parts: Iterable[pl.Series]) -> pl.Series:
    """Put parts of a column under each other; of several types they are numbers where all are, else text."""
    parts = list(parts)
    types = {part.dtype for part in parts} - {pl.Null}
    both = pl.Float64 if all(dtype.is_numeric() for dtype in types) else pl.String
    return pl.concat([part.cast(next(iter(types)) if len(types) == 1 else both) for part in parts])


def join_levels(name: Any) -> str:
    """Join a column name of several levels by dots: ``('FIC-101', 'PV')`` is FIC-101.PV."""
    levels = name if isinstance(name, tuple) else (name,)
    return ".".join(text for level in levels if (text := str(level).strip()))


def _to_plain_type(name: str, dtype: pl.DataType) -> pl.Expr:
    """Give a column as numbers, text, bool, times or durations; lists and structures are missing."""
    column = pl.col(name)
    if dtype.is_decimal():
        return column.cast(pl.Float64)
    if dtype.is_numeric() or dtype.base_type() in (pl.String, pl.Boolean, pl.Datetime, pl.Date, pl.Duration):
        return column
    if dtype.base_type() in (pl.Categorical, pl.Enum, pl.Time, pl.Binary, pl.Null):
        return column.cast(pl.String, strict=False)
    return pl.when(column.is_null()).then(None).otherwise(None).cast(pl.String).alias(name)


def _to_text() -> list[pl.Expr]:
    """Give columns as text: ISO 8601 stamps, durations in seconds, empty for missing ones."""
    import polars.selectors as cs

    zoned = cs.datetime(time_zone="*")
    forms = [
        (cs.datetime() - zoned).dt.strftime("%Y-%m-%dT%H:%M:%S%.f"),
        zoned.dt.strftime("%Y-%m-%dT%H:%M:%S%.f%:z"),
        cs.duration().dt.total_microseconds() / 1e6,
        cs.exclude(cs.datetime(), cs.duration()),
    ]
    return [form.cast(pl.String).fill_null("") for form in forms]


def _read_pandas_names(names: list[str], metadata: Mapping[str, str]) -> tuple[list[str], list[str], dict[str, str]]:
    """Give the names with the index first, their headings, and units by heading, from what pandas stored."""
    stored, attrs = (_parse_json(metadata.get(key, "")) for key in ("pandas", "PANDAS_ATTRS"))
    index = [name for name in stored.get("index_columns") or [] if isinstance(name, str) and name in names]
    names = index + [name for name in names if name not in index]
    headings = ["Time" if name.startswith("__index_level_") else _parse_levels(name) for name in names]
    units = attrs.get("units")
    return names, headings, {str(k): str(v) for k, v in units.items()} if isinstance(units, dict) else {}


def _parse_levels(name: str) -> str:
    """Read a column name of several levels as pandas stores it: ``('FIC101', 'PV')``."""
    try:
        return join_levels(literal_eval(name) if name.startswith("('") else name)
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return name


def _parse_json(text: str) -> dict[str, Any]:
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return value if isinstance(value, dict) else {}
