"""Routes of the two screens that simulate: textbook and what-if."""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING, Any

from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute

from stiction.apps.web.loop_routes import find_set
from stiction.apps.web.simulation_answers import answer_start
from stiction.apps.web.simulation_socket import answer_questions
from stiction.apps.web.textbook_settings import TEXTBOOK_MODELS, TextbookSettings
from stiction.apps.web.whatif_settings import COMPENSATORS, VALVE_MODELS, WhatIfSettings

if TYPE_CHECKING:
    from starlette.requests import Request

__all__ = ["ROUTES"]

START_LIMIT_S = 120.0
"""Longest time of an identification [s]."""
MAX_CACHED_STARTS = 50
"""Loops whose start stays in memory for the next visit [-]."""


async def _textbook_options(_: Request) -> Response:
    """What the textbook screen can move."""
    return JSONResponse({**TextbookSettings.options(), "models": TEXTBOOK_MODELS})


async def _whatif_options(_: Request) -> Response:
    """What the what-if screen can move, and the example that it shows without a record."""
    choices = {"models": VALVE_MODELS, "compensators": COMPENSATORS}
    return JSONResponse({**WhatIfSettings.options(), **choices})


async def _start(request: Request) -> Response:
    """Where the what-if screen starts for a loop: its identified settings and part of its record."""
    state = request.app.state
    loops, key = find_set(request), request.path_params["key"]
    cache: OrderedDict[str, bytes] = state.__dict__.setdefault("whatif_starts", OrderedDict())
    path = await loops.record_path(state.workers, key)  # another one when the audit was run again
    if path not in cache:
        cache[path] = await state.workers.background.call(answer_start, path, limit_s=START_LIMIT_S)
    cache.move_to_end(path)
    body = cache[path]
    while len(cache) > MAX_CACHED_STARTS:
        cache.popitem(last=False)
    return Response(body, media_type="application/octet-stream")


ROUTES: list[Any] = [
    Route("/api/textbook/options", _textbook_options),
    Route("/api/whatif/options", _whatif_options),
    Route("/api/whatif/start/{set}/{key:int}", _start),
    WebSocketRoute("/api/textbook/socket", answer_questions),
    WebSocketRoute("/api/whatif/socket", answer_questions),
]
"""Routes for `make_app`."""
