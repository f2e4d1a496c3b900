"""What one run of the server works on: a temporary folder, the uploaded files, the loops, the audits."""

from __future__ import annotations

import shutil
import tempfile
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.apps.web.audit_loops import AuditLoops
from stiction.apps.web.readings import Readings
from stiction.apps.web.session_loops import SessionLoops
from stiction.apps.web.uploads import Uploads
from stiction.errors import RecordError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

__all__ = ["Workspace", "open_workspace"]

AUDIT_FILE = "audit.toml"
"""File by which a folder is known as an audit."""


@dataclass
class Workspace:
    """Files and loops of one run of the server."""

    folder: Path
    """Temporary folder; it is deleted when the server ends."""
    uploads: Uploads
    readings: Readings
    session: SessionLoops
    files: list[tuple[str, str]] = field(default_factory=list)
    """Path and shown name of each file that the command line named."""
    audits: dict[str, AuditLoops] = field(default_factory=dict)
    """Audits that the command line named, by id."""

    def sets(self) -> dict[str, Any]:
        """All sets of loops by their id."""
        session = {self.session.id: self.session} if self.session.rows or not self.audits else {}
        return {**self.audits, **session}


@contextmanager
def open_workspace(sources: Sequence[str] = ()) -> Iterator[Workspace]:
    """Make the temporary folder, and delete it at the end.

    Raises
    ------
    RecordError
        When a source is no audit and no file.
    """
    folders = [Path(source) for source in sources if (Path(source) / AUDIT_FILE).is_file()]
    files = [file for source in sources if Path(source) not in folders for file in _list_files(source)]
    folder = Path(tempfile.mkdtemp(prefix="stiction-serve-"))
    try:
        for name in ("uploads", "readings", "session"):
            (folder / name).mkdir()
        yield Workspace(
            folder,
            Uploads(folder / "uploads"),
            Readings(folder / "readings"),
            SessionLoops(folder / "session"),
            files,
            {one.id: one for one in (AuditLoops(path, folder / "audits") for path in folders)},
        )
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _list_files(source: str) -> list[tuple[str, str]]:
    """Files of a path, a folder or a pattern; in a folder only those that are really in it."""
    from glob import glob, has_magic

    path = Path(source)
    if path.is_dir():
        root = path.resolve()
        found = [one for one in sorted(path.iterdir()) if one.is_file() and not one.name.startswith(".")]
        inside = [one for one in found if one.resolve().is_relative_to(root)]
        if not inside:
            raise RecordError(f"{source} is no audit (it has no {AUDIT_FILE}) and holds no files; name another folder.")
        return [(str(one.resolve()), one.name) for one in inside]
    if has_magic(source) and not path.exists():
        found = [Path(one) for one in sorted(glob(source, recursive=True)) if Path(one).is_file()]
        if not found:
            raise RecordError(f"{source}: no file matches this pattern; check the folder and the spelling.")
        return [(str(one.resolve()), one.name) for one in found]
    if not path.is_file():
        raise RecordError(f"{source}: there is no such file or folder; check the name.")
    return [(str(path.resolve()), path.name)]
