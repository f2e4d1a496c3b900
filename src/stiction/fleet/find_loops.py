"""The loops of files, folders, patterns and databases, found without reading their signals."""

from __future__ import annotations

import fnmatch
import json
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.errors import ParameterError, RecordError, Setting
from stiction.fleet.database_parts import find_loops_of_table
from stiction.fleet.source_parts import LoopPlace, SourcePart
from stiction.sources.open_files import list_files

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stiction.sources.loops import Loops

__all__ = ["area_of_tag", "choose_loops", "find_loop_places", "list_loop_places"]


def find_loop_places(
    sources: Sequence[str], options: Mapping[str, Any], *, pattern: str | None = None
) -> list[LoopPlace]:
    """Find the loops of files, folders, patterns and databases.

    Parameters
    ----------
    sources : sequence of str
        What to read, as `stiction.read` takes it.
    options : mapping
        Options of `stiction.read`.
    pattern : str, optional
        Only loops whose tag matches this pattern, such as ``"FIC*"``; case does not matter.

    Returns
    -------
    list of LoopPlace
        The loops, in the order of the source.

    Raises
    ------
    RecordError
        When a source cannot be read, or holds no loop.
    ParameterError
        When no tag matches the pattern, or an importance of the map is no number.

    Notes
    -----
    Files that can each be opened alone, and share no tag, are parts of their own, so that no process reads more than it
    needs; other files are opened together. The area of a loop is the one of the map, else the folder of its file where
    files are in several folders, else the prefix of its tag.
    """
    return choose_loops(list_loop_places(sources, options), pattern)


def list_loop_places(sources: Sequence[str], options: Mapping[str, Any]) -> list[LoopPlace]:
    """List all loops of the sources, as `find_loop_places` does; a tag may occur twice."""
    return [place for source in sources for place in _places_of(source, options)]


def choose_loops(places: list[LoopPlace], pattern: str | None) -> list[LoopPlace]:
    """Choose the loops whose tag matches a pattern, and make their tags unique."""
    if pattern is not None:
        wanted = [one for one in places if fnmatch.fnmatch(one.tag.casefold(), pattern.casefold())]
        if not wanted:
            names = ", ".join(one.tag for one in places[:5])
            raise ParameterError(
                Setting("loops"),
                f" = {pattern!r} matches none of the {len(places)} loops ({names}, ...)",
                remedy="give a pattern such as 'FIC*'",
            )
        places = wanted
    return _with_unique_tags(places)


def area_of_tag(tag: str) -> str:
    """Area that a tag names before the loop; empty when it names none.

    Examples
    --------
    >>> [area_of_tag(tag) for tag in ("UNIT1/FIC-1009", "41-TIC-02", "P2.LIC7", "FIC-101")]
    ['UNIT1', '41', 'P2', '']
    """
    found = re.match(r"(.+?)[/\\:.|]+[^/\\:.|]+", tag) or re.match(r"(\w+?)[-_][A-Za-z]+[-_ ]?\d", tag)
    return found[1] if found else ""


def _places_of(source: str, options: Mapping[str, Any]) -> list[LoopPlace]:
    """Loops of one source."""
    from stiction.sources.database_url import is_database_url

    names = [source] if is_database_url(source) or source == "-" else list_files(source, subfolders=True)
    if source == "-":
        raise RecordError(
            "an audit cannot read the standard input, because several processes read the source; give a file."
        )
    if is_database_url(source) and (found := find_loops_of_table(source, options)):
        return [place for loops in found for place in _places_of_table(source, options, loops)]
    parts = _split(names, json.dumps(dict(options)))
    folders = {Path(name).parent for name in names}
    places = []
    for part in parts:
        loops = part.open()
        folder = Path(part.names[0]).parent.name if len(folders) > 1 else ""
        places += _describe(part, loops, folder)
    return places


def _split(names: list[str], options: str) -> list[SourcePart]:
    """Parts that can each be opened alone, or one part of all files."""
    whole = SourcePart(tuple(names), options)
    if len(names) == 1:
        return [whole]
    parts, tags = [SourcePart((name,), options) for name in names], Counter()
    try:
        for part in parts:
            tags.update(tag.casefold() for tag in part.open().tags)
            if max(tags.values()) > 1:
                return [whole]
    except RecordError:
        return [whole]
    return parts


def _describe(part: SourcePart, loops: Loops, folder: str) -> list[LoopPlace]:
    roles = loops.roles or [None] * len(loops)
    places = []
    for number, (tag, role) in enumerate(zip(loops.tags, roles, strict=True)):
        area = (role.area if role else "") or folder or area_of_tag(tag)
        importance = _importance(role.importance if role else "", tag)
        span, master = (role.spans.get("pv"), role.master) if role else (None, "")
        places.append(LoopPlace(tag, part, number, area, importance, span, master))
    return places


def _places_of_table(source: str, options: Mapping[str, Any], loops: list[tuple[str, list[str]]]) -> list[LoopPlace]:
    """Loops of one part of a long database table; what the map says of them is kept."""
    from stiction.sources.roles.map_file import read_map

    rows = read_map(options["map"]) if options.get("map") else []
    part = SourcePart((source,), json.dumps({**options, "tags": [tag for _, tags in loops for tag in tags]}))
    places = []
    for loop, _ in loops:
        mine = [row for row in rows if row.loop == loop]
        area = next((row.area for row in mine if row.area), "") or area_of_tag(loop)
        importance = _importance(next((row.importance for row in mine if row.importance), ""), loop)
        spans = [
            (row.low, row.high) for row in mine if row.role == "pv" and row.low is not None and row.high is not None
        ]
        master = next((row.master for row in mine if row.master), "")
        places.append(LoopPlace(loop, part, -1, area, importance, spans[0] if spans else None, master))
    return places


def _importance(text: str, tag: str) -> float:
    try:
        value = float(text.replace(",", ".")) if text else 1.0
    except ValueError:
        value = -1.0
    if not 0.0 <= value < float("inf"):
        raise ParameterError(
            f"importance of {tag} = {text!r} is not a weight; give a number of 0 or more, such as 1 or 2.5."
        )
    return value


def _with_unique_tags(places: list[LoopPlace]) -> list[LoopPlace]:
    """Add the file, and then a number, to tags that occur twice."""
    seen: Counter[str] = Counter()
    count = Counter(one.tag for one in places)
    unique = []
    for one in places:
        name = one.tag if count[one.tag] == 1 else f"{one.tag} ({one.part.display_name})"
        seen[name] += 1
        unique.append(one if name == one.tag else replace(one, tag=name if seen[name] == 1 else f"{name} {seen[name]}"))
    return unique
