"""Bodies of requests and answers: JSON with a limit on its size."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from starlette.exceptions import HTTPException
from starlette.responses import Response

if TYPE_CHECKING:
    from starlette.requests import Request

__all__ = ["json_bytes", "read_json"]

MAX_JSON_BYTES = 2_000_000
"""Size of a JSON body above which it is refused [bytes]."""


async def read_json(request: Request, max_bytes: int = MAX_JSON_BYTES) -> dict[str, Any]:
    """Return the JSON object that a request sends.

    Raises
    ------
    HTTPException
        413 when it is too large, 400 when it is no JSON object.
    """
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > max_bytes:
            raise HTTPException(413, f"The request is larger than {max_bytes} bytes.")
    try:
        value = json.loads(bytes(body))
    except ValueError:
        raise HTTPException(400, "The request is not valid JSON; load the page again.") from None
    if not isinstance(value, dict):
        raise HTTPException(400, "The request is not a JSON object; load the page again.")
    return value


def json_bytes(body: bytes) -> Response:
    """Return an answer whose JSON text a worker has written."""
    return Response(body, media_type="application/json")
