"""One worker process: it runs the calls of the server one after the other."""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import signal
from typing import TYPE_CHECKING, Any

from stiction.errors import StictionError

if TYPE_CHECKING:
    from collections.abc import Callable
    from multiprocessing.connection import Connection

__all__ = ["TimeLimitError", "Worker", "WorkerFaultError", "WorkerLostError"]


class WorkerLostError(RuntimeError):
    """A worker process ended during a call."""


class TimeLimitError(RuntimeError):
    """A call took too long, and its worker process was ended."""


class WorkerFaultError(RuntimeError):
    """A call failed by a fault of the program."""


def _answer_calls(connection: Connection, niceness: int) -> None:
    """Run the calls of the server until it closes the connection. Runs in the worker process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "nice"):
        os.nice(niceness)
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    while True:
        try:
            function, arguments = connection.recv()
        except (EOFError, OSError):
            return
        try:
            answer = (True, function(*arguments))
        except StictionError as error:
            answer = (False, error)
        except Exception as error:
            import traceback

            traceback.print_exc()
            answer = (False, WorkerFaultError(f"{type(error).__name__}: {error}"))
        try:
            connection.send(answer)
        except OSError:
            return


class Worker:
    """One worker process. It runs one call at a time and is started again when it ends."""

    def __init__(self, niceness: int = 0) -> None:
        self._niceness = niceness
        self._process: Any = None
        self._connection: Connection | None = None

    def start(self) -> None:
        """Start the process, if it does not run."""
        if self._process is not None and self._process.is_alive():
            return
        context = multiprocessing.get_context("spawn")
        self._connection, other = context.Pipe()
        self._process = context.Process(target=_answer_calls, args=(other, self._niceness), daemon=True)
        self._process.start()
        other.close()

    def stop(self) -> None:
        """End the process at once."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._process = None
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    async def call(self, function: Callable[..., Any], *arguments: Any, limit_s: float = 600.0) -> Any:
        """Run a function of a module in the process and return what it returns.

        Raises
        ------
        WorkerLostError, TimeLimitError
            When the process ended, or took more than `limit_s`; the next call starts another.
        """
        self.start()
        connection = self._connection
        assert connection is not None
        try:
            connection.send((function, arguments))
            done, answer = await asyncio.wait_for(asyncio.to_thread(connection.recv), limit_s)
        except TimeoutError:
            self._process.kill()
            self._process.join()
            self._process = self._connection = None  # the thread that still reads closes with the connection
            raise TimeLimitError(f"This took more than {limit_s:g} s and was stopped.") from None
        except (EOFError, OSError):
            self.stop()
            raise WorkerLostError(
                "A worker process ended unexpectedly, perhaps for lack of memory. It was started again; try once more."
            ) from None
        if done:
            return answer
        raise answer
