"""Parquet and Arrow files (Feather, Arrow IPC files and streams); only the columns that are asked for are read."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import polars as pl

from stiction.errors import RecordError
from stiction.foreign_errors import damage_refused
from stiction.sources.memory import require_memory
from stiction.sources.typed_table import typed_table

if TYPE_CHECKING:
    from stiction.sources.byte_source import ByteSource
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable

__all__ = ["is_parquet", "read", "recognises"]

STREAM_START = b"\xff\xff\xff\xff"
MAX_DIGEST_BYTES = 8_000_000
"""Size of a Parquet file above which no digest is made: that would take longer than to read one loop [bytes]."""


def is_parquet(head: bytes) -> bool:
    """Whether a file is Parquet, by its first bytes."""
    return head.startswith((b"PAR1", b"PARE"))


def recognises(head: bytes, name: str) -> bool:
    """Whether a file is Parquet or Arrow by its first bytes, or an Arrow stream by its name too."""
    stream = head.startswith(STREAM_START) and name.lower().endswith((".arrow", ".arrows", ".ipc", ".feather"))
    return stream or is_parquet(head) or head.startswith((b"ARROW1", b"FEA1"))


def read(source: ByteSource, options: ReadOptions) -> list[RawTable]:
    """Read a file as one table with its types; of its columns only those asked for."""
    name, head, metadata = source.origin.name, source.head, {}
    has_digest = source.size <= MAX_DIGEST_BYTES or not is_parquet(head)
    origin = source.origin if has_digest else replace(source.origin, digest=None)
    if head.startswith(b"FEA1"):
        raise RecordError("is a Feather file of version 1, which cannot be read; save it as Parquet.", where=name)
    with damage_refused(name):
        if is_parquet(head):
            stored = pl.read_parquet_metadata(source.path)
            metadata = {key: value for key, value in stored.items() if key != "ARROW:schema"}
            frame = pl.scan_parquet(source.path, glob=False, hive_partitioning=False)
        elif head.startswith(STREAM_START):
            require_memory(source.size, options.max_memory, name)
            frame = pl.read_ipc_stream(source.path)
        else:
            frame = pl.scan_ipc(source.path, glob=False)
    return [typed_table(origin, frame, metadata=metadata, max_bytes=options.max_bytes, keep=source)]
