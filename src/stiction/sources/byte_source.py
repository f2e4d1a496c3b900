"""The files of a source: a path, folder, pattern, stream or a list of these, each as a file that a format can parse."""

from __future__ import annotations

import hashlib
import os
import re
import sys
from dataclasses import dataclass, field
from functools import partial
from glob import glob, has_magic
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from stiction.errors import RecordError
from stiction.scratch import ScratchFolder, inflated_once
from stiction.sources.compression import ByteLimit, inflate
from stiction.sources.table import Origin

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stiction.sources.options import ReadOptions

__all__ = ["HEAD_BYTES", "ByteSource", "list_files", "list_paths", "open_files", "open_sources", "source_name"]

HEAD_BYTES = 65_536
"""Bytes by which a format is recognised."""
CHUNK_BYTES = 1 << 20
MAX_DIGEST_BYTES = 256_000_000
"""Size of a file above which no digest is made [bytes]."""

COLUMNAR = (b"PAR1", b"ARROW1")
"""First bytes of files of which only the columns of a loop are read, whatever their size."""
_BLANK = b" \t\r\n\0\xef\xbb\xbf\xff\xfe"


@dataclass(eq=False)
class ByteSource:
    """A file to parse, after decompression."""

    origin: Origin
    path: Path
    """The file itself, or a temporary one."""
    head: bytes
    """The first `HEAD_BYTES` bytes."""
    size: int
    """Size after decompression [bytes]."""
    max_bytes: int
    """Largest size that may be read [bytes]."""
    scratch: ScratchFolder = field(default_factory=ScratchFolder, repr=False)
    """Where temporary files go, until it is deleted; the files of an archive share it."""


def open_sources(path: str | os.PathLike[str] | BinaryIO, options: ReadOptions) -> list[ByteSource]:
    """Open a path, "-" (standard input) or a binary file, decompressed; a zip archive gives several sources."""
    scratch = ScratchFolder()
    try:
        sources = list(_decompress(_store(path, options.max_bytes, scratch)))
        for source in sources:
            refuse_kind(source.origin.name, source.head)
    except BaseException:
        scratch.delete()
        raise
    return sources


def _store(path: str | os.PathLike[str] | BinaryIO, max_bytes: int, scratch: ScratchFolder) -> ByteSource:
    """Measure a file where it is, or copy a stream into the scratch folder."""
    file, name = _open_file(path)
    shown = name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
    stem = "stream" if name == "stream" else Path(name).stem
    is_path = isinstance(path, (str, os.PathLike)) and os.fspath(path) != "-"
    if is_path and Path(name).is_file():
        with file:
            size = _check_file(file, name, max_bytes)
        stored, digest = Path(name), None
        if shown != name:  # no UTF-8: a name that polars and the other readers do not take
            stored = scratch.path() / f"source{Path(shown).suffix}"
            stored.symlink_to(Path(name).absolute())
            stem = Path(shown).stem
    else:
        stored = scratch.path() / "source"
        with open(stored, "wb") as copy:
            size, digest = _copy(file, name, max_bytes, copy)
    origin = Origin(shown, stem, lambda: digest or _file_digest(stored, size))
    return ByteSource(origin, stored, _read_head(stored), size, max_bytes, scratch)


def _check_file(file: BinaryIO, name: str, max_bytes: int) -> int:
    """Give the size of a file on disk, and refuse one that is too large or holds only blanks."""
    size = os.fstat(file.fileno()).st_size
    chunk = file.read(HEAD_BYTES)
    if not chunk.startswith(COLUMNAR):
        ByteLimit(name, max_bytes).add(size)
    while chunk:
        if chunk.strip(_BLANK):
            return size
        chunk = file.read(HEAD_BYTES)
    raise _empty(name)


def _file_digest(path: Path, size: int) -> str:
    """Digest of a file; empty for a large one, or when it is no longer available."""
    if size > MAX_DIGEST_BYTES:
        return ""
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""


def _open_file(path: str | os.PathLike[str] | BinaryIO) -> tuple[BinaryIO, str]:
    """Open the file and give its name for messages."""
    if not isinstance(path, (str, os.PathLike)):
        if not hasattr(path, "read"):
            raise RecordError(
                f"cannot read an object of type {type(path).__name__}; give a file name or a binary file."
            )
        name = getattr(path, "name", "stream")
        return path, name if isinstance(name, str) else "stream"
    text = os.fspath(path)
    if text == "-":
        if sys.stdin.isatty():
            raise RecordError("stdin: nothing is piped in; give a file name or pipe a file.")
        return sys.stdin.buffer, "stdin"
    try:
        return open(text, "rb"), text
    except IsADirectoryError:
        raise RecordError(f"is a folder; give a file in it, such as {text.rstrip('/')}/*.csv.", where=text) from None
    except FileNotFoundError:
        raise RecordError("no such file; check the name and the folder.", where=text) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise RecordError(
            f"cannot be read ({reason}); check the name and the access rights.", where=repr(text)
        ) from None


def _copy(file: BinaryIO, name: str, max_bytes: int, copy: BinaryIO) -> tuple[int, str]:
    """Copy a stream; give its size and its digest."""
    digest, limit, has_content = hashlib.sha256(), ByteLimit(name, max_bytes), False
    while chunk := file.read(CHUNK_BYTES):
        if not isinstance(chunk, bytes):
            raise RecordError("was opened as text; open it with mode 'rb'.", where=name)
        if limit.size == 0:
            refuse_kind(name, chunk)
        limit.add(len(chunk))
        has_content = has_content or bool(chunk.strip(_BLANK))
        digest.update(chunk)
        copy.write(chunk)
    if not has_content:
        raise _empty(name)
    return limit.size, digest.hexdigest()


def _empty(name: str) -> RecordError:
    return RecordError("is empty; export the loop again with a header and rows of numbers.", where=name)


def _decompress(source: ByteSource, *, is_member: bool = False) -> Iterator[ByteSource]:
    """Give the source itself, or the files that it holds when it is compressed."""
    name = source.origin.name
    limit = ByteLimit(name, source.max_bytes, source.path.stat().st_size)
    decompress = partial(inflate, source.path, source.head, limit)
    is_own = source.path != Path(source.origin.name)  # a copy of a stream, or a member of an archive
    members = decompress(source.scratch.path) if is_own else inflated_once(source.path, decompress, source.scratch)
    if members is None:
        yield source
        return
    for member, path in members:
        if is_member and member:
            raise RecordError("is an archive within an archive; unpack the outer one first.", where=name)
        stem = Path(member or source.origin.stem).stem
        origin = Origin(f"{name}/{member}" if member else name, stem, source.origin.digest)
        head, size = _read_head(path), path.stat().st_size
        if not head.strip(_BLANK):
            raise _empty(origin.name)
        one = ByteSource(origin, path, head, size, source.max_bytes, source.scratch)
        yield from _decompress(one, is_member=True) if member else (one,)


def _read_head(path: Path) -> bytes:
    with open(path, "rb") as file:
        return file.read(HEAD_BYTES)


_REFUSED = {
    b"%PDF": ("a PDF document", "export the trend as CSV"),
    **dict.fromkeys((b"\x7fELF", b"MZ\x90\x00", b"\xcf\xfa\xed\xfe"), ("a program", "give the data file")),
    **dict.fromkeys(
        (b"\x89PNG", b"\xff\xd8\xff", b"GIF8", b"II*\x00", b"MM\x00*"),
        ("a picture", "export the numbers of the trend as CSV"),
    ),
    b"\x93NUMPY": ("a NumPy array", "save it with column names as CSV or Parquet"),
    b"SQLite format 3\x00": ("an SQLite database", "give its URL, sqlite:///FILE, and a table or a query"),
    **dict.fromkeys(
        (b"7z\xbc\xaf\x27\x1c", b"Rar!", b"BZh91AY&SY", b"\xfd7zXZ"),
        ("an archive of a kind that cannot be read", "unpack it first"),
    ),
}
"""First bytes -> what holds no records, and the remedy."""
MIN_ZEROS = 65_536
"""Zeros at the beginning of a file that is refused [bytes]."""
_LINE_PROTOCOL = re.compile(rb"[\w./-]+(?:,[\w./-]+=[^\s,=]+)* [\w./-]+=[^\s,=]+(?:,[\w./-]+=[^\s,=]+)* \d{10,19}\s*")
_HTML = (b"<!doctype html", b"<html")


def refuse_kind(name: str, head: bytes) -> None:
    """Refuse by its first bytes what holds no records, before the rest of a long stream is read."""
    kind = next((kind for start, kind in _REFUSED.items() if head.startswith(start)), None)
    if head[:2] in (b"\x80\x02", b"\x80\x03", b"\x80\x04", b"\x80\x05"):
        kind = "a Python pickle, which may run code when it is read", "save the frame as CSV or Parquet"
    elif head[257:262] == b"ustar":
        kind = "a tar archive", "unpack it first"
    elif all(map(_LINE_PROTOCOL.fullmatch, head.split(b"\n", 3)[:2])):
        kind = "InfluxDB line protocol", "export it as CSV (influx query --raw)"
    elif head[:64].lstrip().lower().startswith(_HTML):
        kind = "an HTML page", "open it in a spreadsheet program and save it as CSV or xlsx"
    elif len(head) >= MIN_ZEROS and not head.strip(b"\0"):
        kind = "binary and begins with zeros only", "export the loop as CSV"
    if kind:
        raise RecordError(f"is {kind[0]}; {kind[1]}.", where=name)


def open_files(source: Any, options: ReadOptions) -> list[ByteSource]:
    """Open a path, folder, pattern, "-", binary file, or list of these; an archive gives several files."""
    return [one for path in list_paths(source) for one in open_sources(path, options)]


def list_paths(source: Any) -> list[Any]:
    """List the files of a path, folder, pattern, "-", binary file, or list of these."""
    paths: list[Any] = []
    for part in source if isinstance(source, (list, tuple)) else [source]:
        paths += list_files(part) if isinstance(part, (str, os.PathLike)) and part != "-" else [part]
    if not paths:
        raise RecordError("the list of files is empty; give one or more.")
    return paths


def source_name(path: Any) -> str:
    """Name of a path or stream, for messages."""
    return os.fspath(path) if isinstance(path, (str, os.PathLike)) else str(getattr(path, "name", "stream"))


def list_files(source: str | os.PathLike[str], *, subfolders: bool = False) -> list[str]:
    """List the files of a path, folder or pattern without hidden ones; raises RecordError when there are none."""
    text = os.fspath(source)
    if os.path.isdir(text):
        inside = Path(text).rglob("*") if subfolders else Path(text).iterdir()
        files = sorted(
            str(path) for path in inside
            if path.is_file() and not any(name.startswith(".") for name in path.relative_to(text).parts)
        )  # fmt: skip
        if not files:
            raise RecordError("is a folder without files; give the folder that contains the exports.", where=text)
        return files
    if has_magic(text) and not os.path.exists(text):
        files = sorted(path for path in glob(text, recursive=True) if os.path.isfile(path))
        if not files:
            raise RecordError("no file matches this pattern; check the folder and the spelling.", where=text)
        return files
    return [text]
