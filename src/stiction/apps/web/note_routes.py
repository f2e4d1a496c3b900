"""Routes of the notes on a loop: `labels.csv` of the audit, append-only."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from stiction.apps.web.bodies import read_json
from stiction.apps.web.loop_routes import find_set
from stiction.apps.web.note_files import read_notes, write_note

if TYPE_CHECKING:
    from starlette.requests import Request

__all__ = ["ROUTES"]

MAX_NOTE, MAX_NAME = 2000, 100
"""Characters of a note and of a name [-]."""


async def _notes(request: Request) -> Response:
    loops, key = find_set(request), request.path_params["key"]
    tag = await loops.tag_of(request.app.state.workers, key)
    notes = await request.app.state.workers.quick.call(read_notes, str(loops.notes_folder), tag)
    return JSONResponse({**notes, "remark": loops.notes_remark})


async def _add(request: Request) -> Response:
    """Append a note; 409 with both texts when a newer one than the page showed is there."""
    loops, key = find_set(request), request.path_params["key"]
    body = await read_json(request)
    texts = {name: _text(body, name) for name in ("label", "note", "author", "newest_time")}
    if len(texts["note"]) > MAX_NOTE or len(texts["author"]) > MAX_NAME:
        raise HTTPException(422, f"A note has at most {MAX_NOTE} characters, a name {MAX_NAME}.")
    tag = await loops.tag_of(request.app.state.workers, key)
    answer = await request.app.state.workers.quick.call(write_note, str(loops.notes_folder), tag, texts)
    if "error" in answer:
        return JSONResponse(answer, 409)
    loops.set_label(key, answer["label"])
    return JSONResponse({**answer, "remark": loops.notes_remark})


def _text(body: dict[str, Any], name: str) -> str:
    value = body.get(name, "")
    if not isinstance(value, str):
        raise HTTPException(400, f"{name} is not a text; load the page again.")
    return value.strip()


ROUTES = [
    Route("/api/sets/{set}/loops/{key:int}/notes", _notes),
    Route("/api/sets/{set}/loops/{key:int}/notes", _add, methods=["POST"]),
]
