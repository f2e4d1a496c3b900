"""Routes of the textbook screen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute

from stiction.apps.web.simulation_socket import answer_questions
from stiction.apps.web.textbook_settings import TEXTBOOK_MODELS, TextbookSettings

if TYPE_CHECKING:
    from starlette.requests import Request

__all__ = ["ROUTES"]


async def _options(_: Request) -> Response:
    """What the screen can move."""
    return JSONResponse({**TextbookSettings.options(), "models": TEXTBOOK_MODELS})


ROUTES: list[Any] = [
    Route("/api/textbook/options", _options),
    WebSocketRoute("/api/textbook/socket", answer_questions),
]
"""Routes for `make_app`."""
