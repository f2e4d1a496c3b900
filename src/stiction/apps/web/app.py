"""The web application: its routes, its guard and its errors."""

from __future__ import annotations

import asyncio
import sys
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from stiction.apps.web import (
    STATIC,
    audit_routes,
    loop_routes,
    loop_sets,
    note_routes,
    now_routes,
    readings,
    simulation_routes,
    uploads,
)
from stiction.apps.web.bodies import read_json
from stiction.apps.web.guard import Guard
from stiction.apps.web.workers import Workers
from stiction.errors import StictionError
from stiction.worker_process import TimeLimitError, WorkerLostError

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from starlette.requests import Request

    from stiction.apps.web.access import Access
    from stiction.apps.web.workspace import Workspace

__all__ = ["make_app"]

FIRST_PAGE_LIMIT_S = 3.0
"""Longest time for which the preparation of the workers waits for a browser [s]."""
FIRST_SCREEN_S = 0.4
"""Time that a browser takes from the sign-in to its first screen, about [s]."""


def make_app(access: Access, workspace: Workspace) -> Guard:
    """Build the application inside its guard; `app.state` holds what the routes share: workers and workspace."""
    pages = (uploads, readings, loop_sets, loop_routes, note_routes, audit_routes, simulation_routes, now_routes)

    @asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        audits = workspace.audits.values()
        workers = app.state.workers = Workers([str(one.folder) for one in audits])
        app.state.signed_in = asyncio.Event()
        workers.start([_first_page(app.state.signed_in), *(one.preload(workers) for one in audits)])
        if workspace.files:
            workspace.readings.run(
                readings.diagnose_files(workspace.readings, workspace.session, workspace.files, app.state.workers)
            )
        yield
        for one in audits:
            await one.stop()
        app.state.workers.stop()

    app = Starlette(
        routes=[
            Route("/", _shell),
            Route("/healthz", lambda _: PlainTextResponse("ok")),
            Route("/favicon.ico", _favicon),
            Route("/api/start", _start),
            Route("/api/session", _session, methods=["GET", "POST"]),
            *(route for page in pages for route in page.ROUTES),
            Mount("/static", StaticFiles(directory=STATIC)),
        ],
        exception_handlers={
            StictionError: _refuse,
            HTTPException: _http_error,
            TimeLimitError: _server_error,
            Exception: _server_error,
        },
        lifespan=lifespan,
    )
    app.state.access = access
    app.state.workspace = workspace
    return Guard(app, access)


async def _first_page(signed_in: asyncio.Event) -> None:
    """Wait until a browser has signed in and drawn its first screen; without a browser not longer than the limit."""
    with suppress(TimeoutError):
        await asyncio.wait_for(signed_in.wait(), FIRST_PAGE_LIMIT_S)
    await asyncio.sleep(FIRST_SCREEN_S)


async def _shell(_: Request) -> Response:
    return FileResponse(STATIC / "index.html")


async def _favicon(_: Request) -> Response:
    return FileResponse(STATIC / "favicon.svg", media_type="image/svg+xml")


async def _start(request: Request) -> Response:
    """The screen to open first, and whether the page *Now* has a watch to show."""
    workspace = request.app.state.workspace
    screen = "loops" if workspace.audits or workspace.files else "drop"
    return JSONResponse({"screen": screen, "watch": now_routes.find_watch(workspace) is not None})


async def _session(request: Request) -> Response:
    """Exchange the token of the link for the cookie; GET says whether the cookie is valid."""
    access: Access = request.app.state.access
    if request.method == "GET":
        return JSONResponse({"signed_in": access.is_cookie(request.cookies.get(access.cookie_name, ""))})
    body = await read_json(request)
    if not access.is_token(str(body.get("token", ""))):
        message = (
            "The token in this address is wrong, or belongs to an earlier run of stiction serve. "
            "Open the address that the command printed."
        )
        return JSONResponse({"error": message}, 403)
    request.app.state.signed_in.set()
    response = JSONResponse({"signed_in": True})
    response.set_cookie(access.cookie_name, access.cookie, httponly=True, samesite="strict", path="/")
    return response


def _refuse(_: Request, error: Exception) -> Response:
    assert isinstance(error, StictionError)
    return JSONResponse({"error": error.text(where=error.file_name)}, 422)


def _http_error(_: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    return JSONResponse({"error": error.detail}, error.status_code)


def _server_error(_: Request, error: Exception) -> Response:
    print(f"stiction: {type(error).__name__}: {error}", file=sys.stderr)
    message = "An error in the program; please report it with the lines that stiction serve printed."
    if isinstance(error, (TimeLimitError, WorkerLostError)):
        message = str(error)
    return JSONResponse({"error": message}, 500)
