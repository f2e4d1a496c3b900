"""Run a coroutine from code that is not asynchronous, also inside a running event loop, as in a notebook."""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Coroutine

__all__ = ["run_async"]

Value = TypeVar("Value")


def run_async(work: Coroutine[object, object, Value]) -> Value:
    """Run a coroutine to its end and give its result; in a thread of its own where a loop runs already.

    Examples
    --------
    >>> async def answer() -> int:
    ...     return 42
    >>> run_async(answer())
    42
    """
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return asyncio.run(work)
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, work).result()
