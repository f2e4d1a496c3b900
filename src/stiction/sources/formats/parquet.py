"""Parquet files, alone or as a data set of several; only the columns that are asked for are read."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from stiction.sources.typed_table import damage_refused, typed_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

    from stiction.sources.byte_source import ByteSource
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable

__all__ = ["read", "read_data_set", "recognises"]

MAX_DIGEST_BYTES = 8_000_000
"""Size of a file above which no digest is made: that would take longer than to read one loop [bytes]."""


def recognises(head: bytes, name: str) -> bool:  # noqa: ARG001
    """Whether a file is Parquet, by its first bytes."""
    return head.startswith((b"PAR1", b"PARE"))


def read(source: ByteSource, options: ReadOptions) -> list[RawTable]:
    """Read a Parquet file as one table with its types; of its columns only those asked for."""
    return [_table([source], options)]


def read_data_set(sources: Sequence[ByteSource], options: ReadOptions) -> list[RawTable]:
    """Read several Parquet files, of which some may be parts of one table.

    Files with the same columns are parts of one table when one of the columns is text (a long table), or when no two
    of them cover the same time.

    Parameters
    ----------
    sources : sequence of ByteSource
        The files.
    options : ReadOptions
        As in `read`.

    Returns
    -------
    list of RawTable
        One table of each group of files.

    Raises
    ------
    RecordError
        When a file is damaged or encrypted.
    """
    groups: dict[tuple[Any, ...], list[ByteSource]] = {}
    for source in sources:
        with damage_refused(source.origin.name):
            schema = _scan([source]).collect_schema()
        groups.setdefault(tuple(schema.items()), []).append(source)
    tables = []
    for schema, group in groups.items():
        ordered = group if len(group) == 1 else _order_parts(group, dict(schema))
        tables += [_table(ordered, options)] if ordered else [_table([source], options) for source in group]
    return tables


def _scan(sources: Sequence[ByteSource]) -> pl.LazyFrame:
    import polars as pl

    return pl.scan_parquet([source.path for source in sources], glob=False, hive_partitioning=False)


def _table(sources: Sequence[ByteSource], options: ReadOptions) -> RawTable:
    """Make one table of the parts of it."""
    import polars as pl

    first = sources[0]
    with damage_refused(first.origin.name):
        metadata = {key: value for key, value in pl.read_parquet_metadata(first.path).items() if key != "ARROW:schema"}
    origin = first.origin if first.size <= MAX_DIGEST_BYTES else replace(first.origin, digest=None)
    return typed_table(origin, _scan(sources), metadata=metadata, max_bytes=options.max_bytes, keep=tuple(sources))


def _order_parts(sources: Sequence[ByteSource], schema: dict[str, pl.DataType]) -> list[ByteSource]:
    """Put the parts of one table in order of time; empty when they are tables of their own."""
    import polars as pl

    if any(dtype == pl.String or dtype == pl.Categorical for dtype in schema.values()):
        return list(sources)
    times = [name for name, dtype in schema.items() if dtype.is_temporal()]
    if not times:
        return []
    spans = []
    for source in sources:
        with damage_refused(source.origin.name):
            low, high = (
                _scan([source]).select(pl.min(times[0]).alias("low"), pl.max(times[0]).alias("high")).collect().row(0)
            )
        if low is None:
            return []
        spans.append((low, high, source))
    spans.sort(key=lambda span: span[0])
    overlap = any(before[1] >= after[0] for before, after in pairwise(spans))
    return [] if overlap else [source for _, _, source in spans]
