"""Encoding of a text, and the text as UTF-8 with line feeds."""

from __future__ import annotations

import codecs
from typing import TYPE_CHECKING

from stiction.sources.byte_source import CHUNK_BYTES, HEAD_BYTES

if TYPE_CHECKING:
    from pathlib import Path

    from stiction.sources.byte_source import ByteSource

__all__ = ["find_encoding", "to_utf8"]

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


def find_encoding(head: bytes) -> str | None:
    """Name the encoding of a text by its first bytes; None when they are no text."""
    for mark, encoding in _MARKS:
        if head.startswith(mark):
            return encoding
    start = head[:4096]
    if 0 in start:
        low, high = start[0::2], start[1::2]
        if high.count(0) > 0.9 * len(high) and low.count(0) == 0:
            return "utf-16-le"
        if low.count(0) > 0.9 * len(low) and high.count(0) == 0:
            return "utf-16-be"
        return None
    if _decode(head, "utf-8") is not None:
        return "utf-8"
    return "gb18030" if _is_chinese(head) else "latin-1"


def to_utf8(source: ByteSource, encoding: str) -> tuple[Path, str]:
    """Give a file in UTF-8 with LF or CR LF, which may be the source itself, and its true encoding."""
    if encoding == "utf-8":
        encoding, is_plain = _check_utf8(source.path)
        if is_plain:
            return source.path, encoding
    path = source.scratch.path() / f"{source.path.name}.utf8"
    with (
        open(source.path, encoding=encoding, errors="replace") as text,
        open(path, "w", encoding="utf-8", newline="\n") as out,
    ):
        while part := text.read(CHUNK_BYTES):
            out.write(part)
    return path, encoding


def _check_utf8(path: Path) -> tuple[str, bool]:
    """Check the whole file: its encoding, and whether all its lines end with a line feed."""
    decoder = codecs.getincrementaldecoder("utf-8")()
    n_lone_returns, last = 0, b""
    with open(path, "rb") as file:
        while part := file.read(CHUNK_BYTES):
            try:
                if not part.isascii() or decoder.getstate()[0]:
                    decoder.decode(part)
            except UnicodeDecodeError as error:
                start = part.rfind(b"\n", 0, error.start) + 1
                return find_encoding(part[start : start + HEAD_BYTES]) or "latin-1", False
            n_lone_returns -= last == b"\r" and part[:1] == b"\n"
            n_lone_returns += part.count(b"\r") - part.count(b"\r\n") if b"\r" in part else 0
            last = part[-1:]
    return ("latin-1", False) if decoder.getstate()[0] else ("utf-8", n_lone_returns == 0)


def _decode(data: bytes, encoding: str) -> str | None:
    """Give the text of bytes in an encoding, which may end within a character; None where they are none."""
    try:
        return codecs.getincrementaldecoder(encoding)().decode(data)
    except UnicodeDecodeError:
        return None


def _is_chinese(data: bytes, *, min_share: float = 0.7) -> bool:
    """Whether bytes are a text in GB18030: most characters beyond ASCII are common Chinese ones (GB 2312, level 1)."""
    text = _decode(data, "gb18030") or ""
    codes = [character.encode("gb2312", errors="ignore") for character in text if not character.isascii()]
    n_common = sum(len(code) == 2 and 0xB0 <= code[0] <= 0xD7 for code in codes)
    n_signs = sum(len(code) == 2 and code[0] < 0xB0 for code in codes)
    return n_common > 1 and n_common >= min_share * (len(codes) - n_signs)
