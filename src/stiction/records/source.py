"""Bytes of a record: from a path, "-" or an open binary file, checked and never more than fits."""

from __future__ import annotations

import codecs
import hashlib
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from stiction.errors import RecordError

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["MAX_BYTES", "Source", "load", "text_encoding"]

MAX_BYTES = 256 * 1024 * 1024
_CHUNK = 1024 * 1024
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


@dataclass(frozen=True)
class Source:
    """What was read, and from where."""

    name: str
    """File name as given; "stdin" for a pipe."""
    stem: str
    """Tag of a loop whose header names none."""
    data: bytes
    """The content."""

    @property
    def sha256(self) -> str:
        """Digest of the content, so that a report can name its input."""
        return hashlib.sha256(self.data).hexdigest()


def load(path: str | os.PathLike[str] | BinaryIO, refuse: Callable[[str, bytes], None]) -> Source:
    """Read a path, "-" (standard input) or an open binary file.

    Parameters
    ----------
    path : str, path or binary file
        What to read.
    refuse : callable
        Called with the name and the first bytes before the rest is read; raises when they cannot be a record.

    Raises
    ------
    RecordError
        When there is no such file, it is a folder, empty, unreadable or larger than `MAX_BYTES`.
    """
    if isinstance(path, (str, os.PathLike)):
        text = os.fspath(path)
        if text == "-":
            if sys.stdin.isatty():
                raise RecordError("stdin: nothing is piped in; give a file name or pipe a CSV file.")
            return _drain(sys.stdin.buffer, "stdin", "stdin", refuse)
        try:
            file = open(text, "rb")  # noqa: SIM115 (closed below; only the opening is guarded here)
        except IsADirectoryError:
            raise RecordError(f"{text}: is a folder; name a file in it, such as {text.rstrip('/')}/*.csv.") from None
        except FileNotFoundError:
            raise RecordError(f"{text}: no such file; check the name and the folder.") from None
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise RecordError(f"{text!r}: cannot be read ({reason}); check the name and the rights.") from None
        with file:
            return _drain(file, text, Path(text).stem, refuse)
    if not hasattr(path, "read"):
        raise RecordError(f"cannot read {type(path).__name__} as a record; give a file name or an open binary file.")
    name = getattr(path, "name", "stream")
    name = name if isinstance(name, str) else "stream"
    return _drain(path, name, Path(name).stem, refuse)


def _drain(file: BinaryIO, name: str, stem: str, refuse: Callable[[str, bytes], None]) -> Source:
    data = bytearray()
    while chunk := file.read(_CHUNK):
        if not isinstance(chunk, bytes):
            raise RecordError(f"{name}: was opened as text; open it with mode 'rb'.")
        if not data:
            refuse(name, chunk)
        data += chunk
        if len(data) > MAX_BYTES:
            limit = MAX_BYTES // 1024 // 1024
            raise RecordError(f"{name}: is larger than {limit} MB; export a shorter time or fewer columns.")
    if not data.strip(b" \t\r\n\0\xef\xbb\xbf\xff\xfe"):
        raise RecordError(f"{name}: is empty; export the loop again with a header and rows of numbers.")
    return Source(name, stem, bytes(data))


def text_encoding(data: bytes) -> str | None:
    """Name the encoding of a text, or None where the bytes are no text."""
    for mark, encoding in _MARKS:
        if data.startswith(mark):
            return encoding
    head = data[:4096]
    if 0 in head:
        low, high = head[0::2], head[1::2]
        if high.count(0) > 0.9 * len(high) and low.count(0) == 0:
            return "utf-16-le"
        if low.count(0) > 0.9 * len(low) and high.count(0) == 0:
            return "utf-16-be"
        return None
    if data.isascii():
        return "utf-8"
    decoder = codecs.getincrementaldecoder("utf-8")()
    try:
        for start in range(0, len(data), _CHUNK):
            decoder.decode(data[start : start + _CHUNK], final=start + _CHUNK >= len(data))
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"
