"""File formats: one page each, with `recognises(head, name)` and `read(source, options)`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from stiction.errors import RecordError
from stiction.sources.formats import columnar, excel, matlab, text

if TYPE_CHECKING:
    from stiction.sources.byte_source import ByteSource
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable

__all__ = ["FORMATS", "Format", "read_format", "register_format"]


class Format(Protocol):
    """A page, or any object, that reads one file format."""

    def recognises(self, head: bytes, name: str) -> bool:
        """Whether a file with these first bytes and this name has the format."""
        ...

    def read(self, source: ByteSource, options: ReadOptions) -> list[RawTable]:
        """Give the tables of a file."""
        ...


FORMATS: list[Format] = [columnar, matlab, excel, text]
"""Formats in the order in which they are tried."""


def register_format(page: Format) -> None:
    """Add a file format; it is tried before all others.

    Examples
    --------
    >>> from stiction.sources.formats import FORMATS, register_format, text
    >>> register_format(text)
    >>> FORMATS.pop(0) is text
    True
    """
    FORMATS.insert(0, page)


def read_format(source: ByteSource, options: ReadOptions) -> list[RawTable]:
    """Read the tables of a file with the first format that recognises it."""
    for page in FORMATS:
        if page.recognises(source.head, source.origin.name):
            return page.read(source, options)
    raise RecordError("is binary, not text; export the loop as CSV, Parquet or Excel.", where=source.origin.name)
