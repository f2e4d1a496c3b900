"""Batches of loops on all cores of one machine; a worker that dies costs its batch a retry, one loop at a time."""

from __future__ import annotations

import os
from collections import Counter, deque
from multiprocessing.connection import wait
from typing import TYPE_CHECKING, Protocol

from stiction.errors import ParameterError, require_count
from stiction.fleet.batch import Batch, Outcome, failed_row
from stiction.fleet.worker_process import WorkerProcess

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

__all__ = ["Engine", "ProcessEngine", "crashed_outcomes"]

MAX_SINGLE_TRIES = 2
"""Times that a loop may end its worker when it is alone in it [-]."""
MAX_FAILED_STARTS = 3
"""Workers that may die while they start before one gives a result [-]."""


class Engine(Protocol):
    """What runs batches."""

    workers: int
    """Worker processes [-]."""

    def run(self, batches: Iterable[Batch], go_on: Callable[[], bool]) -> Iterator[list[Outcome]]:
        """Run batches as long as `go_on` is true, and give the outcomes of each as it is done, in any order."""
        ...

    def close(self) -> None:
        """End all workers."""
        ...


class ProcessEngine:
    """Worker processes of this machine, each with a pipe of its own.

    A pool whose workers share one pipe, as that of joblib, waits forever when a worker is killed while it sends a
    result.
    """

    def __init__(self, workers: int | None = None) -> None:
        self.workers = require_count("workers", workers if workers is not None else _cores())
        self._started: list[WorkerProcess] = []

    def run(self, batches: Iterable[Batch], go_on: Callable[[], bool]) -> Iterator[list[Outcome]]:
        """Run batches as long as `go_on` is true, and give the outcomes of each as it is done, in any order."""
        waiting, again, deaths, failed_starts = iter(batches), deque[Batch](), Counter[int](), 0
        while True:
            idle = [worker for worker in self._started if worker.batch is None]
            for _ in range(self.workers - len(self._started) + len(idle)):
                if not go_on() or (batch := again.popleft() if again else next(waiting, None)) is None:
                    break
                (idle.pop() if idle else self._start()).send(batch)
            busy = {one.pipe: (one, one.batch) for one in self._started if one.batch is not None}
            if not busy:
                return
            ready = wait(list(busy), timeout=0.5)  # Windows does not see Ctrl-C in a longer wait
            for worker, batch in [busy[pipe] for pipe in busy if pipe in ready]:
                try:
                    outcomes = worker.receive()
                except (EOFError, OSError):  # the worker is dead
                    self._end(worker)
                    outcomes, number = None, batch.tasks[0].number
                    failed_starts += not worker.is_ready
                    if failed_starts > MAX_FAILED_STARTS:
                        text = f"workers = {self.workers} cannot be started; give fewer, or free some memory."
                        raise ParameterError(text) from None
                    deaths[number] += worker.is_ready and len(batch.tasks) == 1
                    if deaths[number] < MAX_SINGLE_TRIES:
                        again.extend(batch.split() if worker.is_ready else [batch])
                    else:
                        outcomes = crashed_outcomes(batch)
                if outcomes is not None:
                    failed_starts = 0
                    yield outcomes

    def close(self) -> None:
        """End all workers at once."""
        while self._started:
            self._end(self._started[-1])

    def _start(self) -> WorkerProcess:
        worker = WorkerProcess()
        self._started.append(worker)
        return worker

    def _end(self, worker: WorkerProcess) -> None:
        worker.kill()
        self._started.remove(worker)


def crashed_outcomes(batch: Batch) -> list[Outcome]:
    """Outcomes of loops that ended their worker."""
    reason = "The loop ended its worker twice (out of memory, or ten times its time limit); shorten the record."
    return [Outcome(task.number, failed_row(task.place, "crashed", reason), 0.0) for task in batch.tasks]


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
