"""Arrow files: Feather, Arrow IPC files and Arrow streams."""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl

from stiction.errors import RecordError
from stiction.sources.typed_table import damage_refused, typed_table

if TYPE_CHECKING:
    from stiction.sources.byte_source import ByteSource
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable

__all__ = ["read", "recognises"]

STREAM_START = b"\xff\xff\xff\xff"


def recognises(head: bytes, name: str) -> bool:
    """Whether a file is an Arrow file or stream by its first bytes, a stream by its name too."""
    stream = head.startswith(STREAM_START) and name.lower().endswith((".arrow", ".arrows", ".ipc", ".feather"))
    return stream or head.startswith((b"ARROW1", b"FEA1"))


def read(source: ByteSource, options: ReadOptions) -> list[RawTable]:
    """Read an Arrow file or stream as one table."""
    name = source.origin.name
    if source.head.startswith(b"FEA1"):
        raise RecordError("is a Feather file of version 1, which cannot be read; save it as Parquet.", where=name)
    with damage_refused(name):
        stream = source.head.startswith(STREAM_START)
        frame = pl.read_ipc_stream(source.path) if stream else pl.scan_ipc(source.path, glob=False)
    return [typed_table(source.origin, frame, max_bytes=options.max_bytes, keep=source)]
