"""Reading of dropped files: one job for each drop, its progress, its receipts, and corrected columns."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from itertools import count
from typing import TYPE_CHECKING, Any

from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from stiction.apps.web.bodies import read_json
from stiction.apps.web.read_files import map_as_csv, read_files
from stiction.errors import StictionError
from stiction.worker_process import TimeLimitError, WorkerLostError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from starlette.requests import Request

    from stiction.apps.web.workers import Workers

__all__ = ["ROUTES", "Reading", "Readings"]

READ_LIMIT_S = 300.0
"""Longest time for reading one source [s]."""
MAX_EXPANDED_BYTES = 1_000_000_000
"""Size of a file after decompression up to which it is read [bytes]."""
TEXT_OPTIONS = ("delimiter", "decimal", "time_format", "timezone", "sheet")
NUMBER_OPTIONS = ("dt",)


@dataclass
class Source:
    """Files that are read together, and what came of it."""

    files: list[tuple[str, str]]
    """Path and shown name of each file."""
    folder: Path
    state: str = "waiting"
    """waiting, reading, read or failed."""
    answer: dict[str, Any] = field(default_factory=dict)
    """What `read_files` returned."""
    added: bool = False
    """Whether its loops are in the table of loops."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form, without paths."""
        loops = [{k: v for k, v in loop.items() if k != "path"} for loop in self.answer.get("loops", [])]
        return {
            "files": [name for _, name in self.files],
            "state": self.state,
            "added": self.added,
            **{name: self.answer.get(name) for name in ("error", "assumptions", "columns")},
            "loops": loops,
        }


@dataclass
class Reading:
    """One drop of files."""

    id: str
    sources: list[Source]
    options: dict[str, Any]
    running: bool = True

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        done = sum(one.state in ("read", "failed") for one in self.sources)
        progress = {"done": done, "total": len(self.sources), "running": self.running}
        return {"id": self.id, **progress, "sources": [one.to_dict() for one in self.sources]}


class Readings:
    """All drops of one run of the server."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.all: dict[str, Reading] = {}
        self._numbers: Iterator[int] = count(1)
        self._folders: Iterator[int] = count(1)
        self._tasks: set[asyncio.Task[None]] = set()

    def start(self, workers: Workers, files: list[tuple[str, str]], options: dict[str, Any]) -> Reading:
        """Begin to read files; each is tried alone first."""
        sources = [Source([one], self._new_folder()) for one in files]
        reading = Reading(str(next(self._numbers)), sources, options)
        self.all[reading.id] = reading
        task = asyncio.create_task(self._run(workers, reading))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return reading

    def find(self, identity: str) -> Reading:
        """Return a drop by its id, or raise 404."""
        if identity not in self.all:
            raise HTTPException(404, "These files are no longer available. Drop them again.")
        return self.all[identity]

    async def _run(self, workers: Workers, reading: Reading) -> None:
        try:
            for source in reading.sources:
                await self.read(workers, source, reading.options)
            await self._read_together(workers, reading)
        finally:
            reading.running = False

    async def read(
        self, workers: Workers, source: Source, options: dict[str, Any], rows: list[dict[str, str]] | None = None
    ) -> None:
        """Read one source, again when its columns were corrected."""
        source.state, source.folder = "reading", self._new_folder()
        call = (read_files, source.files, options, rows, str(source.folder), MAX_EXPANDED_BYTES)
        try:
            answer = await workers.background.call(*call, limit_s=READ_LIMIT_S)
        except (StictionError, WorkerLostError, TimeLimitError) as error:
            answer = {"error": str(error)}
        except Exception as error:
            answer = {"error": f"an error in the program ({error}); please report it."}
        if answer.get("error") and rows is not None:  # the corrected columns stay on the page
            answer["columns"] = source.answer.get("columns", [])
        source.answer = answer
        source.state = "failed" if answer.get("error") else "read"

    async def _read_together(self, workers: Workers, reading: Reading) -> None:
        """Read files that hold no loop alone as one source, such as files of one tag each."""
        alone = [one for one in reading.sources if one.state == "failed" and one.answer.get("columns")]
        if len(alone) < 2:
            return
        together = Source([file for one in alone for file in one.files], self._new_folder())
        await self.read(workers, together, reading.options)
        if together.state == "read":
            reading.sources = [*(one for one in reading.sources if one not in alone), together]

    def _new_folder(self) -> Path:
        folder = self.folder / str(next(self._folders))
        folder.mkdir(parents=True)
        return folder


async def _list(request: Request) -> Response:
    workspace = request.app.state.workspace
    readings = [one.to_dict() for one in workspace.readings.all.values()]
    return JSONResponse({"readings": readings, "max_file_bytes": workspace.uploads.max_file_bytes})


async def _start(request: Request) -> Response:
    body = await read_json(request)
    workspace = request.app.state.workspace
    names = body.get("files")
    if not isinstance(names, list) or not names:
        raise HTTPException(400, "No file was given. Drop a file.")
    files = [(str(one.path), one.name) for one in map(workspace.uploads.find, map(str, names))]
    reading = workspace.readings.start(request.app.state.workers, files, _options(body))
    return JSONResponse(reading.to_dict(), 201)


def _options(body: dict[str, Any]) -> dict[str, Any]:
    """Options of the reader that the page may give; the reader checks their values."""
    given = body.get("options") or {}
    options: dict[str, Any] = {name: given[name] for name in TEXT_OPTIONS if given.get(name)}
    try:
        options |= {name: float(given[name]) for name in NUMBER_OPTIONS if given.get(name)}
        if given.get("op_low") not in (None, "") and given.get("op_high") not in (None, ""):
            options["op_range"] = (float(given["op_low"]), float(given["op_high"]))
    except (TypeError, ValueError):
        raise HTTPException(422, "The sampling period and the range of OP must be numbers.") from None
    if given.get("day_first") in ("yes", "no"):
        options["day_first"] = given["day_first"] == "yes"
    return options


async def _get(request: Request) -> Response:
    return JSONResponse(request.app.state.workspace.readings.find(request.path_params["reading"]).to_dict())


async def _correct(request: Request) -> Response:
    """Read a source again with corrected columns."""
    readings: Readings = request.app.state.workspace.readings
    reading = readings.find(request.path_params["reading"])
    source = _source(reading, request.path_params["source"])
    body = await read_json(request)
    rows = body.get("rows")
    if rows is not None and not (isinstance(rows, list) and all(isinstance(row, dict) for row in rows)):
        raise HTTPException(400, "The table of columns is not a list of rows; load the page again.")
    options = {**reading.options, **_options(body)}
    await readings.read(request.app.state.workers, source, options, rows)
    source.added = False
    return JSONResponse(source.to_dict())


def _source(reading: Reading, number: int) -> Source:
    if not 0 <= number < len(reading.sources):
        raise HTTPException(404, "This source is no longer available. Drop the file again.")
    return reading.sources[number]


async def _diagnose(request: Request) -> Response:
    """Put the loops of a drop into the table of loops and begin to diagnose them."""
    workspace = request.app.state.workspace
    reading = workspace.readings.find(request.path_params["reading"])
    keys: list[int] = []
    for source in reading.sources:
        if source.state == "read" and not source.added:
            keys += workspace.session.add(source.answer["loops"])
            source.added = True
    await workspace.session.start(request.app.state.workers)
    return JSONResponse({"set": workspace.session.id, "keys": keys})


async def _map(request: Request) -> Response:
    """Give the table of columns as a mapping file."""
    body = await read_json(request)
    rows = [row for row in body.get("rows", []) if isinstance(row, dict)]
    headers = {"Content-Disposition": 'attachment; filename="map.csv"'}
    return Response(map_as_csv(rows), media_type="text/csv; charset=utf-8", headers=headers)


ROUTES = [
    Route("/api/readings", _list),
    Route("/api/readings", _start, methods=["POST"]),
    Route("/api/readings/{reading}", _get),
    Route("/api/readings/{reading}/sources/{source:int}", _correct, methods=["POST"]),
    Route("/api/readings/{reading}/diagnose", _diagnose, methods=["POST"]),
    Route("/api/map", _map, methods=["POST"]),
]
