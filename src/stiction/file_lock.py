"""A lock of an open file; it is free again when the file is closed or its process ends."""

from __future__ import annotations

import os
from typing import IO, Any

__all__ = ["lock_file"]

FAR = 1 << 20
"""Byte that is locked on Windows: away from the text, which others may then read."""


def lock_file(file: IO[Any], *, wait: bool) -> None:
    """Lock an open file for this process alone.

    Raises
    ------
    OSError
        When another process has the lock, and `wait` is false.
    """
    if os.name == "nt":
        import msvcrt

        place = file.tell()
        file.seek(FAR)
        msvcrt.locking(file.fileno(), msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1)  # pyright: ignore[reportAttributeAccessIssue]
        file.seek(place)
    else:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
