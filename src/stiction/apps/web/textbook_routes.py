"""Routes of the textbook screen."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute

from stiction.apps.paper_text import PARTS, SOURCE, TITLE
from stiction.apps.web.simulation_answers import answer_paper_part
from stiction.apps.web.simulation_socket import answer_questions
from stiction.apps.web.textbook_quantities import TEXTBOOK_MODELS, TEXTBOOK_QUANTITIES, TextbookSettings

if TYPE_CHECKING:
    from starlette.requests import Request

__all__ = ["ROUTES"]

PART_LIMIT_S = 120.0
"""Longest time that a part of the paper may take [s]."""


async def _options(_: Request) -> Response:
    """What the screen can move, and the parts of the paper."""
    body: dict[str, Any] = {
        "quantities": {name: asdict(one) for name, one in TEXTBOOK_QUANTITIES.items()},
        "models": TEXTBOOK_MODELS,
        "example": TextbookSettings().to_dict(),
        "parts": PARTS,
        "paper": {"title": TITLE, "source": SOURCE},
    }
    return JSONResponse(body)


async def _part(request: Request) -> Response:
    """One part of the paper, printed and repaired; it is computed once."""
    part = request.path_params["part"]
    if part not in PARTS:
        raise HTTPException(404, f"The paper has no part {part!r}; use one of {', '.join(PARTS)}.")
    cache: dict[str, bytes] = request.app.state.__dict__.setdefault("paper_parts", {})
    if part not in cache:
        cache[part] = await request.app.state.workers.background.call(answer_paper_part, part, limit_s=PART_LIMIT_S)
    return Response(cache[part], media_type="application/octet-stream")


ROUTES: list[Any] = [
    Route("/api/textbook/options", _options),
    Route("/api/textbook/parts/{part}", _part),
    WebSocketRoute("/api/textbook/socket", answer_questions),
]
"""Routes for `make_app`."""
