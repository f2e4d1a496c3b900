"""What one run of the server works on: a temporary folder, the uploaded files, the loops, the audits."""

from __future__ import annotations

import shutil
import tempfile
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from stiction.apps.web.audit_loops import AuditLoops
from stiction.apps.web.readings import Readings
from stiction.apps.web.served_sources import find_audits
from stiction.apps.web.session_loops import SessionLoops
from stiction.apps.web.uploads import Uploads
from stiction.scratch import run_folder

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stiction.apps.web.loop_set import LoopSet
    from stiction.apps.web.served_sources import ServedSources

__all__ = ["Workspace", "open_workspace"]


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

    def closed_audits(self) -> list[Path]:
        """Audits that can be opened: those beside the open ones, and in the folder where the server was started."""
        is_open = {one.folder for one in self.audits.values()}
        roots = [Path.cwd(), *(folder.parent for folder in is_open)]
        return [folder for folder in find_audits(roots) if folder not in is_open]

    def open_audit(self, folder: Path) -> AuditLoops:
        """Open one of `closed_audits`."""
        opened = AuditLoops(folder, self.folder / "audits")
        self.audits[opened.id] = opened
        return opened

    def sets(self) -> dict[str, LoopSet]:
        """All sets of loops by their id."""
        sets: dict[str, LoopSet] = {**self.audits}
        if self.session.rows or not self.audits:
            sets[self.session.id] = self.session
        return sets


@contextmanager
def open_workspace(sources: ServedSources) -> Iterator[Workspace]:
    """Make the temporary folder, and delete it at the end."""
    folder = Path(tempfile.mkdtemp(prefix="serve-", dir=run_folder()))
    try:
        for name in ("uploads", "readings", "session"):
            (folder / name).mkdir()
        yield Workspace(
            folder,
            Uploads(folder / "uploads"),
            Readings(folder / "readings"),
            SessionLoops(folder / "session"),
            list(sources.files),
            {one.id: one for one in (AuditLoops(path, folder / "audits") for path in sources.audits)},
        )
    finally:
        shutil.rmtree(folder, ignore_errors=True)
