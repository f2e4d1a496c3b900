"""Routes of the page *Now*: what a running watch does, and acknowledging its alarms."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.routing import Route

from stiction.apps.web.bodies import read_json

if TYPE_CHECKING:
    from starlette.requests import Request

__all__ = ["ROUTES"]


def _watch_folder(request: Request) -> Path:
    """Folder of the watch of which an open audit is the result."""
    from stiction.watch.store import FILE

    for one in request.app.state.workspace.audits.values():
        folder = Path(one.folder).absolute().parent
        if (folder / FILE).is_file():
            return folder
    raise HTTPException(404, "No open audit belongs to a watch. Start the server with one: stiction serve watch/audit.")


async def _now(request: Request) -> Response:
    from stiction.report.now_page import now_page

    return HTMLResponse(await run_in_threadpool(now_page, _watch_folder(request)))


async def _acknowledge(request: Request) -> Response:
    """Acknowledge an alarm: `alarm` and `who`, and a comment as `text`."""
    body = await read_json(request, 10_000)
    about = {name: str(body.get(name, "")).strip() for name in ("alarm", "who", "text")}

    def act() -> None:
        from stiction.watch.alarm_actions import act_on_alarm
        from stiction.watch.store import WatchStore

        store = WatchStore(_watch_folder(request))
        try:
            act_on_alarm(store, about["alarm"], "acknowledge", who=about["who"], text=about["text"])
        finally:
            store.close()

    await run_in_threadpool(act)
    return JSONResponse({})


ROUTES = [Route("/now", _now), Route("/now", _acknowledge, methods=["POST"])]
