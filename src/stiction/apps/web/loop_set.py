"""A set of loops as the routes see it: dropped files, or an audit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from pathlib import Path

    from stiction.apps.web.workers import Workers

__all__ = ["LoopSet"]


class LoopSet(Protocol):
    """Loops with a row, a page and a record each; a loop is named by its key, a number that stays."""

    id: str
    name: str
    notes_remark: str
    """Where notes are kept."""

    @property
    def notes_folder(self) -> Path:
        """Folder of `labels.csv`."""
        ...

    @property
    def audit_folder(self) -> Path | None:
        """Folder of the audit, which has groups and can be compared; None of other sets."""
        ...

    @property
    def is_running(self) -> bool:
        """Whether loops are being diagnosed."""
        ...

    async def changes(self, workers: Workers, since: int) -> bytes:
        """Rows that changed after a version, and the progress, as JSON."""
        ...

    async def sparks(self, workers: Workers, keys: list[int]) -> dict[str, list[float | None]]:
        """Small trends of rows that have none: key -> values."""
        ...

    async def tag_of(self, workers: Workers, key: int) -> str:
        """Tag of a loop."""
        ...

    async def prepare(self, workers: Workers, key: int) -> Path:
        """Make what the page of a loop shows, if that was not done yet; return its folder."""
        ...

    async def record_path(self, workers: Workers, key: int) -> str:
        """File of the record of a loop."""
        ...

    def set_label(self, key: int, label: str) -> None:
        """Show the newest note of a loop in its row."""
        ...

    async def start(self, workers: Workers) -> None:
        """Begin, or go on, to diagnose loops."""
        ...

    async def stop(self) -> None:
        """Diagnose no further loop; what is done stays."""
        ...

    def progress(self) -> dict[str, Any]:
        """How far the diagnoses are."""
        ...
