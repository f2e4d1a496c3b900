"""The records of one loop, from whatever holds them."""

from __future__ import annotations

from os import PathLike
from typing import Any

from stiction.errors import ParameterError
from stiction.records.record import LoopRecord
from stiction.sources.read import open_loops

__all__ = ["records_of_loop"]

MAX_NAMED = 10
"""Tags that an error names [-]."""


def records_of_loop(source: Any, tag: str | None = None) -> Any:
    """Read the only loop of a path or frame, or the one with a tag.

    Parameters
    ----------
    source
        A record or records, which are given back; a path, several paths, an open file or a data frame, which is read.
    tag : str, optional
        The loop, where the source holds several.

    Returns
    -------
    LoopRecord or list of LoopRecord
        The record of the loop, or its records. What is none of these is given back, for the caller to refuse.

    Raises
    ------
    ParameterError
        When the source holds several loops and `tag` names none of them.
    RecordError
        When it cannot be read.

    Examples
    --------
    >>> one, other = LoopRecord("FIC-1", 1.0, op=[50.0]), LoopRecord("LIC-2", 1.0, op=[50.0])
    >>> records_of_loop([one, other], "LIC-2") is other
    True
    """
    if isinstance(source, LoopRecord):
        return source
    if isinstance(source, (list, tuple)):
        if source and all(isinstance(one, (str, PathLike)) for one in source):
            parts = [records_of_loop(one, tag) for one in source]
            return [one for part in parts for one in (part if isinstance(part, list) else [part])]
        if tag is None:
            return source
        chosen = [one for one in source if one.tag == tag]
        _require_one({one.tag for one in chosen}, [one.tag for one in source], tag, "the list")
        return chosen[0] if len(chosen) == 1 else chosen
    if not (isinstance(source, (str, PathLike)) or hasattr(source, "read") or hasattr(source, "columns")):
        return source
    loops = open_loops(source)
    name = str(source) if isinstance(source, (str, PathLike)) else "the source"
    numbers = [k for k, each in enumerate(loops.tags) if tag is None or each == tag]
    if len(loops.tags) == 1 and tag is not None:  # a source with one loop without a name
        loops, numbers = open_loops(source, tag=tag), [0]
    _require_one({loops.tags[k] for k in numbers}, loops.tags, tag, name)
    found = [loops.read_one(k) for k in numbers]
    return found[0] if len(found) == 1 else found


def _require_one(chosen: set[str], tags: list[str], tag: str | None, source: str) -> None:
    """Raise a ParameterError unless one loop is chosen."""
    if len(chosen) == 1 or not tags:
        return
    names = ", ".join(dict.fromkeys(tags[:MAX_NAMED])) + (", ..." if len(tags) > MAX_NAMED else "")
    if tag is not None:
        raise ParameterError(f"tag = {tag!r} is not a loop of {source}; give one of {names}.")
    raise ParameterError(
        f"{source} holds {len(set(tags))} loops ({names}); name one with tag={tags[0]!r}, or use stiction.diagnose_all."
    )
