"""Routes of the table of loops: rows, progress, stop and go on, export of what is shown."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from stiction.apps.web.bodies import json_bytes, read_json
from stiction.apps.web.export_table import FORMATS, export_table
from stiction.apps.web.served_sources import check_audit

if TYPE_CHECKING:
    from pathlib import Path

    from starlette.requests import Request

    from stiction.apps.web.loop_set import LoopSet

__all__ = ["ROUTES", "find_set"]

MAX_SPARKS = 200
"""Small trends of one request [-]."""
MAX_EXPORT_BYTES = 30_000_000
"""Size of a table that may be exported [bytes]."""


def find_set(request: Request) -> LoopSet:
    """Return the set of loops that the path names.

    Raises HTTPException 404 when there is none.
    """
    name = request.path_params["set"]
    found = request.app.state.workspace.sets().get(name)
    if found is None:
        raise HTTPException(404, "This audit is not open. Choose another from the list.")
    return found


async def _list(request: Request) -> Response:
    sets = request.app.state.workspace.sets().values()
    closed = await asyncio.to_thread(request.app.state.workspace.closed_audits)
    return JSONResponse({"sets": [_describe(one) for one in sets], "closed": [_closed_name(one) for one in closed]})


def _closed_name(folder: Path) -> str:
    """Name under which a closed audit is shown, and by which it is opened."""
    return f"{folder.parent.name}/{folder.name}"


async def _open(request: Request) -> Response:
    """Open an audit of the list; a name that is not in it opens nothing."""
    name = (await read_json(request)).get("name")
    workspace = request.app.state.workspace
    closed = await asyncio.to_thread(workspace.closed_audits)
    chosen = next((folder for folder in closed if _closed_name(folder) == name), None)
    if chosen is None:
        raise HTTPException(404, "This audit is not in the list any more; load the page again.")
    await request.app.state.workers.background.call(check_audit, str(chosen))
    return JSONResponse(_describe(workspace.open_audit(chosen)))


def _describe(loops: LoopSet) -> dict[str, Any]:
    name = loops.name if loops.audit_folder is None else _closed_name(loops.audit_folder)
    return {"id": loops.id, "name": name, "is_audit": loops.audit_folder is not None}


async def _rows(request: Request) -> Response:
    """Rows that changed since a version that the page has."""
    try:
        since = int(request.query_params.get("since", "0"))
    except ValueError:
        raise HTTPException(400, "The version is not a number; load the page again.") from None
    return json_bytes(await find_set(request).changes(request.app.state.workers, since))


async def _sparks(request: Request) -> Response:
    """Small trends of the rows in view."""
    texts = request.query_params.get("keys", "").split(",")[:MAX_SPARKS]
    if not all(text.isdecimal() for text in texts):
        raise HTTPException(400, "The numbers of the loops cannot be read; load the page again.")
    sparks = await find_set(request).sparks(request.app.state.workers, [int(text) for text in texts])
    return JSONResponse({"sparks": sparks})


async def _run(request: Request) -> Response:
    """Stop, or go on with, the diagnoses of a set."""
    loops = find_set(request)
    body = await read_json(request)
    if body.get("run"):
        others = [one for one in request.app.state.workspace.audits.values() if one is not loops]
        if loops.audit_folder is not None and any(one.is_running for one in others):
            raise HTTPException(409, "Another audit is running. Stop it first: one runs at a time.")
        await loops.start(request.app.state.workers)
    else:
        await loops.stop()
    return JSONResponse(loops.progress())


async def _export(request: Request) -> Response:
    """Write the rows and columns that the page shows as a file."""
    body = await read_json(request, MAX_EXPORT_BYTES)
    kind, columns, rows = body.get("format"), body.get("columns"), body.get("rows")
    if kind not in FORMATS:
        raise HTTPException(400, f"The format is unknown; use one of {', '.join(FORMATS)}.")
    if not isinstance(columns, list) or not isinstance(rows, list):
        raise HTTPException(400, "The table has no rows or no columns.")
    content = await request.app.state.workers.background.call(export_table, kind, columns, rows)
    headers = {"Content-Disposition": f'attachment; filename="loops.{kind}"'}
    return Response(content, media_type=FORMATS[kind], headers=headers)


ROUTES = [
    Route("/api/sets", _list),
    Route("/api/sets", _open, methods=["POST"]),
    Route("/api/sets/{set}/rows", _rows),
    Route("/api/sets/{set}/sparks", _sparks),
    Route("/api/sets/{set}/run", _run, methods=["POST"]),
    Route("/api/export", _export, methods=["POST"]),
]
