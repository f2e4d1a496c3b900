"""Reading of dropped files: one job for each drop, its progress, its receipts, and corrected columns."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
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
    from collections.abc import Coroutine, Iterator
    from pathlib import Path

    from starlette.requests import Request

    from stiction.apps.web.session_loops import SessionLoops
    from stiction.apps.web.workers import Workers

__all__ = ["ROUTES", "Reading", "Readings", "diagnose_files"]

READ_LIMIT_S = 300.0
"""Longest time for reading one drop [s]."""
MAX_EXPANDED_BYTES = 1_000_000_000
"""Size of a file after decompression up to which it is read [bytes]."""
TEXT_OPTIONS = ("delimiter", "decimal", "time_format", "timezone", "sheet")
NUMBER_OPTIONS = ("dt",)


@dataclass
class Reading:
    """One drop of files, which are read together as one source, and what came of it."""

    id: str
    files: list[tuple[str, str]]
    """Path and shown name of each file."""
    options: dict[str, Any]
    """Options of the reader."""
    answer: dict[str, Any] | None = None
    """What `read_files` returned; None while the files are read."""
    added: bool = False
    """Whether its loops are in the table of loops."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form, without paths."""
        answer = self.answer or {"loops": []}
        loops = [{k: v for k, v in loop.items() if k != "path"} for loop in answer["loops"]]
        head = {"id": self.id, "files": [name for _, name in self.files], "running": self.answer is None}
        return {**head, "added": self.added, **answer, "loops": loops}


class Readings:
    """All drops of one run of the server."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.all: dict[str, Reading] = {}
        self._numbers: Iterator[int] = count(1)
        self._folders: Iterator[int] = count(1)
        self._tasks: set[asyncio.Task[None]] = set()

    def start(self, workers: Workers, files: list[tuple[str, str]], options: dict[str, Any]) -> Reading:
        """Begin to read files."""
        reading = Reading(str(next(self._numbers)), files, options)
        self.all[reading.id] = reading
        self.run(self.read(workers, reading, options))
        return reading

    def run(self, work: Coroutine[Any, Any, None]) -> None:
        """Do some work in the background."""
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def find(self, identity: str) -> Reading:
        """Return a drop by its id, or raise 404."""
        if identity not in self.all:
            raise HTTPException(404, "These files are no longer available. Drop them again.")
        return self.all[identity]

    async def read(
        self, workers: Workers, reading: Reading, options: dict[str, Any], rows: list[dict[str, str]] | None = None
    ) -> None:
        """Read a drop, again when its columns were corrected."""
        folder = self.folder / str(next(self._folders))
        folder.mkdir(parents=True)
        call = (read_files, reading.files, options, rows, str(folder), MAX_EXPANDED_BYTES)
        answer: dict[str, Any] = {"loops": [], "failures": [], "assumptions": [], "columns": []}
        try:
            answer = await workers.background.call(*call, limit_s=READ_LIMIT_S)
        except (StictionError, WorkerLostError, TimeLimitError) as error:
            answer["error"] = str(error)
        except Exception as error:
            answer["error"] = f"an error in the program ({error}); please report it."
        if answer["error"] and reading.answer is not None:  # the corrected columns stay on the page
            answer["columns"] = reading.answer["columns"]
        reading.answer, reading.added = answer, False


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
    """Read a drop again with corrected columns."""
    readings: Readings = request.app.state.workspace.readings
    reading = readings.find(request.path_params["reading"])
    body = await read_json(request)
    rows = body.get("rows")
    if rows is not None and not (isinstance(rows, list) and all(isinstance(row, dict) for row in rows)):
        raise HTTPException(400, "The table of columns is not a list of rows; load the page again.")
    await readings.read(request.app.state.workers, reading, {**reading.options, **_options(body)}, rows)
    return JSONResponse(reading.to_dict())


async def _diagnose(request: Request) -> Response:
    """Put the loops of a drop into the table of loops and begin to diagnose them."""
    workspace = request.app.state.workspace
    reading = workspace.readings.find(request.path_params["reading"])
    keys = await add_loops(workspace.session, request.app.state.workers, reading)
    return JSONResponse({"set": workspace.session.id, "keys": keys})


async def add_loops(session: SessionLoops, workers: Workers, reading: Reading) -> list[int]:
    """Put the loops of a drop into the table of loops, once, and begin to diagnose them; return their keys."""
    keys: list[int] = []
    if reading.answer is not None and not reading.added:
        keys = session.add(reading.answer["loops"])
        reading.added = True
    await session.start(workers)
    return keys


async def diagnose_files(
    readings: Readings, session: SessionLoops, files: list[tuple[str, str]], workers: Workers
) -> None:
    """Read the files of the command line and diagnose their loops."""
    reading = Reading("given", files, {})
    readings.all[reading.id] = reading
    await readings.read(workers, reading, {})
    await add_loops(session, workers, reading)


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
    Route("/api/readings/{reading}", _correct, methods=["POST"]),
    Route("/api/readings/{reading}/diagnose", _diagnose, methods=["POST"]),
    Route("/api/map", _map, methods=["POST"]),
]
