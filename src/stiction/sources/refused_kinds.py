"""Files that hold no records, refused by their first bytes."""

from __future__ import annotations

import re

from stiction.errors import RecordError

__all__ = ["refuse_kind"]

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
