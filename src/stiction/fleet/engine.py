"""Batches of loops on all cores of one machine; a worker that dies costs its batch a retry, one loop at a time."""

from __future__ import annotations

import os
from collections import Counter, deque
from multiprocessing.connection import wait
from typing import TYPE_CHECKING, Protocol

from stiction.errors import ParameterError, require_count
from stiction.fleet.batch import Batch, Outcome, run_batch
from stiction.fleet.loop_row import LoopRow
from stiction.worker_process import WorkerProcess

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

__all__ = ["Engine", "ProcessEngine", "crashed_outcomes", "usable_cores"]

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
    """Worker processes of this machine."""

    def __init__(self, workers: int | None = None) -> None:
        self.workers = require_count("workers", workers if workers is not None else usable_cores())
        self._batches: dict[WorkerProcess, Batch | None] = {}
        """What each worker does."""

    def run(self, batches: Iterable[Batch], go_on: Callable[[], bool]) -> Iterator[list[Outcome]]:
        """Run batches as long as `go_on` is true, and give the outcomes of each as it is done, in any order."""
        waiting, again, deaths, failed_starts = iter(batches), deque[Batch](), Counter[int](), 0
        while True:
            idle = [worker for worker, batch in self._batches.items() if batch is None]
            for _ in range(self.workers - len(self._batches) + len(idle)):
                if not go_on() or (batch := again.popleft() if again else next(waiting, None)) is None:
                    break
                worker = idle.pop() if idle else WorkerProcess()
                self._batches[worker] = batch
                worker.send(run_batch, batch)
            busy = {worker.pipe: (worker, batch) for worker, batch in self._batches.items() if batch is not None}
            if not busy:
                return
            ready = wait(list(busy), timeout=0.5)  # Windows does not see Ctrl-C in a longer wait
            for worker, batch in [busy[pipe] for pipe in busy if pipe in ready]:
                outcomes = None
                try:
                    if (answer := worker.receive()) is not None:
                        [outcomes], self._batches[worker] = answer, None
                except (EOFError, OSError):  # the worker is dead
                    self._end(worker)
                    failed_starts += not worker.is_ready
                    if failed_starts > MAX_FAILED_STARTS:
                        raise ParameterError(
                            f"workers = {self.workers} cannot be started; give fewer, or free some memory. In a "
                            'script, call audit below `if __name__ == "__main__":`; the workers import the script.'
                        ) from None
                    number = batch.tasks[0].number
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
        for worker in list(self._batches):
            self._end(worker)

    def _end(self, worker: WorkerProcess) -> None:
        worker.kill()
        del self._batches[worker]


def crashed_outcomes(batch: Batch) -> list[Outcome]:
    """Outcomes of loops that ended their worker."""
    reason = "The loop ended its worker twice (out of memory, or ten times its time limit); shorten the record."
    rows = [LoopRow.of_place(task.place, status="crashed", reason=reason) for task in batch.tasks]
    return [Outcome(task.number, row, 0.0) for task, row in zip(batch.tasks, rows, strict=True)]


def usable_cores() -> int:
    """Cores of this machine that this process may use [-]."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
