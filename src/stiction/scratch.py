"""Where temporary files go: one folder for each run of the program and its workers, deleted when the run ends."""

from __future__ import annotations

import atexit
import json
import os
from collections.abc import Callable
from contextlib import contextmanager, suppress
from pathlib import Path
from shutil import rmtree
from tempfile import gettempdir, mkdtemp
from typing import IO, TYPE_CHECKING, Any
from weakref import finalize

from stiction.file_lock import lock_file

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = [
    "ScratchFolder",
    "environment_variable",
    "inflated_once",
    "leave_run",
    "remove_abandoned",
    "run_folder",
    "shared_copies",
]

PREFIX = "stiction-run-"
OWNER_LOCK, MEMBERS = "owner.lock", "members.json"
RUN_VARIABLE = "STICTION_RUN_FOLDER"
"""Environment variable by which workers find the folder of their run."""
SHARED_VARIABLE = "STICTION_SHARED_COPIES"
"""Environment variable by which workers find the copies of compressed files that they share."""

Members = list[tuple[str, Path]]
Inflate = Callable[[Callable[[], Path]], Members | None]


def run_folder() -> Path:
    """Folder of this run, made when it is first needed; in a worker that of its parent."""
    known = os.environ.get(RUN_VARIABLE)
    if known and os.path.isdir(known):
        return Path(known)
    remove_abandoned()
    folder = Path(mkdtemp(prefix=PREFIX))
    owner = (folder / OWNER_LOCK).open("w", encoding="utf-8")
    with suppress(OSError):  # a file system without locks: then nobody else removes the folder
        lock_file(owner, wait=False)
    os.environ[RUN_VARIABLE] = str(folder)
    atexit.register(_remove_own, folder, os.getpid(), owner)
    return folder


def leave_run() -> None:
    """Do not use the folders of another run: this process was started by it, but is no worker of it."""
    for name in (RUN_VARIABLE, SHARED_VARIABLE):
        os.environ.pop(name, None)


def remove_abandoned() -> None:
    """Delete the folders of runs that were killed: those whose lock is free."""
    for path in Path(gettempdir()).glob(f"{PREFIX}*"):
        with suppress(OSError):
            if path.is_symlink() or (hasattr(os, "getuid") and path.stat().st_uid != os.getuid()):
                continue
            with (path / OWNER_LOCK).open("r+", encoding="utf-8") as owner:
                lock_file(owner, wait=False)
                rmtree(path, ignore_errors=True)


def _remove_own(folder: Path, process: int, owner: IO[str]) -> None:
    if os.getpid() == process:  # not in a fork of it
        rmtree(folder, ignore_errors=True)
        owner.close()
        rmtree(folder, ignore_errors=True)  # Windows deletes no open file


def _remove_of_dead_workers() -> None:
    """Delete the folders of workers that were ended."""
    for path in run_folder().glob("*-*") if os.name != "nt" else ():
        process = path.name.partition("-")[0]
        if process.isdigit():
            try:
                os.kill(int(process), 0)
            except ProcessLookupError:
                rmtree(path, ignore_errors=True)
            except OSError:
                continue


class ScratchFolder:
    """A temporary folder, made when it is first needed and deleted with this object."""

    def __init__(self) -> None:
        self._delete: finalize[Any, Any] | None = None
        self._path = Path()

    def path(self) -> Path:
        """Give the folder."""
        if self._delete is None or not self._delete.alive:
            _remove_of_dead_workers()
            self._path = Path(mkdtemp(prefix=f"{os.getpid()}-", dir=run_folder()))
            self._delete = finalize(self, rmtree, self._path, ignore_errors=True)
        return self._path

    def delete(self) -> None:
        """Delete the folder and its files."""
        if self._delete is not None:
            self._delete()


@contextmanager
def environment_variable(name: str, value: str) -> Iterator[None]:
    """Set a variable of this process and of those that it starts, and restore what it was."""
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        if before is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = before


@contextmanager
def shared_copies() -> Iterator[None]:
    """Let this process and the workers that it starts decompress each file once."""
    folder = mkdtemp(prefix="copies-", dir=run_folder())
    try:
        with environment_variable(SHARED_VARIABLE, folder):
            yield
    finally:
        rmtree(folder, ignore_errors=True)


def inflated_once(
    path: Path, make: Callable[[Callable[[], Path]], Members | None], scratch: ScratchFolder
) -> Members | None:
    """Give the files that a compressed file holds, as a process of `shared_copies` has written them, or write them.

    Parameters
    ----------
    path : Path
        The compressed file.
    make : callable
        Writes the files into the folder that its argument gives; None where the file is not compressed.
    scratch : ScratchFolder
        Where they are written when copies are not shared.
    """
    root = os.environ.get(SHARED_VARIABLE, "")
    if not os.path.isdir(root):
        return make(scratch.path)
    stat = path.stat()
    place = Path(root, f"{stat.st_dev:x}-{stat.st_ino:x}-{stat.st_size:x}-{stat.st_mtime_ns:x}")
    if not place.is_dir():
        own = ScratchFolder()
        if (found := make(own.path)) is None:
            return None
        names = [[name, file.name] for name, file in found]
        (own.path() / MEMBERS).write_text(json.dumps(names), encoding="utf-8")
        with suppress(OSError):  # another process was first
            own.path().rename(place)
        own.delete()
    names = json.loads((place / MEMBERS).read_text(encoding="utf-8"))
    return [(name, place / file) for name, file in names]
