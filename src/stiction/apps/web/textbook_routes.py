"""Routes of the textbook screen."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute

from stiction.apps.paper_text import SOURCE, TITLE
from stiction.apps.web.simulation_socket import answer_questions
from stiction.apps.web.textbook_quantities import TEXTBOOK_MODELS, TEXTBOOK_QUANTITIES, TextbookSettings

if TYPE_CHECKING:
    from starlette.requests import Request

__all__ = ["ROUTES"]


async def _options(_: Request) -> Response:
    """What the screen can move."""
    body: dict[str, Any] = {
        "quantities": {name: asdict(one) for name, one in TEXTBOOK_QUANTITIES.items()},
        "models": TEXTBOOK_MODELS,
        "example": TextbookSettings().to_dict(),
        "paper": {"title": TITLE, "source": SOURCE},
    }
    return JSONResponse(body)


ROUTES: list[Any] = [
    Route("/api/textbook/options", _options),
    WebSocketRoute("/api/textbook/socket", answer_questions),
]
"""Routes for `make_app`."""
