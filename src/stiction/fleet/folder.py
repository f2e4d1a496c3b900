"""The folder of an audit: its settings, its lock, and the digest of the options that results depend on."""

from __future__ import annotations

import contextlib
import getpass
import hashlib
import json
import os
import socket
import tomllib
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.atomic_write import may_write
from stiction.errors import RecordError, Setting
from stiction.file_lock import lock_file
from stiction.fleet.labels import read_labels
from stiction.fleet.ledger import FORMAT_VERSION

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

__all__ = [
    "SETTINGS_FILE",
    "check_folder",
    "lock_folder",
    "options_digest",
    "process_name",
    "read_settings",
    "write_settings",
]

SETTINGS_FILE = "audit.toml"
LOCK_FILE = "audit.lock"


def check_folder(folder: Path) -> None:
    """Check that a folder can take an audit: it does not exist, is empty, or holds an audit of this format.

    Raises RecordError when it holds something else, or cannot be made.
    """
    if folder.exists() and not folder.is_dir():
        raise RecordError("is a file", remedy=("give a folder for the results with ", Setting("out")), where=folder)
    if not may_write(folder):
        raise RecordError(
            "cannot be written to", remedy=("give a folder that you may write to with ", Setting("out")), where=folder
        )
    if (folder / SETTINGS_FILE).exists():
        read_settings(folder)
        read_labels(folder)  # a row that cannot be read is told before the work
    elif folder.exists():
        ours = (LOCK_FILE, "ledger.sqlite", "ledger.sqlite-wal", "ledger.sqlite-shm")
        others = sorted(path.name for path in folder.iterdir() if path.name not in ours)
        if others:
            raise RecordError(
                f"is not an audit and not empty (it has {others[0]})",
                remedy=("give a new folder with ", Setting("out")),
                where=folder,
            )


def read_settings(folder: Path) -> dict[str, Any]:
    """Read what was asked for when the audit was made.

    Raises RecordError when the folder holds no audit, or one of another format.
    """
    path = folder / SETTINGS_FILE
    if not path.is_file():
        raise RecordError(f"is not an audit (it has no {SETTINGS_FILE}); make one with `stiction audit`.", where=folder)
    try:
        settings = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise RecordError(f"cannot be read ({error}); restore it, or start a new audit.", where=path) from None
    if settings.get("format") != FORMAT_VERSION:
        raise RecordError(
            f"is an audit of format {settings.get('format')}, written by stiction {settings.get('version')}; "
            f"this version reads format {FORMAT_VERSION}: start a new audit in another folder.",
            where=folder,
        )
    return settings


def write_settings(folder: Path, settings: Mapping[str, Any]) -> None:
    """Write the settings whole or not at all."""
    lines = [f"{name} = {_toml(value)}" for name, value in settings.items() if value is not None]
    part = folder / f".{SETTINGS_FILE}.{os.getpid()}.tmp"
    try:
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")
        os.replace(part, folder / SETTINGS_FILE)
    except OSError as error:
        raise RecordError(
            f"cannot be written to ({error.strerror or error}); give another folder.", where=folder
        ) from None
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def options_digest(options: Mapping[str, Any]) -> str:
    """Digest of the options that a result depends on; a map counts with its text."""
    known = dict(options)
    if known.get("map"):
        with contextlib.suppress(OSError):
            known["map"] = hashlib.sha256(Path(known["map"]).read_bytes()).hexdigest()
    return hashlib.sha256(json.dumps(known, sort_keys=True, default=str).encode()).hexdigest()[:16]


@contextmanager
def lock_folder(
    folder: Path,
    name: str = LOCK_FILE,
    running: str = "an audit is running in this folder",
    remedy: str = "wait until it ends, or stop it",
) -> Iterator[None]:
    """Keep a second audit, or watch, out of the folder by the lock file `name`.

    Raises RecordError when another one is at work in it; the message says what is `running`, who runs it, and the
    `remedy`. The lock of a process that was killed is free.
    """
    path = folder / name
    try:
        file = path.open("a+", encoding="utf-8")
    except OSError as error:
        raise RecordError(
            f"cannot be written to ({error.strerror or error}); give another folder.", where=folder
        ) from None
    with file:
        try:
            lock_file(file, wait=False)
        except OSError:
            file.seek(0)
            owner = file.read().strip() or "another process"
            raise RecordError(f"{running} ({owner}); {remedy}.", where=folder) from None
        file.truncate(0)
        file.write(f"{process_name()}, since {datetime.now():%Y-%m-%d %H:%M}")
        file.flush()
        try:
            yield
        finally:
            file.truncate(0)


def process_name() -> str:
    """User, machine and number of this process."""
    try:
        user = getpass.getuser()
    except (KeyError, OSError):
        user = "somebody"
    return f"{user} on {socket.gethostname()}, process {os.getpid()}"


def _toml(value: Any) -> str:
    """A value as TOML: text, numbers, lists and inline tables."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_toml(one) for one in value)}]"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{json.dumps(str(k))} = {_toml(v)}' for k, v in value.items() if v is not None)}}}"
    return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")
