"""Batches of loops on all cores of one machine; a worker that dies costs its batch a retry, one loop at a time."""

from __future__ import annotations

import os
import threading
import time
from concurrent.futures import FIRST_COMPLETED, wait
from typing import TYPE_CHECKING, Protocol

from stiction.errors import ParameterError, require_count
from stiction.fleet.batch import Batch, Outcome, failed_row, run_batch

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from joblib.externals.loky import ProcessPoolExecutor

__all__ = ["Engine", "ProcessEngine", "crashed_outcomes", "end_with_parent", "warm_kernels"]

MAX_SINGLE_TRIES = 2
"""Times that a loop may end its worker when it is alone in it [-]."""


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
    """Worker processes of this machine (loky, from joblib)."""

    def __init__(self, workers: int | None = None) -> None:
        self.workers = require_count("workers", workers if workers is not None else _cores())
        self._pool: ProcessPoolExecutor | None = None

    def run(self, batches: Iterable[Batch], go_on: Callable[[], bool]) -> Iterator[list[Outcome]]:
        """Run batches as long as `go_on` is true, and give the outcomes of each as it is done, in any order."""
        from joblib.externals.loky.process_executor import BrokenProcessPool

        waiting = iter(batches)
        running = {}
        try:
            while True:
                while len(running) <= self.workers and go_on() and (batch := next(waiting, None)) is not None:
                    running[self._submit(batch)] = batch
                if not running:
                    return
                lost = []
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    batch = running.pop(future)
                    try:
                        yield future.result()
                    except BrokenProcessPool:
                        lost.append(batch)
                if lost:
                    lost += running.values()
                    running = {}
                    self.close()
                    for batch in lost:
                        for single in batch.split():
                            yield self._run_alone(single)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End all workers."""
        if self._pool is not None:
            self._pool.shutdown(wait=True, kill_workers=True)
            self._pool = None

    def _submit(self, batch: Batch):
        from joblib.externals.loky.process_executor import BrokenProcessPool

        for _ in range(3):
            try:
                return self._open(self.workers).submit(run_batch, batch)
            except BrokenProcessPool:  # a worker died while none of its batches was running
                self.close()
        raise ParameterError("workers cannot be started; run with fewer of them, and see whether memory is free.")

    def _run_alone(self, single: Batch) -> list[Outcome]:
        """Run one loop in a worker of its own."""
        from joblib.externals.loky.process_executor import BrokenProcessPool

        for _ in range(MAX_SINGLE_TRIES):
            try:
                return self._open(self.workers).submit(run_batch, single).result()
            except BrokenProcessPool:
                self.close()
        return crashed_outcomes(single)

    def _open(self, workers: int) -> ProcessPoolExecutor:
        from joblib.externals.loky import ProcessPoolExecutor

        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                workers, timeout=300, env=ONE_THREAD, initializer=end_with_parent, initargs=(os.getpid(),)
            )
        return self._pool


def end_with_parent(parent: int, *, every: float = 0.5) -> None:
    """End this process when its parent was killed, which is asked for after each `every` [s]."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(every)
        os._exit(1)

    if os.name != "nt":  # there a parent keeps its number when it is gone, and idle workers end by their timeout
        threading.Thread(target=watch, daemon=True).start()


ONE_THREAD = dict.fromkeys(
    (
        *("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "POLARS_MAX_THREADS"),
        "VECLIB_MAXIMUM_THREADS",
    ),
    "1",
)
"""Environment of the workers: the loops are the parallel work."""


def crashed_outcomes(batch: Batch) -> list[Outcome]:
    """Outcomes of loops that ended their worker."""
    reason = "The loop ended its worker twice (out of memory, or ten times its time limit); shorten the record."
    return [Outcome(task.number, failed_row(task.place, "crashed", reason), 0.0) for task in batch.tasks]


def warm_kernels() -> None:
    """Compile all kernels once, so that the workers find them in the cache on disk."""
    from stiction.diagnosis import diagnose
    from stiction.fleet.block_means import common_clock, make_block_means
    from stiction.fleet.loop_oscillations import find_loop_oscillations
    from stiction.models import FOPDT, PID, Kano, Loop
    from stiction.simulation import simulate

    loop = Loop(PID(0.2, 10.0), Kano(5.0, 2.0), FOPDT(3.0, 10.0, 10.0), dt=1.0)
    record = simulate(loop, sp=10.0, duration=1000.0, loop_type="flow")
    diagnose(record)
    find_loop_oscillations(make_block_means(record, common_clock([record])))


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
