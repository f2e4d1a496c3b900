"""A batch of loops in a worker: each with a time limit, each failure a row."""

from __future__ import annotations

import os
import signal
import threading
import time
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from stiction.fleet.loop_row import LoopRow
from stiction.fleet.loop_work import WorkSettings, diagnose_loop, screen_loop
from stiction.foreign_errors import failure_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stiction.diagnosis.evidence.further import StoredWindow
    from stiction.fleet.block_means import BlockMeans
    from stiction.fleet.source_parts import LoopPlace
    from stiction.fleet.stored_windows import KnownWindows

__all__ = ["Batch", "LoopTask", "Outcome", "run_batch"]

MEMORY_EXIT = 4
"""Exit code of a worker that has no memory left."""
KILL_FACTOR = 10.0
"""Time over the limit of a loop after which its process ends itself [-], for what no signal interrupts."""


@dataclass(frozen=True)
class LoopTask:
    """One loop and what to do with it."""

    number: int
    """Number of the loop in the ledger."""
    place: LoopPlace
    """Where it is."""
    screened: LoopRow | None = None
    """Its row of the screen, for the diagnosis; None for the screen."""
    known: KnownWindows | None = None
    """Its windows in the ledger; None where there are none."""


@dataclass(frozen=True)
class Batch:
    """Loops that one worker does in one go."""

    tasks: tuple[LoopTask, ...]
    """The loops."""
    settings: WorkSettings
    """What the work depends on."""
    parent: int = field(default_factory=os.getpid)
    """Process that made the batch."""

    def split(self) -> list[Batch]:
        """One batch for each loop."""
        return [Batch((task,), self.settings, self.parent) for task in self.tasks]


@dataclass(frozen=True)
class Outcome:
    """What came of one loop."""

    number: int
    """Number of the loop in the ledger."""
    row: LoopRow
    """Its row."""
    cpu_s: float
    """Processor time [s]."""
    means: BlockMeans | None = field(default=None, repr=False)
    """Its block means, from the screen."""
    windows: tuple[StoredWindow, ...] = field(default=(), repr=False)
    """Its windows that are new or changed, from the diagnosis."""


class _LoopTimeoutError(Exception):
    """The time limit of a loop is over."""


def run_batch(batch: Batch) -> list[Outcome]:
    """Screen or diagnose each loop of a batch; a loop that fails is a row with the reason."""
    _leave_interrupts_to_parent(batch.parent)
    outcomes = []
    for task in batch.tasks:
        try:
            outcomes.append(_run_task(task, batch.settings))
        except MemoryError:  # what is left of the memory is in pieces: the loop is tried again in a new worker
            if os.getpid() == batch.parent:
                raise
            os._exit(MEMORY_EXIT)
    return outcomes


def _run_task(task: LoopTask, settings: WorkSettings) -> Outcome:
    began = time.process_time()
    means, windows = None, ()
    try:
        with _time_limit(settings.time_limit):
            if task.screened is None:
                row, means = screen_loop(task.place, settings)
            else:
                row, windows = diagnose_loop(task.place, settings, task.screened, task.known)
    except _LoopTimeoutError:
        limit = f"{settings.time_limit:g} s of processor time"
        reason = f"The loop took more than {limit}; raise time_limit, or shorten the record."
        row = LoopRow.of_place(task.place, status="timeout", reason=reason)
    except MemoryError:
        raise
    except BaseException as error:
        row = LoopRow.of_place(task.place, status="error", reason=str(failure_of(error, task.place.tag)))
    return Outcome(task.number, row, time.process_time() - began, means, windows)


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    """Raise `_LoopTimeoutError` after some processor time; end the process when 10 times that has passed."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    watchdog = threading.Timer(KILL_FACTOR * seconds, os._exit, (3,))
    watchdog.daemon = True
    watchdog.start()
    timer = hasattr(signal, "setitimer")

    def expire(*_: object) -> None:
        raise _LoopTimeoutError

    before = signal.signal(signal.SIGPROF, expire) if timer else None
    try:
        if timer:
            signal.setitimer(signal.ITIMER_PROF, seconds)
        yield
    finally:
        if timer:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
            signal.signal(signal.SIGPROF, before)
        watchdog.cancel()


def _leave_interrupts_to_parent(parent: int) -> None:
    """Ignore Ctrl-C in a worker: the parent ends its workers."""
    if os.getpid() != parent and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
