"""Decompress gz, zst and zip into temporary files, counted as they grow."""

from __future__ import annotations

import gzip
import zipfile
import zlib
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import IO, TYPE_CHECKING

from stiction.errors import RecordError
from stiction.sources.options import MAX_RATIO

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

__all__ = ["ByteLimit", "inflate", "require_small_zip"]

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
                f"{self.name}: is larger than {_megabytes(self.max_bytes)}{after} ({_megabytes(self.size)} so far); "
                "export a shorter time or fewer columns, or raise the limit with max_bytes= or --max-bytes."
            )
        if self.compressed and self.size > max(MIN_RATIO_BYTES, MAX_RATIO * self.compressed):
            raise RecordError(
                f"{self.name}: decompresses to more than {MAX_RATIO} times its size ({_megabytes(self.size)} so far "
                f"from {_megabytes(self.compressed)}), as a damaged or harmful file does; if it is neither, unpack it."
            )


def require_small_zip(path: Path, head: bytes, name: str, max_bytes: int) -> None:
    """Refuse a zip file, a workbook for example, whose files are too large by its table of contents."""
    if not head.startswith(_ZIP):
        return
    limit = ByteLimit(name, max_bytes, path.stat().st_size)
    for member in _list_members(path, name):
        limit.add(member.file_size)


def inflate(
    path: Path, head: bytes, name: str, max_bytes: int, make_folder: Callable[[], Path]
) -> list[tuple[str, Path]] | None:
    """Decompress a file.

    Parameters
    ----------
    path : Path
        The file.
    head : bytes
        Its first bytes.
    name : str
        Its name for messages.
    max_bytes : int
        Largest size after decompression [bytes].
    make_folder : callable
        Gives the folder for the files, when one is needed.

    Returns
    -------
    list of (str, Path) or None
        Name within the archive (empty for gz and zst) and file; None when the file is not compressed, or is a workbook.

    Raises
    ------
    RecordError
        When the file is damaged, encrypted, holds no file or grows too large.
    """
    limit = ByteLimit(name, max_bytes, path.stat().st_size)
    if head.startswith(_GZIP):
        with gzip.open(path) as stream:
            return [("", _write(_chunks(stream), make_folder() / f"{path.name}.inflated", limit))]
    if head.startswith(_ZSTD):
        return [("", _write(_zstd_chunks(path), make_folder() / f"{path.name}.inflated", limit))]
    if head.startswith(_EMPTY_ZIP):
        raise RecordError(f"{name}: is a zip archive without files; pack the exported files again.")
    if not head.startswith(_ZIP) or _is_document(members := _list_members(path, name)):
        return None
    files = [member for member in members if _is_data_file(member.filename) and not member.is_dir()]
    if not files:
        raise RecordError(f"{name}: is a zip archive without files; pack the exported files again.")
    if any(member.flag_bits & 1 for member in files):
        raise RecordError(f"{name}: is encrypted; unpack it with its password first.")
    found: list[tuple[str, Path]] = []
    with zipfile.ZipFile(path) as archive:
        for number, member in enumerate(files):
            with _reads(name), archive.open(member) as stream:
                out = make_folder() / f"{path.name}.{number}"
                found.append((member.filename, _write(_chunks(stream), out, limit)))
    return found


def _write(chunks: Iterator[bytes], path: Path, limit: ByteLimit) -> Path:
    """Write decompressed bytes into a file, counted; a damaged stream is refused and its file deleted."""
    try:
        with _reads(limit.name), open(path, "wb") as file:
            for chunk in chunks:
                limit.add(len(chunk))
                file.write(chunk)
    except RecordError:
        path.unlink(missing_ok=True)
        raise
    return path


def _chunks(stream: IO[bytes]) -> Iterator[bytes]:
    while chunk := stream.read(CHUNK_BYTES):
        yield chunk


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


@contextmanager
def _reads(name: str) -> Iterator[None]:
    """Say that a compressed file is damaged, instead of the error of its library."""
    try:
        yield
    except (OSError, EOFError, zlib.error, zipfile.BadZipFile, RuntimeError, NotImplementedError, ValueError) as error:
        if isinstance(error, RecordError):
            raise
        raise _damaged(name, error) from None
    except Exception as error:
        if type(error).__name__ not in ("ZstdError", "LZMAError"):
            raise
        raise _damaged(name, error) from None


def _damaged(name: str, error: Exception) -> RecordError:
    reason = str(error).rstrip(".") or type(error).__name__
    return RecordError(f"{name}: is damaged or cut off ({reason}); copy or export it again.")


def _list_members(path: Path, name: str) -> list[zipfile.ZipInfo]:
    """Read the table of contents of a zip file."""
    with _reads(name), zipfile.ZipFile(path) as archive:
        members = archive.infolist()
    if len(members) > MAX_MEMBERS:
        raise RecordError(f"{name}: holds {len(members)} files, more than {MAX_MEMBERS}; pack fewer into one archive.")
    return members


def _is_document(members: list[zipfile.ZipInfo]) -> bool:
    """Whether a zip file is a workbook or another document, which its own format reads."""
    names = {member.filename for member in members}
    return "[Content_Types].xml" in names or "mimetype" in names or any(name.startswith("xl/") for name in names)


def _is_data_file(name: str) -> bool:
    path = PurePosixPath(name)
    return not name.startswith("__MACOSX/") and not path.name.startswith(".")


def _megabytes(n: int) -> str:
    return f"{n / 1e6:.4g} MB"
