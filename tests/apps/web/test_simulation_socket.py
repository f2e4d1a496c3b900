"""The socket of the what-if and textbook screens with a client and workers made by the test."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
from starlette.websockets import WebSocketDisconnect

from apps.web.running import run_apart
from stiction.apps.web.simulation_answers import answer
from stiction.apps.web.simulation_socket import LatestValue, answer_questions
from stiction.errors import ParameterError
from stiction.worker_process import TimeLimitError, WorkerLostError

if TYPE_CHECKING:
    from collections.abc import Callable


class Pool:
    """A pool whose calls end when `is_ready()`, and that remembers which questions it was given."""

    def __init__(self, fault: Exception | None = None) -> None:
        self.fault = fault
        self.questions: list[int] = []
        self.is_ready: Callable[[], bool] = lambda: True

    async def call(self, function: Any, *arguments: Any, limit_s: float) -> bytes:
        """Stand for a worker."""
        assert function is answer
        assert limit_s > 0.0
        self.questions.append(arguments[1])
        while not self.is_ready():
            await asyncio.sleep(0.001)
        if self.fault is not None:
            raise self.fault
        return f"answer {arguments[1]}".encode()


class Client:
    """A socket that sends prepared messages, each when the server has dealt with the one before, and then leaves."""

    def __init__(self, messages: list[str], answers: int, quick: Pool, background: Pool) -> None:
        self.messages = messages
        self.answers = answers
        self.sent: list[Any] = []
        self.app = SimpleNamespace(state=SimpleNamespace(workers=SimpleNamespace(quick=quick, background=background)))

    async def accept(self) -> None:
        """Nothing to do."""

    async def receive_text(self) -> str:
        """Give the next message; after the last one wait for the answers and leave."""
        for _ in range(20):
            await asyncio.sleep(0.0)
        if self.messages:
            return self.messages.pop(0)
        while len(self.sent) < self.answers:
            await asyncio.sleep(0.001)
        for _ in range(20):
            await asyncio.sleep(0.0)
        raise WebSocketDisconnect

    async def send_bytes(self, body: bytes) -> None:
        """Remember an answer."""
        self.sent.append(body)

    async def send_json(self, body: dict[str, Any]) -> None:
        """Remember a message."""
        self.sent.append(body)


def question(kind: str, number: int) -> str:
    """A question as the page sends it."""
    return json.dumps({"kind": kind, "id": number, "values": {}, "width": 500})


def talk(messages: list[str], answers: int, quick: Pool, background: Pool) -> list[Any]:
    """What the client got after its messages and so many answers."""
    client = Client(messages, answers, quick, background)
    run_apart(answer_questions(client))  # pyright: ignore[reportArgumentType]
    return client.sent


def test_of_the_questions_that_wait_only_the_latest_is_answered() -> None:
    messages, quick = [question("trend", k) for k in range(1, 9)], Pool()
    quick.is_ready = lambda: not messages
    sent = talk(messages, 2, quick, Pool())
    assert quick.questions == [1, 8]
    assert sent == [b"answer 1", b"answer 8"]


def test_a_slow_prediction_does_not_hold_up_the_trend() -> None:
    quick, background = Pool(), Pool()
    background.is_ready = lambda: quick.questions == [2, 3]
    sent = talk([question("cycles", 1), question("trend", 2), question("trend", 3)], 3, quick, background)
    assert sorted(sent) == [b"answer 1", b"answer 2", b"answer 3"]
    assert sent[0] == b"answer 2"
    assert background.questions == [1]


def test_next_question_is_answered_after_an_error() -> None:
    quick = Pool(ParameterError("S = 300 % is too large."))
    sent = talk([question("trend", 1), question("trend", 2)], 2, quick, Pool())
    assert sent == [{"kind": "trend", "id": k, "error": "S = 300 % is too large."} for k in (1, 2)]


@pytest.mark.parametrize("fault", [TimeLimitError("Too long."), WorkerLostError("Lost.")])
def test_a_fault_that_may_pass_asks_the_page_to_try_again(fault: Exception) -> None:
    sent = talk([question("trend", 1)], 1, Pool(fault), Pool())
    assert sent == [{"kind": "trend", "id": 1, "error": str(fault), "again": True}]


@pytest.mark.parametrize(
    "message", ["", "no json", "[]", "{}", '{"kind": "trend"}', question("magic", 1), "x" * 30_000]
)
def test_a_message_that_is_no_question_is_refused_and_the_socket_stays(message: str) -> None:
    sent = talk([message, question("trend", 7)], 2, Pool(), Pool())
    assert sent == [
        {"kind": "", "id": 0, "error": "The server could not read the request; load the page again."},
        b"answer 7",
    ]


def test_a_value_that_was_taken_is_not_given_again() -> None:
    async def use() -> None:
        place = LatestValue()
        place.put(1)
        place.put(2)
        assert await place.take() == 2
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(place.take(), 0.05)

    run_apart(use())


def test_the_server_process_imports_no_numbers_for_these_screens() -> None:
    modules = "stiction.apps.web.simulation_routes"
    code = f"import sys, {modules}; print(sorted({{'numpy', 'numba', 'scipy', 'polars'}} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
