"""The loops of an audit as a set of the page."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import json
import signal
import sys
from itertools import count
from typing import TYPE_CHECKING, Any

from starlette.exceptions import HTTPException

from stiction.apps.web.audit_files import audit_rows, audit_sparks, audit_version, result_version, tag_of_loop
from stiction.apps.web.audit_loop import prepare_audit_loop, write_audit_record
from stiction.errors import StictionError
from stiction.worker_process import TimeLimitError, WorkerLostError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from stiction.apps.web.workers import Workers

__all__ = ["AuditLoops"]

LOOP_LIMIT_S = 120.0
"""Longest time for the page of one loop [s]."""
STOP_LIMIT_S = 20.0
"""Time in which a running audit ends after it was asked to [s]."""
_numbers: Iterator[int] = count(1)


class AuditLoops:
    """An audit that the command line named; nothing but `labels.csv` is written into its folder."""

    notes_remark = "Notes are stored in labels.csv in the folder of the audit."

    def __init__(self, folder: Path, cache: Path) -> None:
        self.id = f"audit{next(_numbers)}"
        self.folder = folder.resolve()
        self.name = folder.resolve().name
        self._cache = cache
        self._process: asyncio.subprocess.Process | None = None
        self._rows: tuple[int, bytes] | None = None
        self._locks: dict[int, asyncio.Lock] = {}

    @property
    def notes_folder(self) -> Path:
        """Folder of `labels.csv`."""
        return self.folder

    @property
    def audit_folder(self) -> Path:
        """Folder of the audit."""
        return self.folder

    async def changes(self, workers: Workers, since: int) -> bytes:
        """Rows and progress as JSON."""
        await self._raise_failure()
        version = await asyncio.to_thread(audit_version, str(self.folder))
        if since == version and not self.is_running:
            return self._unchanged(version)
        if since == 0 and self._rows is not None and self._rows[0] == version:
            return self._rows[1]
        body: bytes = await workers.quick.call(audit_rows, str(self.folder), since)
        if since == 0:
            self._rows = (version, body)
        return body.replace(b'"running":false', b'"running":true', 1) if self.is_running else body

    def _unchanged(self, version: int) -> bytes:
        """The answer when nothing changed; the page keeps its progress."""
        return json.dumps({"version": version, "rows": [], "progress": None}).encode()

    async def sparks(self, workers: Workers, keys: list[int]) -> dict[str, list[float | None]]:
        """Small trends of some loops: PV less SP, block means."""
        return await workers.quick.call(audit_sparks, str(self.folder), keys)

    async def preload(self, workers: Workers) -> None:
        """Make the table before the page asks for it; the page says what is wrong with the audit."""
        with contextlib.suppress(StictionError, WorkerLostError, TimeLimitError, HTTPException):
            await self.changes(workers, 0)

    async def tag_of(self, workers: Workers, key: int) -> str:
        """Tag of a loop."""
        return await workers.quick.call(tag_of_loop, str(self.folder), key)

    async def prepare(self, workers: Workers, key: int) -> Path:
        """Write what the page of a loop shows, if that was not done since the last change; return its folder."""
        version = await asyncio.to_thread(result_version, str(self.folder))
        name = hashlib.sha256(f"{self.folder} {version}".encode()).hexdigest()[:16]
        target = self._cache / name / str(key)
        async with self._locks.setdefault(key, asyncio.Lock()):
            if not (target / "content.json").is_file():
                call = (prepare_audit_loop, str(self.folder), key, str(target))
                await workers.background.call(*call, limit_s=LOOP_LIMIT_S)
        return target

    async def record_path(self, workers: Workers, key: int) -> str:
        """Write the record of a loop as a file; return its path."""
        folder = await self.prepare(workers, key)
        path = str(folder / "record.parquet")
        async with self._locks[key]:
            await workers.background.call(write_audit_record, str(self.folder), key, path, limit_s=LOOP_LIMIT_S)
        return path

    def set_label(self, key: int, label: str) -> None:
        """Nothing to do: the rows are read again when `labels.csv` has changed."""

    @property
    def is_running(self) -> bool:
        """Whether the audit goes on in a process of this server."""
        return self._process is not None and self._process.returncode is None

    async def start(self, workers: Workers) -> None:
        """Go on with the audit in a process of its own."""
        del workers
        if not self.is_running:
            command = (sys.executable, "-m", "stiction.apps.web.audit_process", str(self.folder))
            self._process = await asyncio.create_subprocess_exec(*command, stderr=asyncio.subprocess.PIPE)

    async def stop(self) -> None:
        """Stop the audit; what is done stays."""
        process = self._process
        if process is None or process.returncode is not None:
            return
        process.send_signal(signal.SIGINT if sys.platform != "win32" else signal.SIGTERM)
        try:
            await asyncio.wait_for(process.wait(), STOP_LIMIT_S)
        except TimeoutError:
            process.kill()

    async def _raise_failure(self) -> None:
        """Say once why the audit ended early, if it did."""
        process = self._process
        if process is None or process.returncode in (None, 0, 130) or process.stderr is None:
            return
        lines = (await process.stderr.read()).decode(errors="replace").strip().splitlines()
        self._process = None
        if lines:
            raise HTTPException(409, f"The audit could not be continued: {lines[-1]}")

    def progress(self) -> dict[str, Any]:
        """Whether the audit goes on; the rows tell how far it is."""
        return {"running": self.is_running}
