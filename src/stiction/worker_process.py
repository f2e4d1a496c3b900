"""A worker process and the pipe to it, of an audit as of the web server."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from stiction.foreign_errors import data_error

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from multiprocessing.connection import Connection

__all__ = ["ONE_THREAD", "TimeLimitError", "WorkerFaultError", "WorkerLostError", "WorkerProcess"]

ONE_THREAD: dict[str, str] = dict.fromkeys(
    (
        *("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "POLARS_MAX_THREADS"),
        "VECLIB_MAXIMUM_THREADS",
    ),
    "1",
)
"""Environment of the workers: the loops are the parallel work."""


class WorkerLostError(RuntimeError):
    """A worker process ended during a call."""


class TimeLimitError(RuntimeError):
    """A call took too long, and its worker process was ended."""


class WorkerFaultError(RuntimeError):
    """A call failed by a fault of the program."""


class WorkerProcess:
    """One worker process with a pipe of its own; it runs one call at a time.

    Workers that share one pipe, as those of joblib and pebble, block all others when one is killed while it sends.
    """

    def __init__(self, niceness: int = 0) -> None:
        context = multiprocessing.get_context("spawn")
        self.is_ready = False
        """Whether it has begun to take calls."""
        self.pipe, end = context.Pipe()
        self._process = context.Process(target=_answer_calls, args=(end, os.getpid(), niceness), daemon=True)
        with _environment_of_workers(), end:
            self._process.start()

    @property
    def is_alive(self) -> bool:
        """Whether the process runs."""
        return self._process.is_alive()

    def send(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Call a function of a module in the process; that the process is dead shows when the answer is received."""
        with suppress(OSError):
            self.pipe.send((function, arguments))

    def receive(self) -> tuple[Any] | None:
        """Answer of the call, in a tuple; None from a process that has just started.

        Raises
        ------
        EOFError, OSError
            When the process is dead.
        StictionError, WorkerFaultError
            What the call raised.
        """
        message = self.pipe.recv()
        self.is_ready = True
        if message is None:
            return None
        succeeded, answer = message
        if not succeeded:
            raise answer
        return (answer,)

    def wait(self, limit_s: float) -> Any:
        """Wait for the answer of the call for a time [s]; the process is ended where there is none."""
        deadline = time.monotonic() + limit_s
        try:
            while self.pipe.poll(max(0.0, deadline - time.monotonic())):
                if (answer := self.receive()) is not None:
                    return answer[0]
        except (EOFError, OSError):
            self.kill()
            raise WorkerLostError(
                "A worker process ended unexpectedly, perhaps for lack of memory. It was started again; try once more."
            ) from None
        self.kill()
        raise TimeLimitError(f"This took more than {limit_s:g} s and was stopped.")

    def kill(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join()
        self.pipe.close()


@contextmanager
def _environment_of_workers() -> Iterator[None]:
    """Give processes that are started one thread, and keep Ctrl-C from them: the parent ends its workers."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if hasattr(signal, "pthread_sigmask") else None
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
        if mask is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _answer_calls(pipe: Connection, parent: int, niceness: int) -> None:
    """Run calls until the parent closes the pipe."""
    _end_with_parent(parent)
    if hasattr(os, "nice"):
        os.nice(niceness)
    with suppress(EOFError, OSError):
        pipe.send(None)
        while True:
            pipe.send(_run(*pipe.recv()))


def _run(function: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[bool, Any]:
    """Whether a call succeeded, and its answer or its error."""
    try:
        return True, function(*arguments)
    except BaseException as error:  # a panic of a library in Rust is no Exception
        if (known := data_error(error)) is not None:
            return False, known
        import traceback

        traceback.print_exc()
        return False, WorkerFaultError(f"{type(error).__name__}: {error}")


def _end_with_parent(parent: int, *, every: float = 0.5) -> None:
    """End this process when its parent was killed, which is asked for after each `every` [s]."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(every)
        os._exit(1)

    if os.name != "nt":  # there a parent keeps its number when it is gone
        threading.Thread(target=watch, daemon=True).start()
