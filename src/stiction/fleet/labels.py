"""A person's notes on loops: `labels.csv` in the folder of an audit, append-only; an audit never writes it."""

from __future__ import annotations

import csv
import io
import os
from dataclasses import astuple, dataclass, fields
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from stiction.errors import ParameterError, RecordError, StictionError

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["LABELS", "Label", "LabelConflictError", "append_label", "newest_labels", "read_labels"]

FILE = "labels.csv"
LABELS = ("acknowledged", "repaired", "stiction", "not stiction", "note")
"""What a person can say of a loop; "repaired" counts from the time of the label."""


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

    Parameters
    ----------
    folder : path
        Folder of the audit.

    Returns
    -------
    list of Label
        Empty when nothing was written yet. A row that a crash cut off is left out.

    Raises
    ------
    RecordError
        When the file has other columns.

    Examples
    --------
    >>> read_labels("no-such-folder")
    []
    """
    path = Path(folder) / FILE
    if not path.is_file():
        return []
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise RecordError(f"cannot be read ({error}); save it as CSV in UTF-8.", where=path) from None
    return _parse(text, path)


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
        with path.open("a+", encoding="utf-8", newline="") as file:
            _lock(file)
            file.seek(0)
            text = file.read()
            newest = newest_labels(_parse(text, path)).get(tag)
            row = Label(tag, _next_time(newest), label, note, author)
            if seen is not None and newest is not None and newest.time > seen:
                raise LabelConflictError(newest, row)
            start = "" if text.endswith("\n") or not text else "\n"
            file.write(
                start + ("" if text.strip() else _line([one.name for one in fields(Label)])) + _line(astuple(row))
            )
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise RecordError(
            f"cannot be written ({error.strerror or error}); check the access rights and the free space.", where=path
        ) from None
    return row


def _parse(text: str, path: Path) -> list[Label]:
    rows = list(csv.reader(io.StringIO(text.replace("\0", ""))))
    if not rows:
        return []
    names = [one.name for one in fields(Label)]
    if [cell.strip() for cell in rows[0]] != names:
        raise RecordError(
            f"its columns are {', '.join(rows[0])}; write {','.join(names)} in its first line.", where=path
        )
    return [Label(*row) for row in rows[1:] if len(row) == len(names)]


def _next_time(newest: Label | None) -> str:
    """Now, but later than the newest label."""
    now = datetime.now(UTC).isoformat(timespec="microseconds")
    return now if newest is None or now > newest.time else newest.time + "+"


def _line(cells: Iterable[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue()


def _lock(file: io.TextIOWrapper) -> None:
    """Wait for the lock of the file; it is free again when the file is closed."""
    if os.name == "nt":
        import msvcrt

        file.seek(0)
        msvcrt.locking(file.fileno(), msvcrt.LK_LOCK, 1 << 30)  # pyright: ignore[reportAttributeAccessIssue]
    else:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX)
