"""Decompress gz, zst and zip into temporary files, counted as they grow."""

from __future__ import annotations

import gzip
import zipfile
from functools import partial
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError, Setting
from stiction.foreign_errors import damage_refused
from stiction.sources.options import MAX_RATIO

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

__all__ = ["ByteLimit", "inflate"]

CHUNK_BYTES = 1 << 20
MIN_RATIO_BYTES = 10_000_000
"""Size after decompression from which the ratio is limited [bytes]."""
MAX_MEMBERS = 10_000
"""Files of one zip archive [-]."""
_GZIP, _ZSTD, _ZIP, _EMPTY_ZIP = b"\x1f\x8b", b"\x28\xb5\x2f\xfd", b"PK\x03\x04", b"PK\x05\x06"


class ByteLimit:
    """Counts bytes, and refuses more than may be read."""

    def __init__(self, name: str, max_bytes: int, compressed: int = 0) -> None:
        self.name, self.max_bytes, self.compressed, self.size = name, max_bytes, compressed, 0

    def add(self, n: int) -> None:
        """Count `n` more bytes."""
        self.size += n
        if self.size > self.max_bytes:
            after = " after decompression" if self.compressed else ""
            raise RecordError(
                f"is larger than {_megabytes(self.max_bytes)}{after} ({_megabytes(self.size)} so far)",
                remedy=("export a shorter time or fewer columns, or raise the limit with ", Setting("max_bytes")),
                where=self.name,
            )
        if self.compressed and self.size > max(MIN_RATIO_BYTES, MAX_RATIO * self.compressed):
            raise RecordError(
                f"decompresses to more than {MAX_RATIO} times its size ({_megabytes(self.size)} so far "
                f"from {_megabytes(self.compressed)}), as a damaged or harmful file does; if it is neither, unpack it.",
                where=self.name,
            )


def inflate(
    path: Path, head: bytes, limit: ByteLimit, make_folder: Callable[[], Path]
) -> list[tuple[str, Path]] | None:
    """Decompress into a folder, at most `limit` bytes: file of each name within the archive; None for other files."""
    if head.startswith(_GZIP):
        with gzip.open(path) as stream:
            return [
                (
                    "",
                    _write(
                        iter(partial(stream.read, CHUNK_BYTES), b""), make_folder() / f"{path.name}.inflated", limit
                    ),
                )
            ]
    if head.startswith(_ZSTD):
        return [("", _write(_zstd_chunks(path), make_folder() / f"{path.name}.inflated", limit))]
    if not head.startswith((_ZIP, _EMPTY_ZIP)):
        return None
    with damage_refused(limit.name), zipfile.ZipFile(path) as archive:
        members = [member for member in archive.infolist() if _is_data_file(member)]
        declared = ByteLimit(limit.name, limit.max_bytes, limit.compressed)
        for member in members:
            declared.add(member.file_size)
        if any(member.filename in ("[Content_Types].xml", "mimetype") for member in members):
            return None  # a workbook or another document
        if not 0 < len(members) <= MAX_MEMBERS:
            raise RecordError(
                f"is a zip archive of {len(members)} files; pack 1 to {MAX_MEMBERS} exported files.", where=limit.name
            )
        if any(member.flag_bits & 1 for member in members):
            raise RecordError("is encrypted; unpack it with its password first.", where=limit.name)
        files = []
        for number, member in enumerate(members):
            with archive.open(member) as stream:
                out = _write(
                    iter(partial(stream.read, CHUNK_BYTES), b""), make_folder() / f"{path.name}.{number}", limit
                )
            files.append((member.filename, out))
    return files


def _write(chunks: Iterator[bytes], path: Path, limit: ByteLimit) -> Path:
    """Write decompressed bytes into a file, counted."""
    with damage_refused(limit.name), open(path, "wb") as file:
        for chunk in chunks:
            limit.add(len(chunk))
            file.write(chunk)
    return path


def _chunks(stream: Any) -> Iterator[bytes]:
    return iter(partial(stream.read, CHUNK_BYTES), b"")


def _zstd_chunks(path: Path) -> Iterator[bytes]:
    """Decompress frame by frame; 4 KB at a time, because they may become 30 000 times as much."""
    import zstandard

    frame = zstandard.ZstdDecompressor().decompressobj()
    with open(path, "rb") as file:
        while data := file.read(4096):
            while data:
                if frame.eof:
                    frame = zstandard.ZstdDecompressor().decompressobj()
                yield frame.decompress(data)
                data = frame.unused_data if frame.eof else b""
    if not frame.eof:
        raise EOFError("it ends within a frame")


def _is_data_file(member: zipfile.ZipInfo) -> bool:
    name = PurePosixPath(member.filename).name
    return not member.is_dir() and not member.filename.startswith("__MACOSX/") and not name.startswith(".")


def _megabytes(n: int) -> str:
    return f"{n / 1e6:.4g} MB"
