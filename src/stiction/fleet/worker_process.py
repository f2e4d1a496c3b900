"""A worker process of an audit, and the pipe to it."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from stiction.fleet.batch import Batch, Outcome, run_batch

if TYPE_CHECKING:
    from collections.abc import Iterator
    from multiprocessing.connection import Connection

__all__ = ["ONE_THREAD", "WorkerProcess", "end_with_parent"]

ONE_THREAD: dict[str, str] = dict.fromkeys(
    (
        *("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "POLARS_MAX_THREADS"),
        "VECLIB_MAXIMUM_THREADS",
    ),
    "1",
)
"""Environment of the workers: the loops are the parallel work."""


class WorkerProcess:
    """One worker process, the pipe to it, and the batch that it has."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.batch: Batch | None = None
        self.is_ready = False
        """Whether it has begun to take batches."""
        self.pipe, end = context.Pipe()
        self._process = context.Process(target=_work, args=(end, os.getpid()), daemon=True)
        with _environment_of_workers(), end:
            self._process.start()

    def send(self, batch: Batch) -> None:
        """Give the worker a batch; that it is dead shows when its outcomes are received."""
        self.batch = batch
        with suppress(OSError):
            self.pipe.send((run_batch, batch))

    def receive(self) -> list[Outcome] | None:
        """Outcomes of the batch; None from a worker that is ready for it. An `EOFError` or `OSError` of a dead one."""
        outcomes: list[Outcome] | None = self.pipe.recv()
        self.is_ready = True
        if outcomes is not None:
            self.batch = None
        return outcomes

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


def _work(pipe: Connection, parent: int) -> None:
    """Run batches until the parent closes the pipe."""
    end_with_parent(parent)
    pipe.send(None)
    while True:
        try:
            run, batch = pipe.recv()
        except (EOFError, OSError):
            return
        pipe.send(run(batch))


def end_with_parent(parent: int, *, every: float = 0.5) -> None:
    """End this process when its parent was killed, which is asked for after each `every` [s]."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(every)
        os._exit(1)

    if os.name != "nt":  # there a parent keeps its number when it is gone
        threading.Thread(target=watch, daemon=True).start()
