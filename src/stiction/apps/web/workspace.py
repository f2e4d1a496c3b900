"""What one run of the server works on: a temporary folder, the uploaded files, the loops, the audits."""

from __future__ import annotations

import shutil
import tempfile
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

__all__ = ["Workspace", "open_workspace"]


@dataclass
class Workspace:
    """Files and loops of one run of the server."""

    folder: Path
    """Temporary folder; it is deleted when the server ends."""
    sources: tuple[str, ...] = ()
    """Files that the command line named."""
    audits: list[Path] = field(default_factory=list)
    """Folders of audits that the command line named."""


@contextmanager
def open_workspace(sources: Sequence[str] = ()) -> Iterator[Workspace]:
    """Make the temporary folder, and delete it at the end.

    Raises
    ------
    RecordError
        When a source is no audit and no file.
    """
    folder = Path(tempfile.mkdtemp(prefix="stiction-serve-"))
    try:
        yield Workspace(folder, tuple(sources))
    finally:
        shutil.rmtree(folder, ignore_errors=True)
