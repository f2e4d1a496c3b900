"""Write a file completely or not at all."""

from __future__ import annotations

import contextlib
import os
import re
import secrets
from pathlib import Path

from stiction.errors import RecordError

__all__ = [
    "may_write",
    "output_path",
    "require_file_path",
    "require_new_file",
    "safe_file_name",
    "unwritable_error",
    "write_atomically",
    "write_files",
]


def may_write(folder: Path) -> bool:
    """Whether files can be written in a folder; where it does not exist, in the nearest one above."""
    nearest = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    return os.access(nearest, os.W_OK)


def output_path(path: str | os.PathLike[str]) -> Path:
    """Return a path to write to, ``~`` replaced; raises RecordError for what the system takes as no path."""
    try:
        target = Path(path).expanduser()
        target.exists()
        if b"\0" in os.fsencode(target):
            raise ValueError("embedded null byte")
    except (TypeError, ValueError, OSError, RuntimeError) as error:
        raise RecordError(
            f"{path!r} is no path to write to ({getattr(error, 'strerror', None) or error})", remedy="give another path"
        ) from None
    return target


def safe_file_name(tag: str) -> str:
    """Name of a file for a tag, without an ending: other characters than letters, digits and `.()+-_` become `_`.

    Examples
    --------
    >>> safe_file_name("UNIT1/FIC-101.PV"), safe_file_name("..")
    ('UNIT1_FIC-101.PV', '_..')
    """
    name = re.sub(r"[^\w.()+-]", "_", tag)[:120]
    return f"_{name}" if name.startswith(".") else name


def require_file_path(target: Path) -> None:
    """Refuse by a RecordError an output path that is a folder, or whose folder does not exist."""
    if target.is_dir():
        raise RecordError("cannot be written, because it is a folder; give the name of a file.", where=target)
    if not target.parent.is_dir():
        raise RecordError(
            f"cannot be written, because there is no folder {target.parent}; create it, or give another file.",
            where=target,
        )


def require_new_file(path: str | os.PathLike[str], *, folder: bool = True) -> Path:
    """Return a path where nothing exists; with `folder` its folder must exist. Else raises RecordError."""
    target = output_path(path)
    if target.exists():
        raise RecordError("exists and is not replaced", remedy="remove it, or give another path", where=target)
    if folder:
        require_file_path(target)
    return target


def unwritable_error(target: Path, error: OSError) -> RecordError:
    """Make the error for a file that the system does not let us write."""
    return RecordError(
        f"cannot be written ({error.strerror or error})",
        remedy="give a file in a folder that you may write to",
        where=target,
    )


def write_atomically(text: str, path: str | os.PathLike[str]) -> Path:
    """Write UTF-8 so that a reader sees the old file or the new one; a RecordError leaves nothing behind."""
    target = output_path(path)
    require_file_path(target)
    write_files({target: text.encode()})
    return target


def write_files(contents: dict[Path, bytes]) -> None:
    """Write several new files or one, and their folder, all or none; raises RecordError where that fails."""
    drafts: dict[Path, Path] = {}
    placed: list[Path] = []
    target = next(iter(contents))
    try:
        for target, data in contents.items():
            target.parent.mkdir(parents=True, exist_ok=True)
            drafts[target] = target.with_name(f".{target.name}.{secrets.token_hex(4)}.part")
            drafts[target].write_bytes(data)
        for target, draft in drafts.items():
            os.replace(draft, target)
            placed.append(target)
    except OSError as error:
        for path in placed:
            path.unlink(missing_ok=True)
        raise unwritable_error(target, error) from None
    finally:
        for draft in drafts.values():
            with contextlib.suppress(OSError):
                draft.unlink(missing_ok=True)
