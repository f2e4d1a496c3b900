"""The socket of the what-if and textbook screens: of the questions of one kind, only the latest is answered."""

from __future__ import annotations

import asyncio
import json
from typing import TYPE_CHECKING, Any

from starlette.websockets import WebSocketDisconnect

from stiction.apps.web.simulation_answers import QUICK_KINDS, SLOW_KINDS, answer
from stiction.errors import StictionError
from stiction.worker_process import TimeLimitError, WorkerFaultError, WorkerLostError

if TYPE_CHECKING:
    from starlette.websockets import WebSocket

    from stiction.apps.web.workers import WorkerPool

__all__ = ["LatestValue", "answer_questions"]

MAX_MESSAGE_CHARS = 20_000
"""Longest question [characters]."""
QUICK_LIMIT_S, SLOW_LIMIT_S = 30.0, 60.0
"""Longest time of an answer [s]."""


class LatestValue:
    """A place for one value: a new value replaces one that was not taken yet."""

    def __init__(self) -> None:
        self._value: Any = None
        self._filled = asyncio.Event()

    def put(self, value: Any) -> None:
        """Put a value in place of what is there."""
        self._value = value
        self._filled.set()

    async def take(self) -> Any:
        """Wait for a value, and take it away."""
        await self._filled.wait()
        self._filled.clear()
        return self._value


async def answer_questions(socket: WebSocket) -> None:
    """Answer the questions of one client until it leaves.

    A question is `{"kind", "id", "values", "width"}`. The answer is binary (see `packed`), or a text
    `{"kind", "id", "error"}`, with `"again": true` where the same question may be answered later.
    """
    workers = socket.app.state.workers
    await socket.accept()
    places = {kind: LatestValue() for kind in (*QUICK_KINDS, *SLOW_KINDS)}
    tasks = [
        asyncio.create_task(_answer_latest(socket, place, workers.quick, QUICK_LIMIT_S))
        if kind in QUICK_KINDS
        else asyncio.create_task(_answer_latest(socket, place, workers.background, SLOW_LIMIT_S))
        for kind, place in places.items()
    ]
    try:
        while True:
            question = _parse_question(await socket.receive_text())
            if question is None or question["kind"] not in places:
                await socket.send_json(
                    {"kind": "", "id": 0, "error": "The server could not read the request; load the page again."}
                )
            else:
                places[question["kind"]].put(question)
    except WebSocketDisconnect:
        pass
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def _parse_question(text: str) -> dict[str, Any] | None:
    """The question in a message; None when it is none."""
    if len(text) > MAX_MESSAGE_CHARS:
        return None
    try:
        question = json.loads(text)
        return {
            "kind": str(question["kind"]),
            "id": int(question["id"]),
            "values": dict(question["values"]),
            "width": int(question["width"]),
        }
    except (ValueError, TypeError, KeyError):
        return None


async def _answer_latest(socket: WebSocket, place: LatestValue, pool: WorkerPool, limit_s: float) -> None:
    """Answer the latest question of one kind, again and again."""
    while True:
        question = await place.take()
        kind, request_id = question["kind"], question["id"]
        try:
            body = await pool.call(answer, kind, request_id, question["values"], question["width"], limit_s=limit_s)
            await socket.send_bytes(body)
        except (StictionError, WorkerFaultError) as error:
            await socket.send_json({"kind": kind, "id": request_id, "error": str(error)})
        except (TimeLimitError, WorkerLostError) as error:
            await socket.send_json({"kind": kind, "id": request_id, "error": str(error), "again": True})
