"""The loops of files, folders, patterns and databases, found without reading their signals."""

from __future__ import annotations

import fnmatch
import json
import re
from collections import Counter, defaultdict
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.errors import ParameterError, RecordError, Setting
from stiction.fleet.database_parts import LOOPS_PER_PART, find_loops_of_table
from stiction.fleet.folder import SETTINGS_FILE
from stiction.fleet.source_parts import LoopPlace, SourcePart
from stiction.sources import open_loops
from stiction.sources.byte_source import list_files
from stiction.sources.database_url import is_database_url, show_url
from stiction.sources.historians.address import is_historian_url

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from datetime import datetime

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
        When no source can be read, or none holds a loop.
    ParameterError
        When no tag matches the pattern, or an importance of the map is no number.

    Notes
    -----
    A file is a part of its own, so that no process reads more than it needs, unless other files hold signals or further
    times of its loops. A file that cannot be read has a place with the reason. The area of a loop is the one of the
    map, else the folder of its file where files are in several folders, else the prefix of its tag.
    """
    return choose_loops(list_loop_places(sources, options), pattern)


def list_loop_places(
    sources: Sequence[str],
    options: Mapping[str, Any],
    span: tuple[datetime | None, datetime | None] = (None, None),
) -> list[LoopPlace]:
    """List all loops of the sources, as `find_loop_places` does; a tag may occur twice.

    `span` is what is read of historians.
    """
    if "-" in sources:
        raise RecordError(
            "an audit cannot read the standard input, because several processes read the source; give a file."
        )
    databases = [source for source in sources if is_database_url(source)]
    historians = [source for source in sources if is_historian_url(source)]
    files = [one for one in sources if one not in (*databases, *historians)]
    names = [name for one in files for name in _outside_audits(one, list_files(one, subfolders=True))]
    places = [place for url in databases for place in _places_in_database(url, options)]
    places += [place for url in historians for place in _places_in_historian(url, options, span)]
    if names:
        places += _places_in_files(list(dict.fromkeys(names)), options)
    secondaries = {place.master.casefold(): place.tag for place in places if place.master}
    return [replace(place, secondary=secondaries.get(place.tag.casefold(), "")) for place in places]


def _outside_audits(source: str, names: list[str]) -> list[str]:
    """Leave out the files of audits, whose results are no records."""
    audits = {Path(name).parent for name in names if Path(name).name == SETTINGS_FILE}
    left = [name for name in names if audits.isdisjoint(Path(name).parents)]
    if not left:
        raise RecordError("holds only an audit", remedy="give the folder of the records", where=source)
    return left


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
    >>> [area_of_tag(tag) for tag in ("UNIT1/FIC-1009", "41-TIC-02", "P2.LIC7", "FIC-101", "FIC-101 (a/b.csv)")]
    ['UNIT1', '41', 'P2', '', '']
    """
    tag = re.sub(r" \(.*\)( \d+)?$", "", tag)  # the file of a loop whose tag others have too
    found = re.match(r"(.+?)[/\\:.|]+[^/\\:.|]+", tag) or re.match(r"(\w+?)[-_][A-Za-z]+[-_ ]?\d", tag)
    return found[1] if found else ""


def _places_in_database(url: str, options: Mapping[str, Any]) -> list[LoopPlace]:
    """Loops of one database."""
    if found := find_loops_of_table(url, options):
        return [place for loops in found for place in _places_of_table(url, options, loops)]
    part = SourcePart((url,), json.dumps(dict(options)))
    loops = part.open()
    return [_place(loops, k, part, k, "") for k in range(len(loops))]


def _places_in_historian(
    url: str, options: Mapping[str, Any], span: tuple[datetime | None, datetime | None]
) -> list[LoopPlace]:
    """Loops of a historian, in parts whose tags are named with their addresses, so that no process searches again."""
    from stiction.sources.historians.historian_loops import historian_span

    first, last = historian_span(*span)
    times = {"since": first.isoformat(), "until": last.isoformat()}
    loops = SourcePart((url,), json.dumps({**options, **times})).open()
    places = []
    for start in range(0, len(loops), LOOPS_PER_PART):
        numbers = range(start, min(start + LOOPS_PER_PART, len(loops)))
        columns = [column for k in numbers for column in loops.roles[k].roles.values()]
        tags = [f"{column.name}={column.address}" for column in columns]
        part = SourcePart((url,), json.dumps({**options, **times, "tags": tags}))
        places += [_place(loops, k, part, -1, "") for k in numbers]
    return places


def _places_in_files(names: list[str], options: Mapping[str, Any]) -> list[LoopPlace]:
    """Loops of files, each in the part that must be opened to find it; a file that cannot be read is a place too."""
    loops = open_loops(names, **options)
    folders = {Path(name).parent for name in names}
    numbers: Counter[SourcePart] = Counter()
    places = []
    for k, files in enumerate(loops.files or [tuple(names)] * len(loops)):
        zone = next((loops.zones[name] for name in files if name in loops.zones), None)
        part = SourcePart(files, json.dumps(dict(options) | ({} if zone is None else {"timezone": zone})))
        folder = Path(files[0]).parent.name if len(folders) > 1 else ""
        places.append(_place(loops, k, part, numbers[part], folder))
        numbers[part] += 1
    for file, tag, error in loops.failures:
        part = SourcePart((next((name for name in names if file.startswith(name)), file),), json.dumps(dict(options)))
        places.append(LoopPlace(tag or part.display_name, part, 0, failure=str(error)))
    return places


def _place(loops: Loops, k: int, part: SourcePart, number: int, folder: str) -> LoopPlace:
    """Place of the loop number `k` of a source, which is the given number of its part."""
    tag = loops.tags[k]
    role = loops.roles[k] if k < len(loops.roles) else None
    area = (role.area if role else "") or folder or area_of_tag(tag)
    importance = _importance(role.importance if role else "", tag)
    span, master = (role.spans.get("pv"), role.master) if role else (None, "")
    return LoopPlace(tag, part, number, area, importance, span, master)


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
    """Add to tags that occur twice their file, with as many of its folders as are needed, and then a number."""
    same: dict[str, list[LoopPlace]] = defaultdict(list)
    for one in places:
        same[one.tag].append(one)
    files = {tag: _tell_apart([one.part.names[0] for one in group]) for tag, group in same.items() if len(group) > 1}
    seen: Counter[str] = Counter()
    taken = set(same)
    unique = []
    for one in places:
        name = one.tag
        if name in files:
            name = base = f"{one.tag} ({files[one.tag][one.part.names[0]]})"
            while name in taken:
                seen[base] += 1
                name = f"{base} {seen[base] + 1}"
            taken.add(name)
        unique.append(one if name == one.tag else replace(one, tag=name))
    return unique


def _tell_apart(names: list[str]) -> dict[str, str]:
    """The end of each path by which it differs from the others; of a database its URL without a password."""
    paths = {name: show_url(name) if is_database_url(name) else name for name in names}
    for n in range(1, 1 + max(len(Path(path).parts) for path in paths.values())):
        short = {name: "/".join(Path(path).parts[-n:]) for name, path in paths.items()}
        if len(set(short.values())) == len(paths):
            return short
    return paths
