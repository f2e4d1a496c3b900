"""The one place that touches numba: `kernel` compiles a step or a driver, with a disk cache that cannot go stale.

Numba notices an edit of the file that holds a cached function, but not an edit of the functions it calls
in other files. The cache folder therefore carries a digest of every page that holds kernels: an edit moves
all kernels to a new folder. If no folder is writable, each process compiles the kernels again. Compiling takes up to a
minute in all. The logger `stiction` reports its start, once in a process.
"""

from __future__ import annotations

import hashlib
import logging
import os
from collections.abc import Callable
from functools import cache, cached_property
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import config as numba_config
from numba.core.caching import FunctionCache, NullCache
from numba.core.dispatcher import Dispatcher
from numba.core.event import Event, Listener, register
from numba.core.runtime.nrt import rtsys

__all__ = ["cache_folder", "inline_kernel", "kernel"]

Function = TypeVar("Function", bound=Callable[..., Any])

_PACKAGE = Path(__file__).resolve().parents[1]
_KERNEL_IMPORT = b"models.numba_compile import"
COMPILE_ONCE_TEXT = "compiling its kernels, which takes up to a minute; they are stored, and later runs start at once."
"""Log message of the first compilation, with a cache folder."""
COMPILE_EVERY_RUN_TEXT = (
    "compiling its kernels, which takes up to a minute in every run, because no cache folder is writable; "
    "set NUMBA_CACHE_DIR to a folder that is."
)
"""Log message of the first compilation, without a cache folder."""


class _CompileListener(Listener):
    """Logs the first compilation of a kernel of this package."""

    has_logged = False

    def on_start(self, event: Event) -> None:
        """Called by numba before it compiles a function."""
        data = event.data
        if not self.has_logged and data is not None and data["dispatcher"].py_func.__module__.startswith("stiction."):
            self.has_logged = True
            logging.getLogger("stiction").info(COMPILE_EVERY_RUN_TEXT if cache_folder() is None else COMPILE_ONCE_TEXT)

    def on_end(self, event: Event) -> None:
        """Called by numba when it has compiled the function."""


class _KernelCache(NullCache):
    """Numba's disk cache of one kernel, without the preparation for compiling.

    Before it loads a stored kernel numba imports and registers every function that a kernel may call. That takes
    longer than a diagnosis, and only compiling needs it and does it again.
    """

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        self._function = function
        self._folder = folder

    @cached_property
    def _stored(self) -> Any:
        """Opened at the first call: most imported kernels are not called."""
        config: Any = numba_config
        before = config.CACHE_DIR
        config.CACHE_DIR = str(self._folder)
        try:
            return FunctionCache(self._function)
        finally:
            config.CACHE_DIR = before

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Kernel stored for arguments of the types `sig`, or None."""
        rtsys.initialize(target_context)
        with self._stored._guard_against_spurious_io_errors():
            return self._stored._load_overload(sig, target_context)

    def save_overload(self, sig: Any, cres: Any) -> None:
        """Store the compiled kernel `cres` for arguments of the types `sig`."""
        self._stored.save_overload(sig, cres)


@cache
def pages_digest() -> str:
    """Digest of all pages with kernels and of numba's version."""
    digest = hashlib.sha256(numba.__version__.encode())
    for page in sorted(_PACKAGE.rglob("*.py")):
        text = page.read_bytes()
        if _KERNEL_IMPORT in text or page.name in ("numba_compile.py", "component.py"):
            digest.update(page.relative_to(_PACKAGE).as_posix().encode())
            digest.update(text)
    return digest.hexdigest()[:16]


@cache
def cache_folder() -> Path | None:
    """Folder of the compiled kernels, or None if no folder is writable.

    ``NUMBA_CACHE_DIR`` is honoured, then ``XDG_CACHE_HOME``, then the user's own cache folder.
    """
    configured = os.environ.get("NUMBA_CACHE_DIR")
    try:
        root = (
            Path(configured)
            if configured
            else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "stiction"
        )
        folder = root / f"kernels-{pages_digest()}"
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".probe-{os.getpid()}"
        probe.touch()
        probe.unlink()
    except (OSError, RuntimeError):
        return None
    return folder


def kernel(function: Function) -> Function:
    """Compile `function` on first call: no GIL, no fastmath, cached on disk if a folder is writable.

    A division by zero gives infinity or NaN, as in C; it raises nothing.

    Set ``NUMBA_DISABLE_JIT=1`` to run the same source as plain Python.
    """
    return _compile(function, inline=False)


def inline_kernel(function: Function) -> Function:
    """Compile `function` into the kernels that call it. Use it for steps: their state then stays in registers."""
    return _compile(function, inline=True)


def _compile(function: Function, *, inline: bool) -> Function:
    njit: Any = numba.njit(nogil=True, error_model="numpy", forceinline=inline)
    compiled: Any = njit(function)
    folder = cache_folder()
    if folder is not None and isinstance(compiled, Dispatcher):
        compiled._cache = _KernelCache(function, folder)  # pyright: ignore[reportAttributeAccessIssue]
    return cast("Function", compiled)


_LISTENER = _CompileListener()
register("numba:compile", _LISTENER)
