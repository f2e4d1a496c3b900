"""The one place that touches numba: `kernel` compiles a step or a driver, with a disk cache that cannot go stale.

Numba notices an edit of the file that holds a cached function, but not an edit of the functions it calls
in other files. The cache folder therefore carries a digest of every page that holds kernels: an edit moves
all kernels to a new folder. Where nothing can be written the kernels are compiled anew in each process. Compiling takes
up to a minute in all; that it begins is told to the logger `stiction`, once in a process.
"""

from __future__ import annotations

import hashlib
import logging
import os
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import config as numba_config
from numba.core.event import Event, Listener, register

__all__ = ["cache_folder", "fused", "inlined", "kernel", "summing"]

Function = TypeVar("Function", bound=Callable[..., Any])

_PACKAGE = Path(__file__).resolve().parents[1]
_MARK = b"models.compiled import"
ONCE = "compiling its kernels, which takes up to a minute; they are kept, and later runs start at once."
EACH_TIME = (
    "compiling its kernels, which takes up to a minute in every run, since no folder can be written to keep them; "
    "set NUMBA_CACHE_DIR to one that can."
)
"""What the logger is told at INFO when a kernel is not found compiled; the second where none can be kept."""


class _Told(Listener):
    """Tells the logger when the first kernel of this package is compiled."""

    told = False

    def on_start(self, event: Event) -> None:
        """Called by numba before it compiles a function."""
        data = event.data
        if not self.told and data is not None and data["dispatcher"].py_func.__module__.startswith("stiction."):
            self.told = True
            logging.getLogger("stiction").info(EACH_TIME if cache_folder() is None else ONCE)

    def on_end(self, event: Event) -> None:
        """Called by numba when it has compiled the function."""


@cache
def pages_digest() -> str:
    """Digest of all pages that hold kernels, of numba's version and of nothing else."""
    digest = hashlib.sha256(numba.__version__.encode())
    for page in sorted(_PACKAGE.rglob("*.py")):
        text = page.read_bytes()
        if _MARK in text or page.name in ("compiled.py", "component.py"):
            digest.update(page.relative_to(_PACKAGE).as_posix().encode())
            digest.update(text)
    return digest.hexdigest()[:16]


@cache
def cache_folder() -> Path | None:
    """Folder of the compiled kernels, or None where nothing can be written.

    ``NUMBA_CACHE_DIR`` is honoured, then ``XDG_CACHE_HOME``, then the user's own cache folder.
    """
    named = os.environ.get("NUMBA_CACHE_DIR")
    try:
        root = Path(named) if named else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "stiction"
        folder = root / f"kernels-{pages_digest()}"
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".probe-{os.getpid()}"
        probe.touch()
        probe.unlink()
    except (OSError, RuntimeError):
        return None
    return folder


def kernel(function: Function) -> Function:
    """Compile `function` on first call: no GIL, no fastmath, cached on disk where that is possible.

    Set ``NUMBA_DISABLE_JIT=1`` to run the same source as plain Python.
    """
    return _compiled(function, inline=False)


def inlined(function: Function) -> Function:
    """Compile `function` into the kernels that call it: for steps, so that their state stays in registers."""
    return _compiled(function, inline=True)


def summing(function: Function) -> Function:
    """Compile a kernel of sums whose order does not matter, so that each sum is taken in several lanes at once.

    The sums then differ in the last digits from one kind of processor to another: not for models and their runs.
    """
    return _compiled(function, inline=False, fastmath={"reassoc", "contract", "nsz"})


def fused(function: Function) -> Function:
    """Compile a kernel that may round a product and the sum it goes into once, sums in the order in which they stand.

    Between `kernel` and `summing`: what is taken off value by value comes out as there, however many at once.
    """
    return _compiled(function, inline=False, fastmath={"contract", "nsz"})


def _compiled(function: Function, *, inline: bool, fastmath: set[str] | bool = False) -> Function:
    njit: Any = partial(numba.njit, nogil=True, forceinline=inline, fastmath=fastmath)
    config: Any = numba_config
    folder = cache_folder()
    if folder is None:
        return cast("Function", njit()(function))
    before = config.CACHE_DIR
    config.CACHE_DIR = str(folder)
    try:
        return cast("Function", njit(cache=True)(function))
    finally:
        config.CACHE_DIR = before


_TOLD = _Told()
register("numba:compile", _TOLD)
