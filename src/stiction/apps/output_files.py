"""Output files of the commands: checked before the work, written completely or not at all; foreign files stay."""

from __future__ import annotations

import re
import sys
import tempfile
from typing import TYPE_CHECKING

from stiction.errors import RecordError

if TYPE_CHECKING:
    from pathlib import Path

    from stiction.records import LoopRecord

__all__ = [
    "check_folder",
    "check_report",
    "check_target",
    "check_text",
    "csv_text",
    "historian_csv",
    "write_csv",
    "write_text",
]

_TEXTS = {
    "--out": re.compile(rb"time_s(,(SP|PV|OP|MV|VALVE_SIGNAL))+\r?\n"),
    "--structured-text": re.compile(rb"\(\*.*?Written \d{4}-\d\d-\d\d by stiction ", re.DOTALL),
    "--work-order": re.compile(rb"# Work order: control valve of "),
}
"""Option -> how the files that it writes begin."""
_MARK = b'<meta name="generator" content="stiction'


def check_target(path: str) -> Path:
    """Return the path of an output file, or refuse one that cannot be written.

    Raises
    ------
    RecordError
        When the folder is missing or cannot be written to, or the path is a folder.
    """
    from stiction.atomic_write import output_path, require_file_path, unwritable_error

    target = output_path(path)
    if target.exists() and not (target.is_file() or target.is_dir()):
        return target
    require_file_path(target)
    try:
        with tempfile.TemporaryFile(dir=target.parent):
            pass
    except OSError as error:
        raise unwritable_error(target, error) from None
    return target


def check_report(path: str) -> Path:
    """Check a target, and refuse to replace a file that is not a report of this program.

    Raises
    ------
    RecordError
        When the report cannot be written, or would replace another file.
    """
    target = check_target(path)
    if target.exists() and (not target.is_file() or _MARK not in _head(target)):
        raise RecordError(f"{target} was not written by stiction and is not replaced; give another name with --report.")
    return target


def check_text(path: str, option: str) -> Path:
    """Check a target, and refuse to replace a file that does not begin like the files of this option.

    Raises
    ------
    RecordError
        When the text cannot be written, or would replace another file.
    """
    target = check_target(path)
    if target.is_file() and target.stat().st_size and not _TEXTS[option].match(_head(target)):
        raise RecordError(f"{target} was not written by stiction and is not replaced; give another name with {option}.")
    return target


def check_folder(folder: Path) -> Path:
    """Return a folder, created if it does not exist.

    Raises
    ------
    RecordError
        When it cannot be created or written to.
    """
    if folder.exists() and not folder.is_dir():
        raise RecordError(
            f"{folder} is a file, but the report needs a folder of this name; remove the file, or give another report."
        )
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise RecordError(
            f"Cannot create the folder {folder}: {error.strerror or error}; choose another folder."
        ) from None
    check_target(str(folder / "probe"))
    return folder


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(4096)
    except OSError:
        return b""


def csv_text(record: LoopRecord) -> str:
    r"""Return the recorded signals as CSV: ``time_s,SP,PV,OP,MV,VALVE_SIGNAL``; MV is the valve position.

    Examples
    --------
    >>> from stiction.records import LoopRecord
    >>> csv_text(LoopRecord("FIC-101", 2.0, op=[50.0, 51.0], pv=[3.0, 3.1]))
    'time_s,PV,OP\n0,3,50\n2,3.1,51\n'
    """
    there = [name for name in ("sp", "pv", "op", "mv", "valve_signal") if getattr(record, name) is not None]
    series = [record.time, *(getattr(record, name) for name in there)]
    lines = [",".join(["time_s", *(name.upper() for name in there)])]
    lines += [",".join("" if x != x else f"{x:.9g}" for x in row) for row in zip(*series, strict=True)]
    return "\n".join(lines) + "\n"


def historian_csv(record: LoopRecord) -> str:
    """Return the signals as CSV like a historian's export: time stamps, and the tag before each signal.

    Examples
    --------
    >>> from datetime import datetime
    >>> from stiction.records import LoopRecord
    >>> historian_csv(LoopRecord("FIC-101", 2.0, op=[50.0], pv=[3.0], start=datetime(2026, 3, 2))).splitlines()
    ['Time,FIC-101.PV,FIC-101.OP', '2026-03-02 00:00:00,3,50']
    """
    from datetime import timedelta

    start = record.start
    if start is None:
        raise RecordError(f"{record.tag} has no start time, so there are no time stamps to write; use csv_text.")
    lines = csv_text(record).splitlines()
    head = ",".join(["Time", *(f"{record.tag}.{name}" for name in lines[0].split(",")[1:])])
    step = timedelta(seconds=record.dt)
    rows = (f"{start + k * step},{line.partition(',')[2]}" for k, line in enumerate(lines[1:]))
    return "\n".join([head, *rows]) + "\n"


def write_csv(record: LoopRecord, path: Path | None) -> None:
    """Write the signals to a file, or to the standard output without a path."""
    if path is None:
        sys.stdout.write(csv_text(record))
    else:
        write_text(csv_text(record), path)


def write_text(text: str, path: Path) -> None:
    """Write a file completely or not at all; write directly to anything else, such as a pipe."""
    if path.exists() and not path.is_file():
        try:
            path.write_text(text, encoding="utf-8")
        except BrokenPipeError:
            raise
        except OSError as error:
            raise RecordError(
                f"cannot be written ({error.strerror or error}); give another file.", where=path
            ) from None
        return
    from stiction.atomic_write import write_atomically

    write_atomically(text, path)
