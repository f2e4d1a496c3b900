"""Write a file completely or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
from pathlib import Path

from stiction.errors import RecordError

__all__ = ["write_atomically"]


def write_atomically(text: str, path: str | os.PathLike[str]) -> Path:
    """Write `text` as UTF-8 to `path`: a reader sees the old file or the new one, never a part.

    Parameters
    ----------
    text : str
        Content.
    path : path-like
        File to write; its folder must exist.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    RecordError
        When the folder is missing or cannot be written to; nothing is left behind.
    """
    target = Path(path)
    if not target.parent.is_dir():
        raise RecordError(f"Cannot write {target}: there is no folder {target.parent}; create it or choose another.")
    if target.is_dir():
        raise RecordError(f"Cannot write {target}: it is a folder; give the name of a file, such as report.html.")
    draft = target.with_name(f".{target.name}.{secrets.token_hex(4)}.part")
    try:
        with draft.open("x", encoding="utf-8", newline="") as file:
            file.write(text)
        os.replace(draft, target)
    except OSError as error:
        raise RecordError(
            f"Cannot write {target}: {error.strerror or error}; choose a folder you may write to."
        ) from None
    finally:
        with contextlib.suppress(OSError):
            draft.unlink(missing_ok=True)
    return target
