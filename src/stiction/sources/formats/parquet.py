"""Parquet files; only the columns that are asked for are read."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import polars as pl

from stiction.sources.typed_table import damage_refused, typed_table

if TYPE_CHECKING:
    from stiction.sources.byte_source import ByteSource
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable

__all__ = ["read", "recognises"]

MAX_DIGEST_BYTES = 8_000_000
"""Size of a file above which no digest is made: that would take longer than to read one loop [bytes]."""


def recognises(head: bytes, name: str) -> bool:  # noqa: ARG001
    """Whether a file is Parquet, by its first bytes."""
    return head.startswith((b"PAR1", b"PARE"))


def read(source: ByteSource, options: ReadOptions) -> list[RawTable]:
    """Read a Parquet file as one table with its types; of its columns only those asked for."""
    origin = source.origin if source.size <= MAX_DIGEST_BYTES else replace(source.origin, digest=None)
    with damage_refused(origin.name):
        metadata = {key: value for key, value in pl.read_parquet_metadata(source.path).items() if key != "ARROW:schema"}
    frame = pl.scan_parquet(source.path, glob=False, hive_partitioning=False)
    return [typed_table(origin, frame, metadata=metadata, max_bytes=options.max_bytes, keep=source)]
