"""Routes of the what-if screen."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from starlette.responses import JSONResponse
from starlette.routing import Route, WebSocketRoute

from stiction.apps.web.simulation_socket import answer_questions
from stiction.apps.web.whatif_quantities import COMPENSATORS, QUANTITIES, VALVE_MODELS
from stiction.apps.web.whatif_settings import WhatIfSettings

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response

__all__ = ["ROUTES"]


async def _options(_: Request) -> Response:
    """What the screen can move, and the example that it shows without a record."""
    body: dict[str, Any] = {
        "quantities": {name: asdict(one) for name, one in QUANTITIES.items()},
        "models": VALVE_MODELS,
        "compensators": COMPENSATORS,
        "example": WhatIfSettings().to_dict(),
    }
    return JSONResponse(body)


ROUTES: list[Any] = [
    Route("/api/whatif/options", _options),
    WebSocketRoute("/api/whatif/socket", answer_questions),
]
"""Routes for `make_app`."""
