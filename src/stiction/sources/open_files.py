"""The files of a source: a path, a folder, a pattern, a stream, or a list of these."""

from __future__ import annotations

import os
from glob import glob, has_magic
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError
from stiction.sources.byte_source import open_sources

if TYPE_CHECKING:
    from stiction.sources.byte_source import ByteSource
    from stiction.sources.options import ReadOptions

__all__ = ["list_files", "list_paths", "open_files", "source_name"]


def open_files(source: Any, options: ReadOptions) -> list[ByteSource]:
    """Open a path, folder, pattern, "-", binary file, or list of these; an archive gives several files."""
    return [one for path in list_paths(source) for one in open_sources(path, options)]


def list_paths(source: Any) -> list[Any]:
    """List the files of a path, folder, pattern, "-", binary file, or list of these."""
    paths: list[Any] = []
    for part in source if isinstance(source, (list, tuple)) else [source]:
        paths += list_files(part) if isinstance(part, (str, os.PathLike)) and part != "-" else [part]
    if not paths:
        raise RecordError("the list of files is empty; give one or more.")
    return paths


def source_name(path: Any) -> str:
    """Name of a path or stream, for messages."""
    return os.fspath(path) if isinstance(path, (str, os.PathLike)) else str(getattr(path, "name", "stream"))


def list_files(source: str | os.PathLike[str], *, subfolders: bool = False) -> list[str]:
    """List the files of a path, a folder or a pattern; hidden ones are left out.

    Raises
    ------
    RecordError
        When the folder or the pattern has none.
    """
    text = os.fspath(source)
    if os.path.isdir(text):
        inside = Path(text).rglob("*") if subfolders else Path(text).iterdir()
        files = sorted(
            str(path) for path in inside
            if path.is_file() and not any(name.startswith(".") for name in path.relative_to(text).parts)
        )  # fmt: skip
        if not files:
            raise RecordError("is a folder without files; give the folder that contains the exports.", where=text)
        return files
    if has_magic(text) and not os.path.exists(text):
        files = sorted(path for path in glob(text, recursive=True) if os.path.isfile(path))
        if not files:
            raise RecordError("no file matches this pattern; check the folder and the spelling.", where=text)
        return files
    return [text]
