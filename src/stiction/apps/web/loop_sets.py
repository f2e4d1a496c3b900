"""Routes of the table of loops: rows, progress, stop and go on, export of what is shown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from stiction.apps.web.bodies import json_bytes, read_json
from stiction.apps.web.export_table import FORMATS, export_table

if TYPE_CHECKING:
    from starlette.requests import Request

__all__ = ["ROUTES", "find_set"]

MAX_EXPORT_BYTES = 30_000_000
"""Size of a table that may be exported [bytes]."""


def find_set(request: Request) -> Any:
    """Return the set of loops that the path names.

    Raises
    ------
    HTTPException
        404 when there is none.
    """
    name = request.path_params["set"]
    found = request.app.state.workspace.sets().get(name)
    if found is None:
        raise HTTPException(404, "This audit is not open. Choose another from the list.")
    return found


async def _list(request: Request) -> Response:
    sets = request.app.state.workspace.sets().values()
    return JSONResponse({"sets": [{"id": one.id, "name": one.name, "can_run": one.can_run} for one in sets]})


async def _rows(request: Request) -> Response:
    """Rows that changed since a version that the page has."""
    try:
        since = int(request.query_params.get("since", "0"))
    except ValueError:
        raise HTTPException(400, "The version is no number.") from None
    changes = find_set(request).changes(since)
    if hasattr(changes, "__await__"):
        return json_bytes(await changes)
    return JSONResponse(changes)


async def _run(request: Request) -> Response:
    """Stop, or go on with, the diagnoses of a set."""
    loops = find_set(request)
    body = await read_json(request)
    if not loops.can_run:
        raise HTTPException(409, "This audit is complete; nothing is left to do.")
    if body.get("run"):
        loops.start(request.app.state.workers)
    else:
        loops.stop()
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
    Route("/api/sets/{set}/rows", _rows),
    Route("/api/sets/{set}/run", _run, methods=["POST"]),
    Route("/api/export", _export, methods=["POST"]),
]
