"""Audits whose loops are done in the process of the test: no worker process has to start."""

from __future__ import annotations

from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from stiction.fleet.batch import Batch, Outcome


class InProcessEngine:
    """Runs each batch where it is called; a time limit that ends the process would end the tests."""

    def __init__(self, workers: int | None = None) -> None:
        self.workers = workers or 1

    def run(self, batches: Iterable[Batch], go_on: Callable[[], bool]) -> Iterator[list[Outcome]]:
        from stiction.fleet.batch import run_batch

        waiting = iter(batches)
        while go_on() and (batch := next(waiting, None)) is not None:
            yield run_batch(batch)

    def close(self) -> None:
        """Nothing is to be ended."""


@cache
def warm_kernels_once(samples: int, dt: float) -> tuple[float, float]:
    from stiction.fleet.warm_up import warm_kernels

    return warm_kernels(samples, dt)


@contextmanager
def audits_in_this_process() -> Iterator[None]:
    """Do the loops of audits in this process, and time the kernels once."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("stiction.fleet.audit_stages.ProcessEngine", InProcessEngine)
        patch.setattr("stiction.fleet.audit_stages.warm_kernels", warm_kernels_once)
        yield
