"""How much memory the reading of a loop may take, and how many rows fit into it."""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING

from stiction.errors import ParameterError, RecordError, Setting
from stiction.scratch import environment_variable

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

__all__ = ["memory_limit", "parse_memory", "require_memory", "rows_that_fit", "shared_memory"]

CELL_BYTES = 50
"""Memory of one cell of a loop while its record is made, of the time too [bytes]."""
BASE_BYTES = 300_000_000
"""Memory of the program itself [bytes]."""
COPIES = 3
"""Times that the data of a file that is read whole are in the memory at once [-]."""
LIMIT_VARIABLE = "STICTION_MAX_MEMORY"
"""Environment variable with the share of one worker [bytes]."""
UNITS = {"": 1, "K": 10**3, "M": 10**6, "G": 10**9, "T": 10**12}


def parse_memory(given: str | float) -> int:
    """Parse an amount of memory [bytes]; raises ParameterError when it is less than the program itself needs, or none.

    >>> parse_memory("2GB"), parse_memory(5e8)
    (2000000000, 500000000)
    """
    found = re.fullmatch(r"(\d+(?:\.\d*)?(?:e\d+)?) ?([KMGT]?)i?B?", str(given).strip(), re.IGNORECASE)
    size = int(float(found[1]) * UNITS[found[2].upper()]) if found else 0
    if size <= BASE_BYTES:
        problem = f" = {given!r} is not an amount above {BASE_BYTES / 1e9:g} GB"
        raise ParameterError(Setting("max_memory"), problem, remedy="give it as 2GB")
    return size


def memory_limit(given: int | None) -> int:
    """Memory that reading may take [bytes]: as given, else the share of this worker, else half of the machine."""
    if given is not None:
        return given
    if share := os.environ.get(LIMIT_VARIABLE):
        return int(share)
    if hasattr(os, "sysconf"):
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
    return 4 * 10**9


def rows_that_fit(limit: int, columns: int) -> int:
    """Rows of a loop with so many columns, the time among them, that fit into some memory."""
    return max(1000, (limit - BASE_BYTES) // (CELL_BYTES * max(1, columns)))


def require_memory(size: int, given: int | None, where: str) -> None:
    """Refuse a file whose `size` bytes of data are read at once, where they do not fit into the memory."""
    limit, size = memory_limit(given), COPIES * size
    if BASE_BYTES + size > limit:
        raise RecordError(
            f"takes {size / 1e9:.3g} GB of memory, as it is read whole; {limit / 1e9:.3g} GB are allowed",
            remedy=("save it as Parquet, which is read loop by loop, or allow more with ", Setting("max_memory")),
            where=where,
        )


def shared_memory(given: str | float | None, workers: int) -> AbstractContextManager[None]:
    """Give each of the worker processes that are started within this context its share of the memory."""
    share = memory_limit(None if given is None else parse_memory(given)) // workers
    return environment_variable(LIMIT_VARIABLE, f"{max(share, BASE_BYTES + 1)}")
