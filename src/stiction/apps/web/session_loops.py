"""The loops of dropped files: their rows, and the diagnoses that run in the background."""

from __future__ import annotations

import asyncio
import json
import time
from typing import TYPE_CHECKING, Any

from starlette.exceptions import HTTPException

from stiction.apps.web.diagnose_loop import diagnose_loop
from stiction.errors import StictionError
from stiction.worker_process import TimeLimitError, WorkerLostError

if TYPE_CHECKING:
    from pathlib import Path

    from stiction.apps.web.workers import Workers

__all__ = ["SessionLoops"]

DIAGNOSIS_LIMIT_S = 120.0
"""Longest time of one diagnosis [s]."""
FAILED = ("failed", "crashed")
"""Status of loops that could not be diagnosed."""
POLL_S = 0.05
"""Time between two looks at a diagnosis that is running [s]."""
MAX_LOOPS = 20_000
"""Loops of one session [-]."""


class SessionLoops:
    """The loops of all files that were dropped since the server started."""

    id = "session"
    name = "Dropped files"
    notes_remark = "Notes on dropped files are lost when the server ends. Notes on an audit are stored in its folder."

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.rows: list[dict[str, Any]] = []
        self._records: list[str] = []
        self._changed: list[int] = []
        self._version = 0
        self._tasks: set[asyncio.Task[None]] = set()
        self._running = False
        self._began = 0.0
        self._done_since = 0

    audit_folder = None

    @property
    def notes_folder(self) -> Path:
        """Folder of `labels.csv`."""
        return self.folder

    @property
    def is_running(self) -> bool:
        """Whether loops are being diagnosed."""
        return self._running

    def add(self, loops: list[dict[str, Any]]) -> list[int]:
        """Add the loops of a source that was read; return their keys."""
        if len(self.rows) + len(loops) > MAX_LOOPS:
            raise HTTPException(413, f"A session has at most {MAX_LOOPS} loops; use stiction audit for more.")
        keys = []
        for loop in loops:
            key = len(self.rows)
            row = {"key": key, "tag": loop["tag"], "area": loop["area"], "source": loop["source"], "status": "waiting"}
            self.rows.append(row)
            self._records.append(loop["path"])
            self._changed.append(0)
            self._touch(key)
            keys.append(key)
        return keys

    def _touch(self, key: int) -> None:
        self._version += 1
        self._changed[key] = self._version

    def loop_folder(self, key: int) -> Path:
        """Folder of what the page of a loop shows."""
        return self.folder / "loops" / str(key)

    def _row(self, key: int) -> dict[str, Any]:
        """Row of a loop, or 404."""
        if not 0 <= key < len(self.rows):
            raise HTTPException(
                404, "This loop is unknown. The server was perhaps started again: drop the file once more."
            )
        return self.rows[key]

    async def prepare(self, workers: Workers, key: int) -> Path:
        """Diagnose a loop if that was not done yet; return the folder of what its page shows."""
        row = self._row(key)
        while row["status"] == "running":
            await asyncio.sleep(POLL_S)
        if row["status"] == "waiting":
            await self.diagnose(workers, key)
        if row["status"] in FAILED:
            raise HTTPException(422, f"{row['tag']} could not be diagnosed: {row.get('error', '')}")
        return self.loop_folder(key)

    async def record_path(self, workers: Workers, key: int) -> str:
        """File of the record of a loop."""
        del workers
        self._row(key)
        return self._records[key]

    async def tag_of(self, workers: Workers, key: int) -> str:
        """Tag of a loop."""
        del workers
        return self._row(key)["tag"]

    def set_label(self, key: int, label: str) -> None:
        """Show the newest note of a loop in its row."""
        self.rows[key]["label"] = label
        self._touch(key)

    async def start(self, workers: Workers) -> None:
        """Begin, or go on, to diagnose the loops that wait."""
        if self._running:
            return
        self._running, self._began, self._done_since = True, time.monotonic(), 0
        for _ in range(workers.background.count):
            task = asyncio.create_task(self._run(workers))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
            task.add_done_callback(self._end)

    def _end(self, _: object) -> None:
        if not self._tasks:
            self._running = False

    async def stop(self) -> None:
        """Diagnose no further loop; those in work are finished."""
        self._running = False

    async def _run(self, workers: Workers) -> None:
        while self._running:
            waiting = next((row for row in self.rows if row["status"] == "waiting"), None)
            if waiting is None:
                return
            await self.diagnose(workers, waiting["key"])
            self._done_since += 1

    async def diagnose(self, workers: Workers, key: int) -> None:
        """Diagnose one loop. A failure becomes its row, with the reason."""
        row = self.rows[key]
        row["status"] = "running"
        self._touch(key)
        result = await self._try(workers, key)
        row |= result
        self._touch(key)

    async def _try(self, workers: Workers, key: int, tries: int = 2) -> dict[str, Any]:
        call = (diagnose_loop, self._records[key], str(self.loop_folder(key)))
        try:
            return await workers.background.call(*call, limit_s=DIAGNOSIS_LIMIT_S)
        except WorkerLostError as error:
            return await self._try(workers, key, tries - 1) if tries > 1 else _failure("crashed", str(error))
        except (StictionError, TimeLimitError) as error:
            return _failure("failed", str(error))
        except Exception as error:
            return _failure("failed", f"an error in the program ({error}); please report it.")

    async def changes(self, workers: Workers, since: int) -> bytes:
        """Rows that changed after a version, and the progress, as JSON."""
        del workers
        rows = [row for row, version in zip(self.rows, self._changed, strict=True) if version > since]
        answer = {"version": self._version, "rows": rows, "progress": self.progress()}
        return json.dumps(answer, separators=(",", ":"), allow_nan=False).encode()

    async def sparks(self, workers: Workers, keys: list[int]) -> dict[str, list[float | None]]:
        """Nothing: each row has its trend."""
        del workers, keys
        return {}

    def progress(self) -> dict[str, Any]:
        """Counts, rate and time left of the diagnoses."""
        total = len(self.rows)
        done = sum(row["status"] not in ("waiting", "running") for row in self.rows)
        rate = self._done_since / max(1e-9, time.monotonic() - self._began) if self._done_since else None
        return {
            "total": total,
            "done": done,
            "running": self._running and done < total,
            "per_second": rate,
            "left_s": (total - done) / rate if rate else None,
        }


def _failure(status: str, error: str) -> dict[str, Any]:
    return {"status": status, "error": error}
