"""A person's notes on loops: `labels.csv` in the folder of an audit, append-only; an audit never writes it."""

from __future__ import annotations

import csv
import io
import os
from dataclasses import astuple, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, TYPE_CHECKING

from stiction.errors import ParameterError, RecordError, StictionError
from stiction.file_lock import lock_file
from stiction.foreign_errors import data_error

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["LABELS", "Label", "LabelConflictError", "append_label", "newest_labels", "read_labels"]

FILE = "labels.csv"
LABELS = ("acknowledged", "planned", "done", "rejected", "repaired", "stiction", "not stiction", "note")
"""What a person can say of a loop; "done" and "repaired" count from the time of the label."""
NAMES = ["tag", "time", "label", "note", "author"]
"""Columns of the file: the fields of `Label`."""


@dataclass(frozen=True)
class Label:
    """One row of `labels.csv`."""

    tag: str
    """Tag of the loop."""
    time: str
    """When it was written, as ISO 8601."""
    label: str
    """One of `LABELS`."""
    note: str
    """Free text."""
    author: str
    """Who wrote it."""


class LabelConflictError(StictionError):
    """Somebody else wrote a label of the same loop in the meantime.

    Attributes
    ----------
    theirs, yours : Label
        The newest row in the file, and the one that was not written.
    """

    def __init__(self, theirs: Label, yours: Label) -> None:
        self.theirs, self.yours = theirs, yours
        super().__init__(
            f"{theirs.tag}: {theirs.author or 'somebody'} wrote {theirs.label!r}, {theirs.note!r} at {theirs.time}, "
            f"after you read the labels; your {yours.label!r}, {yours.note!r} was not written. Read their label, then "
            "write yours again."
        )


def read_labels(folder: str | os.PathLike[str]) -> list[Label]:
    """Read all labels, in the order in which they were written.

    `folder`: folder of the audit. Returns empty when nothing was written yet. Raises RecordError when the file has
    other columns, or a row that is no label; the message has its number.

    Examples
    --------
    >>> read_labels("no-such-folder")
    []
    """
    path = Path(folder) / FILE
    try:
        return _parse(path.read_bytes(), path)[0]
    except FileNotFoundError:
        return []
    except OSError as error:
        raise RecordError(f"cannot be read ({error.strerror or error}); check the access rights.", where=path) from None


def newest_labels(labels: Iterable[Label]) -> dict[str, Label]:
    """Newest label of each loop: tag -> the last row of it."""
    return {label.tag: label for label in labels}


def append_label(
    folder: str | os.PathLike[str], tag: str, label: str, note: str = "", author: str = "", *, seen: str | None = None
) -> Label:
    """Append one label.

    Parameters
    ----------
    folder : path
        Folder of the audit.
    tag : str
        Tag of the loop.
    label : str
        One of `LABELS`.
    note, author : str
        Free text, and who wrote it.
    seen : str, optional
        Time of the newest label of this loop that the author knew, "" for none; with it a newer one is not overruled.

    Returns
    -------
    Label
        The row that was written.

    Raises
    ------
    ParameterError
        When the label is unknown.
    LabelConflictError
        When the newest label of the loop is newer than `seen`.
    RecordError
        When the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     written = append_label(folder, "FIC-101", "acknowledged", "packing ordered", "Ana")
    ...     read_labels(folder) == [written]
    True
    """
    if label not in LABELS:
        raise ParameterError(f"label = {label!r} is unknown; give one of {', '.join(LABELS)}.")
    path = Path(folder) / FILE
    try:
        with path.open("ab+") as file:
            lock_file(file, wait=True)
            file.seek(0)
            data = file.read()
            labels, encoding, mark = _parse(data, path)
            newest = newest_labels(labels).get(tag)
            row = Label(*(_printable(text) for text in (tag, _next_time(newest), label, note, author)))
            if seen is not None and newest is not None and newest.time > seen:
                raise LabelConflictError(newest, row)
            try:
                _append(file, data, row, encoding, mark)
                file.seek(0)
                if _parse(file.read(), path)[0] != [*labels, row]:
                    raise RecordError(
                        "did not take the label, and is as it was before; look at its last lines.", where=path
                    )
            except BaseException:
                file.truncate(len(data))
                raise
    except OSError as error:
        known = data_error(error, str(path))
        raise known or RecordError(
            f"cannot be written ({error.strerror or error}); check the access rights.", where=path
        ) from None
    return row


def _append(file: IO[bytes], data: bytes, row: Label, encoding: str, mark: str) -> None:
    """Write one row, on a line of its own, in the encoding of the file."""
    heading = [] if data.strip(b"\xef\xbb\xbf \r\n") else [NAMES]
    text = io.StringIO()
    csv.writer(text, delimiter=mark, lineterminator="\r\n" if b"\r\n" in data else "\n").writerows(
        [*heading, astuple(row)]
    )
    start = "\n" if data and not heading and not data.rstrip(b"\0").endswith((b"\n", b"\r")) else ""
    try:
        written = (start + text.getvalue()).encode(encoding)
    except UnicodeEncodeError as error:
        raise RecordError(
            f"is written as {encoding}, which does not have the character {error.object[error.start]!r}; save it as "
            "CSV in UTF-8.",
            where=file.name,
        ) from None
    file.write(written)
    file.flush()
    os.fsync(file.fileno())


def _parse(data: bytes, path: Path) -> tuple[list[Label], str, str]:
    """All labels of a file, its encoding (UTF-8, UTF-16 or that of Excel on Windows), and the mark between cells."""
    encoding = "utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        encoding = "cp1252"
        text = data.decode(encoding, "replace")
    text = text.replace("\0", "")
    mark = ";" if text.startswith(";".join(NAMES[:2])) else ","
    lines = io.StringIO(text, newline="")
    reader = csv.reader(lines, delimiter=mark, strict=True)
    labels: list[Label] = []
    first = 1
    try:
        heading = next((row for row in reader if row), None)
        if heading is None:
            return [], "utf-8", ","
        if [cell.strip() for cell in heading[: len(NAMES)]] != NAMES or any(heading[len(NAMES) :]):
            raise RecordError(
                f"its columns are {', '.join(heading)}; write {','.join(NAMES)} in its first line.", where=path
            )
        first = reader.line_num + 1
        for row in reader:
            if any(cell.strip() for cell in row):
                labels.append(_to_label(row, f"{path}, line {first}"))
            first = reader.line_num + 1
    except csv.Error as error:
        raise RecordError(
            f"a quote is opened and not closed, or stands within a cell ({error}); correct the row, or delete it.",
            where=f"{path}, line {first}",
        ) from None
    without_mark = {"utf-8-sig": "utf-8", "utf-16": "utf-16-le" if data.startswith(b"\xff") else "utf-16-be"}
    return labels, without_mark.get(encoding, encoding), mark


def _to_label(row: list[str], where: str) -> Label:
    cells = [*row, *[""] * (len(NAMES) - len(row))]
    if any(cell.strip() for cell in cells[len(NAMES) :]):
        raise RecordError(
            f"has {len(row)} cells, {len(NAMES)} are needed; put a note with commas between quotes.", where=where
        )
    label = Label(*(cell.replace("\r\n", "\n") for cell in cells[: len(NAMES)]))
    if not label.tag.strip() or label.label not in LABELS:
        raise RecordError(
            f"has the tag {label.tag!r} and the label {label.label!r}; give a tag and one of {', '.join(LABELS)}, or "
            "delete the line.",
            where=where,
        )
    return label


def _printable(text: str) -> str:
    """A text without what cannot be stored: surrogates and NUL; each line end is a line feed."""
    plain = text.replace("\r\n", "\n").replace("\r", "\n").replace("\0", "")
    return plain.encode("utf-8", "replace").decode("utf-8")


def _next_time(newest: Label | None) -> str:
    """Now, but later than the newest label."""
    now = datetime.now(UTC).isoformat(timespec="microseconds")
    return now if newest is None or now > newest.time else newest.time + "+"
