"""Routes of the page *Now*: what a running watch does, and what people do with its alarms."""

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

    from stiction.apps.web.workspace import Workspace

__all__ = ["ROUTES", "find_watch"]


def find_watch(workspace: Workspace) -> Path | None:
    """Folder of the watch of which an open audit is the result; None where there is none."""
    from stiction.watch.store import FILE

    folders = (Path(one.folder).absolute().parent for one in workspace.audits.values())
    return next((folder for folder in folders if (folder / FILE).is_file()), None)


def _watch_folder(request: Request) -> Path:
    if folder := find_watch(request.app.state.workspace):
        return folder
    raise HTTPException(404, "No open audit belongs to a watch. Start the server with one: stiction serve watch/audit.")


async def _now(request: Request) -> Response:
    from stiction.report.now_page import now_page

    return HTMLResponse(await run_in_threadpool(now_page, _watch_folder(request)))


async def _act(request: Request) -> Response:
    """Do something with an alarm: `alarm`, `action`, `who`, a comment as `text`, for shelving its end as `until`."""
    body = await read_json(request, 10_000)
    about = {name: str(body.get(name, "")).strip() for name in ("alarm", "action", "who", "text", "until")}
    action = about["action"] or "acknowledge"

    def act() -> None:
        from stiction.fleet.time_text import parse_moment
        from stiction.watch.alarm_actions import act_on_alarm
        from stiction.watch.store import WatchStore

        moment = parse_moment("until", about["until"] or None)
        until = moment and moment.timestamp()
        store = WatchStore(_watch_folder(request))
        try:
            act_on_alarm(store, about["alarm"], action, who=about["who"], text=about["text"], until=until)
        finally:
            store.close()

    await run_in_threadpool(act)
    return JSONResponse({})


ROUTES = [Route("/now", _now), Route("/now", _act, methods=["POST"])]
