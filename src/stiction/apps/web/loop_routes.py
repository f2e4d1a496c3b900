"""Routes of one loop: its page, its trends, its report."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from starlette.exceptions import HTTPException
from starlette.responses import FileResponse, Response
from starlette.routing import Route

from stiction.apps.web.bodies import json_bytes
from stiction.apps.web.loop_files import read_content, read_trend, try_remedies, write_loop_report
from stiction.apps.web.loop_sets import find_set

if TYPE_CHECKING:
    from starlette.requests import Request

__all__ = ["ROUTES"]

REPORT_LIMIT_S = 120.0
"""Longest time for writing a report or trying remedies [s]."""


async def _content(request: Request) -> Response:
    """What the page of a loop shows apart from its trends."""
    folder = await _folder(request)
    return json_bytes(await request.app.state.workers.quick.call(read_content, str(folder)))


async def _trend(request: Request) -> Response:
    """A window of the signals, thinned to the pixels of the plot."""
    folder = await _folder(request)
    window = [_number(request, name) for name in ("from", "to")]
    points = int(_number(request, "points") or 1000)
    return json_bytes(await request.app.state.workers.quick.call(read_trend, str(folder), *window, points))


async def _report(request: Request) -> Response:
    """The full report as a file that opens on its own."""
    loops, key = find_set(request), _key(request)
    record = await loops.record_path(request.app.state.workers, key)
    folder = await _folder(request)
    call = (write_loop_report, record, str(folder))
    path, name = await request.app.state.workers.background.call(*call, limit_s=REPORT_LIMIT_S)
    return FileResponse(path, media_type="text/html", filename=name)


async def _remedies(request: Request) -> Response:
    """What repair, retuning and compensation would bring, by simulation of the identified loop."""
    loops, key = find_set(request), _key(request)
    record = await loops.record_path(request.app.state.workers, key)
    folder = await _folder(request)
    call = (try_remedies, record, str(folder))
    return json_bytes(await request.app.state.workers.background.call(*call, limit_s=REPORT_LIMIT_S))


async def _folder(request: Request) -> Any:
    """Folder of the loop's files; the loop is diagnosed first when it was not yet."""
    return await find_set(request).prepare(request.app.state.workers, _key(request))


def _key(request: Request) -> int:
    return request.path_params["key"]


def _number(request: Request, name: str) -> float | None:
    text = request.query_params.get(name)
    try:
        value = None if text in (None, "") else float(text)
    except ValueError:
        value = float("nan")
    if value is not None and not abs(value) < 1e15:
        raise HTTPException(400, f"{name} is not a number; load the page again.")
    return value


ROUTES = [
    Route("/api/sets/{set}/loops/{key:int}", _content),
    Route("/api/sets/{set}/loops/{key:int}/trend", _trend),
    Route("/api/sets/{set}/loops/{key:int}/report", _report),
    Route("/api/sets/{set}/loops/{key:int}/remedies", _remedies),
]
