"""Audits and files that the command line of `stiction serve` names, checked before the page opens."""

from __future__ import annotations

import multiprocessing
import os
import tomllib
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from glob import glob, has_magic
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction import __version__
from stiction.errors import RecordError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

__all__ = ["ServedSources", "check_audit", "check_files", "find_audits", "find_sources"]

AUDIT_FILE = "audit.toml"
"""File by which a folder is known as an audit."""
LEDGER_FILE = "ledger.sqlite"
"""Results of an audit; audits with a database have none."""
USUAL_SUFFIXES = frozenset((".csv", ".txt", ".tsv", ".xlsx", ".xls", ".parquet", ".mat", ".gz", ".zst", ".zip"))
"""Ends of the names of files that need no look into them before the page opens."""
MAX_NAMED = 3
"""Reasons that a message names [-]."""


@dataclass(frozen=True)
class ServedSources:
    """Audits and files of the command line."""

    audits: tuple[Path, ...] = ()
    """Folders of audits."""
    files: tuple[tuple[str, str], ...] = ()
    """Path and shown name of each file."""


def find_sources(sources: Sequence[str]) -> ServedSources:
    """Find audits and files, and check that they can be opened.

    `sources`: folders of audits, files, folders of files, patterns. Raises RecordError when there is no such file or
    folder, a folder is no audit and holds no file with records, or an audit is of another version or damaged.

    Examples
    --------
    >>> find_sources(["no-such-file.csv"])
    Traceback (most recent call last):
    ...
    stiction.errors.RecordError: no-such-file.csv: there is no such file or folder; check the name.
    """
    audits = [Path(source) for source in sources if (Path(source) / AUDIT_FILE).is_file()]
    for folder in audits:
        _check_audit(folder)
    files = [file for source in sources if Path(source) not in audits for file in _list_files(source)]
    return ServedSources(tuple(audits), tuple(files))


def find_audits(folders: Sequence[Path]) -> list[Path]:
    """Find the audits in some folders and in their subfolders, the newest first; links out of them are not followed."""
    found = set()
    for root in {folder.resolve() for folder in folders}:
        for file in (*root.glob(AUDIT_FILE), *root.glob(f"*/{AUDIT_FILE}")):
            if file.is_file() and file.resolve().is_relative_to(root):
                found.add(file.parent)
    return sorted(found, key=lambda folder: (-(folder / AUDIT_FILE).stat().st_mtime, str(folder)))


def _check_audit(folder: Path) -> None:
    """Check an audit; another version's is opened in another process, so that the server stays small."""
    try:
        settings = tomllib.loads((folder / AUDIT_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        settings = {}
    if settings.get("version") == __version__ and (folder / LEDGER_FILE).is_file():
        return
    _call_apart(check_audit, str(folder))


def check_audit(folder: str) -> None:
    """Open an audit; raise RecordError when it cannot be opened."""
    from stiction.fleet import open_audit
    from stiction.fleet.folder import read_settings

    if not read_settings(Path(folder)).get("ledger") and not (Path(folder) / LEDGER_FILE).is_file():
        raise RecordError(f"{LEDGER_FILE}, the file with its results, is missing; run the audit again.", where=folder)
    open_audit(folder)


def _list_files(source: str) -> list[tuple[str, str]]:
    """Files of a path, a folder or a pattern; in a folder only those that are really in it."""
    path = Path(source)
    if path.is_dir():
        return _list_folder(path)
    if has_magic(source) and not path.exists():
        found = [Path(path) for path in sorted(glob(source, recursive=True)) if Path(path).is_file()]
        if not found:
            raise RecordError("no file matches this pattern; check the folder and the spelling.", where=source)
        return [(str(path.resolve()), path.name) for path in found]
    if not path.is_file():
        raise RecordError("there is no such file or folder; check the name.", where=source)
    return [(str(path.resolve()), path.name)]


def _list_folder(folder: Path) -> list[tuple[str, str]]:
    """Files of a folder that is no audit."""
    root = folder.resolve()
    found = [path for path in sorted(folder.iterdir()) if path.is_file() and not path.name.startswith(".")]
    inside = [path for path in found if path.resolve().is_relative_to(root)]
    if not any(path.suffix.lower() in USUAL_SUFFIXES for path in inside):
        audits = sorted(str(path.parent) for path in folder.glob(f"*/{AUDIT_FILE}"))
        if audits:
            raise RecordError(
                f"is not an audit (it has no {AUDIT_FILE}); give one of the audits in it, such as {audits[0]}.",
                where=folder,
            )
        if not inside:
            raise RecordError(
                f"is not an audit (it has no {AUDIT_FILE}) and contains no files; give another folder.", where=folder
            )
        _call_apart(check_files, str(folder), [str(path) for path in inside])
    return [(str(path.resolve()), path.name) for path in inside]


def check_files(folder: str, paths: Sequence[str]) -> None:
    """Check that one of the files of a folder can be read; raise RecordError with the reasons where none can."""
    from stiction.sources.byte_source import open_files
    from stiction.sources.formats import FORMATS
    from stiction.sources.options import ReadOptions

    reasons = []
    for path in paths:
        try:
            files = open_files(path, ReadOptions())
        except RecordError as error:
            reasons.append(error.text(where=os.path.relpath(error.where, folder)))
        else:
            if any(page.recognises(file.head, file.origin.name) for file in files for page in FORMATS):
                return
    raise RecordError(
        f"is not an audit (it has no {AUDIT_FILE}), and no record was found in its files; give another folder. "
        f"The reasons: {' '.join(reasons[:MAX_NAMED]) or 'all files are binary.'}",
        where=folder,
    )


def _call_apart(function: Callable[..., None], *arguments: Any) -> None:
    """Call a function in another process."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        pool.submit(function, *arguments).result()
