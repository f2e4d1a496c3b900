"""Worker processes: they read, diagnose and simulate, so that the server answers at once and stays small."""

from __future__ import annotations

import asyncio
import os
import sys
from functools import partial
from typing import TYPE_CHECKING, Any

from stiction.worker_process import TimeLimitError, WorkerLostError, WorkerProcess

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Sequence

__all__ = ["WorkerPool", "Workers"]

BACKGROUND_NICENESS = 5
"""How far the processes for long work give way to the page [-]."""
WARM_LIMIT_S = 600.0
"""Longest time of a step that warms a process [s]."""
TIME_LIMIT_S = 60.0
"""Longest time of a call when the caller names none [s]."""


class _Worker:
    """A worker process that is started again when it has ended."""

    def __init__(self, niceness: int) -> None:
        self._niceness = niceness
        self._process: WorkerProcess | None = None

    def start(self) -> WorkerProcess:
        """Start the process, if it does not run."""
        if self._process is None or not self._process.is_alive:
            self._process = WorkerProcess(self._niceness)
        return self._process

    def stop(self) -> None:
        """End the process at once."""
        if self._process is not None:
            self._process.kill()

    def run(self, limit_s: float, function: Callable[..., Any], *arguments: Any) -> Any:
        """Run a function of a module in the process and return what it returns."""
        process = self.start()
        process.send(function, *arguments)
        return process.wait(limit_s)


class WorkerPool:
    """Some worker processes; a call goes to a free one, the one that was used last, whose caches are filled.

    `warm_steps` are called in each process, so that imports and compilation are done before a user waits for them.
    """

    def __init__(self, count: int, warm_steps: Sequence[Callable[[], object]] = (), niceness: int = 0) -> None:
        self._all = [_Worker(niceness) for _ in range(count)]
        self._warm_steps = warm_steps
        self._free: list[_Worker] = []
        self._freed = asyncio.Condition()
        self._waiting = 0
        self._tasks: set[asyncio.Task[Any]] = set()

    @property
    def count(self) -> int:
        """Number of processes."""
        return len(self._all)

    def start(self, ready: asyncio.Event) -> None:
        """Start the first process; when `ready` is set, warm the others, then the first one between its calls."""
        self._keep(asyncio.create_task(self._start(ready)))

    async def _start(self, ready: asyncio.Event) -> None:
        first, *others = self._all
        await asyncio.to_thread(first.start)
        await self._give_back(first)
        await ready.wait()
        for worker in others:
            for step in self._warm_steps:
                await self._warm(worker, step)
            await self._give_back(worker)
        for step in self._warm_steps:
            await self._take_idle(first)
            await self._warm(first, step)
            await self._give_back(first)

    @staticmethod
    async def _warm(worker: _Worker, step: Callable[[], object]) -> None:
        try:
            await asyncio.to_thread(worker.run, WARM_LIMIT_S, step)
        except (WorkerLostError, TimeLimitError) as error:
            print(f"stiction: a worker process could not be prepared: {error}", file=sys.stderr)

    async def _take(self) -> _Worker:
        """Wait until a worker is free, and take it."""
        self._waiting += 1
        try:
            async with self._freed:
                await self._freed.wait_for(lambda: self._free)
                return self._free.pop()
        finally:
            self._waiting -= 1

    async def _take_idle(self, worker: _Worker) -> None:
        """Wait until a worker is free and no call waits, and take it."""
        async with self._freed:
            await self._freed.wait_for(lambda: worker in self._free and not self._waiting)
            self._free.remove(worker)

    async def _give_back(self, worker: _Worker) -> None:
        async with self._freed:
            self._free.append(worker)
            self._freed.notify_all()

    def stop(self) -> None:
        """End all processes at once."""
        for task in self._tasks:
            task.cancel()
        for worker in self._all:
            worker.stop()

    async def call(self, function: Callable[..., Any], *arguments: Any, limit_s: float = TIME_LIMIT_S) -> Any:
        """Run a function of a module, with arguments that can be pickled, in a worker process.

        A caller that is cancelled leaves the call running: its worker is free again when it has ended.
        """
        return await asyncio.shield(self._keep(asyncio.create_task(self._call(function, arguments, limit_s))))

    async def _call(self, function: Callable[..., Any], arguments: tuple[Any, ...], limit_s: float) -> Any:
        worker = await self._take()
        try:
            return await asyncio.to_thread(worker.run, limit_s, function, *arguments)
        finally:
            await self._give_back(worker)

    def _keep(self, task: asyncio.Task[Any]) -> asyncio.Task[Any]:
        """Hold a reference to a task until it ends, and read its exception."""
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        task.add_done_callback(lambda one: one.cancelled() or one.exception())
        return task


class Workers:
    """The two pools of the server: quick answers, and long work.

    Parameters
    ----------
    audits : sequence of str
        Folders of audits that each worker opens before it is asked for them.
    """

    def __init__(self, audits: Sequence[str] = ()) -> None:
        from stiction.apps.web.warm import open_audits, warm_page, warm_reading, warm_simulation

        opening = [partial(open_audits, audits)] if audits else []
        self.quick = WorkerPool(2, [*opening, warm_simulation])
        """Simulations, zooms and tables: at most some 50 ms each."""
        count = max(1, (os.cpu_count() or 2) - 1)
        self.background = WorkerPool(count, [*opening, warm_reading, warm_page], BACKGROUND_NICENESS)
        """Reading, diagnoses, limit cycles: seconds each."""

    def start(self, first: Sequence[Coroutine[Any, Any, None]] = ()) -> None:
        """Start the first process of each pool, and the rest when the work of `first` is done."""
        ready = asyncio.Event()
        self.quick.start(ready)
        self.background.start(ready)
        self._first = asyncio.create_task(self._run_first(first, ready))

    @staticmethod
    async def _run_first(first: Sequence[Coroutine[Any, Any, None]], ready: asyncio.Event) -> None:
        try:
            await asyncio.gather(*first, return_exceptions=True)
        finally:
            ready.set()

    def stop(self) -> None:
        """End all processes."""
        self._first.cancel()
        self.quick.stop()
        self.background.stop()
