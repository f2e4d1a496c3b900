"""Worker processes: results, errors, time limits, and processes that end."""

from __future__ import annotations

import asyncio
import operator
import os
import time
from functools import partial

import pytest

from apps.web.running import run_apart
from stiction.apps.web.workers import WorkerPool
from stiction.errors import ParameterError, require_positive
from stiction.worker_process import TimeLimitError, WorkerLostError


def run(work, count: int = 1):
    """Run a coroutine with a pool of warm processes."""

    async def inside():
        pool = WorkerPool(count, [os.getpid])
        ready = asyncio.Event()
        ready.set()
        pool.start(ready)
        try:
            return await work(pool)
        finally:
            pool.stop()

    return run_apart(inside())


def test_calls_run_in_other_processes():
    async def work(pool):
        return [await pool.call(os.getpid), await pool.call(operator.add, 2, 3)]

    process, five = run(work)
    assert process != os.getpid()
    assert five == 5


def test_our_errors_come_back_as_they_are():
    with pytest.raises(ParameterError, match="dt = -1 s is not positive"):
        run(lambda pool: pool.call(require_positive, "dt", -1.0, "s"))


def test_a_call_that_takes_too_long_is_ended_and_the_next_one_runs():
    async def work(pool):
        began = time.monotonic()
        with pytest.raises(TimeLimitError, match="more than"):
            await pool.call(time.sleep, 60.0, limit_s=0.5)
        assert time.monotonic() - began < 20
        return await pool.call(operator.add, 1, 1)

    assert run(work) == 2


def test_ended_process_is_reported_and_started_again():
    async def work(pool):
        with pytest.raises(WorkerLostError, match="started again"):
            await pool.call(os._exit, 1)
        return await pool.call(operator.add, 1, 1)

    assert run(work) == 2


def test_a_caller_that_gives_up_does_not_mix_up_the_answers():
    async def work(pool):
        slow = asyncio.create_task(pool.call(time.sleep, 0.5))
        await asyncio.sleep(0.2)
        slow.cancel()
        return [await pool.call(operator.add, k, k) for k in range(3)]

    assert run(work) == [0, 2, 4]


def test_calls_share_the_processes():
    async def work(pool):
        await asyncio.gather(*(pool.call(time.sleep, 0.0) for _ in range(4)))
        began = time.monotonic()
        await asyncio.gather(*(pool.call(time.sleep, 1.0) for _ in range(2)))
        return time.monotonic() - began

    assert run(work, count=2) < 1.9


def test_the_process_that_was_used_last_is_used_again():
    """What it holds in memory, such as an open audit, is there for the next call."""

    async def work(pool):
        await asyncio.gather(*(pool.call(time.sleep, 0.2) for _ in range(3)))
        return {await pool.call(os.getpid) for _ in range(6)}

    assert len(run(work, count=3)) == 1


def test_calls_go_between_the_steps_that_warm_a_process():
    async def inside():
        pool, ready = WorkerPool(1, [partial(time.sleep, 1.0)] * 5), asyncio.Event()
        ready.set()
        pool.start(ready)
        began = time.monotonic()
        try:
            await pool.call(os.getpid)
            await asyncio.sleep(0.2)
            await pool.call(os.getpid)
        finally:
            pool.stop()
        return time.monotonic() - began

    assert run_apart(inside()) < 4.5
