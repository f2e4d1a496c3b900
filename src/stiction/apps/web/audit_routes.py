"""Routes of the groups and of the comparison of audits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from starlette.exceptions import HTTPException
from starlette.routing import Route

from stiction.apps.web.audit_files import compare_with, describe_groups
from stiction.apps.web.bodies import json_bytes
from stiction.apps.web.loop_sets import find_set

if TYPE_CHECKING:
    from pathlib import Path

    from starlette.requests import Request
    from starlette.responses import Response

__all__ = ["ROUTES"]


def _audit_folder(request: Request) -> Path:
    folder = find_set(request).audit_folder
    if folder is None:
        raise HTTPException(
            404, "Groups and comparisons need an audit. Start the server with one: stiction serve AUDIT."
        )
    return folder


async def _groups(request: Request) -> Response:
    """Groups of loops that share an oscillation."""
    folder = _audit_folder(request)
    return json_bytes(await request.app.state.workers.background.call(describe_groups, str(folder)))


async def _compare(request: Request) -> Response:
    """What changed since another open audit."""
    folder = _audit_folder(request)
    other = request.app.state.workspace.audits.get(request.path_params["other"])
    if other is None:
        raise HTTPException(404, "The other audit is not open. Start the server with both: stiction serve AUDIT AUDIT.")
    call = (compare_with, str(folder), str(other.folder))
    return json_bytes(await request.app.state.workers.background.call(*call))


ROUTES = [
    Route("/api/sets/{set}/groups", _groups),
    Route("/api/sets/{set}/compare/{other}", _compare),
]
