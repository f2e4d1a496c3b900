"""The loops of a source, found without reading their signals: each file alone, then what files hold together."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import TYPE_CHECKING, Any

from stiction.errors import MissingExtraError, ParameterError, RecordError, StictionError
from stiction.foreign_errors import data_error, failure_of
from stiction.sources.byte_source import list_paths, open_sources, source_name
from stiction.sources.database_url import is_database_url
from stiction.sources.historians.address import is_historian_url
from stiction.sources.join_files import complete_loops, join_same_tags
from stiction.sources.loops import Loops, SourceFailure
from stiction.sources.options import ReadOptions
from stiction.sources.roles.assign import assign_roles, choose_loops

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.sources.byte_source import ByteSource
    from stiction.sources.formats.stored_records import StoredRecords
    from stiction.sources.roles.loop_roles import LoopRoles
    from stiction.sources.roles.map_file import MapRow
    from stiction.sources.table import RawTable, TagColumn

__all__ = ["find_loops"]

MAX_LISTED = 20
"""Names or reasons in a message [-]."""
_OFFSET = re.compile(r"\d\d:?\d\d(?::?\d\d(?:\.\d+)?)?([+-]\d\d:\d\d)$")
"""A time of day and its difference to UTC."""


@dataclass(eq=False)
class _File:
    """One file, or one member of an archive, opened as if it stood alone."""

    path: Any
    """As given: a path or a stream; the archive of a member."""
    name: str
    """Name for messages."""
    columns: list[TagColumn] = field(default_factory=list)
    loops: list[LoopRoles] = field(default_factory=list)
    stored: StoredRecords | None = None
    failure: StictionError | None = None
    """Why it holds no loop; with `columns` another file may hold what it lacks."""


def find_loops(source: Any, options: ReadOptions, **database: Any) -> Loops:
    """Find the loops of a source; raises RecordError if none can be read. `database`: arguments of `read_database`."""
    from stiction.sources.frame import frame_to_table
    from stiction.sources.layouts import read_layout
    from stiction.sources.roles.map_file import read_map

    rows = None if options.map is None else read_map(options.map)
    if isinstance(source, str) and is_database_url(source):
        from stiction.sources.sql import read_database

        columns = {k: v for k, v in options.columns.items() if isinstance(v, str)}
        chosen = {"columns": list(columns.values())} if columns and "table" in database else {}
        tables = read_database(source, max_bytes=options.max_bytes, **{**chosen, **database})
    elif is_historian_url(source):
        from stiction.sources.historians.historian_loops import find_loops_of_historian

        return find_loops_of_historian(source, options, rows, **database)
    elif database:
        names = ", ".join(sorted(database))
        raise ParameterError(
            f"{names} can be used only with a database or a historian, and {source!r} is not a URL such as "
            "sqlite:///plant.db or opc.tcp://plant:4840."
        )
    elif isinstance(source, (str, os.PathLike, list, tuple)) or hasattr(source, "read"):
        return _find_in_files(list_paths(source), options, rows)
    else:
        tables = [frame_to_table(source)]
    found = read_layout(tables, options)
    roles = assign_roles(found, options, rows, tables[0].origin.name)
    return Loops(options, roles, columns=found)


def _find_in_files(paths: list[Any], options: ReadOptions, rows: Sequence[MapRow] | None) -> Loops:
    several = len(paths) > 1
    files = [file for path in paths for file in _open_path(path, options, rows, several=several)]
    if len(files) == 1:
        [file] = files
        if file.failure is not None:
            raise file.failure
        stored = [file.stored] if file.stored else []
        return Loops(options, file.loops, stored, columns=file.columns)
    files, zones = _in_one_zone(files, options, rows)
    incomplete = [file for file in files if file.failure is not None and file.columns]
    loops = [loop for file in files for loop in file.loops]
    others = [file.columns for file in files if file.loops]
    more, refusal = complete_loops([file.columns for file in incomplete], others, loops, options, rows)
    loops = join_same_tags([*loops, *more])
    stored = [(source_name(file.path), file.stored) for file in files if file.stored]
    used = {id(table) for loop in loops for table in _tables_of(loop)}
    unused = [file for file in files if not used & {id(column.table) for column in file.columns}]
    failures = [SourceFailure(file.name, None, file.failure) for file in unused if file.failure is not None]
    if not loops and not stored:
        raise _nothing_read(failures, refusal, [file.name for file in incomplete])
    if options.tag is not None:
        others = [tag for _, records in stored for tag in records.tags]
        loops = choose_loops(loops, options, files[0].name, others)
        stored = [(name, records.select(options.tag)) for name, records in stored]
    together = _files_together(files, loops, incomplete)
    together += [(name,) for name, records in stored for _ in records.tags]
    columns = [column for file in files for column in file.columns]
    return Loops(options, loops, [records for _, records in stored], failures, together, columns, zones)


def _open_path(path: Any, options: ReadOptions, rows: Sequence[MapRow] | None, *, several: bool) -> list[_File]:
    """Open a file, or the members of an archive; what fails among several is a file with its failure."""
    try:
        sources = open_sources(path, options)
    except (ParameterError, MissingExtraError):
        raise
    except BaseException as error:
        if not several:
            raise
        return [_File(path, source_name(path), failure=failure_of(error, source_name(path)))]
    several = several or len(sources) > 1
    return [_open_alone(path, one, options, rows, several=several) for one in sources]


def _open_alone(
    path: Any, source: ByteSource, options: ReadOptions, rows: Sequence[MapRow] | None, *, several: bool
) -> _File:
    from stiction.sources.formats import read_format
    from stiction.sources.layouts import read_layout

    file = _File(path, source.origin.name)
    if several and options.tag is not None:  # the wanted loop is chosen among those of all files
        options = replace(options, tag=None)
    try:
        if stored := _open_stored_records(source, options):
            file.stored = stored
            return file
        file.columns = read_layout(read_format(source, options), options)
        file.loops = assign_roles(file.columns, options, rows, file.name)
    except ParameterError:
        raise
    except BaseException as error:
        if data_error(error, file.name) is None and not several:
            raise
        file.failure = failure_of(error, file.name)
    return file


def _open_stored_records(source: ByteSource, options: ReadOptions) -> StoredRecords | None:
    """Open a file of records; None when it is none, or an option says how to read it as a table."""
    from stiction.sources.formats.columnar import is_parquet

    plain = ReadOptions(tag=options.tag, max_bytes=options.max_bytes, timezone=options.timezone)
    if options != plain or not is_parquet(source.head):
        return None
    from stiction.sources.formats.stored_records import open_records

    stored = open_records(source.path, keep=source)
    if stored is None or options.tag is None:
        return stored
    choose_loops([], options, source.origin.name, stored.tags)
    return stored.select(options.tag)


def _in_one_zone(
    files: list[_File], options: ReadOptions, rows: Sequence[MapRow] | None
) -> tuple[list[_File], dict[str, str]]:
    """Open files without a time zone again, in the zone of the others; also give the zone of each of them."""
    kinds = {id(file): {_kind(loop) for loop in file.loops} for file in files}
    zoned = [file for file in files if "utc" in kinds[id(file)]]
    naive = {source_name(file.path) for file in files if "local" in kinds[id(file)]}
    if not zoned or not naive or options.timezone is not None:
        return files, {}
    cells = (cell for row in zoned[0].loops[0].roles["op"].table.sample for cell in row)
    zone = next((found[1] for cell in cells if (found := _OFFSET.search(cell))), "UTC")
    again = replace(options, timezone=zone)
    opened: list[_File] = []
    for name, same in groupby(files, lambda file: source_name(file.path)):
        members = list(same)
        opened += _open_path(members[0].path, again, rows, several=True) if name in naive else members
    return opened, dict.fromkeys(sorted(naive), zone)


def _kind(loop: LoopRoles) -> str:
    """Kind of the time stamps of a loop; empty where it has none that can be read."""
    clock = loop.roles["op"].clock
    try:
        return clock.kind if clock else ""
    except StictionError:
        return ""


def _tables_of(loop: LoopRoles) -> list[RawTable]:
    return [part.table for column in loop.roles.values() for part in column.parts or (column,)]


def _files_together(files: list[_File], loops: list[LoopRoles], pool: list[_File]) -> list[tuple[str, ...]]:
    """Files that must be opened together to find each loop: with one of the incomplete files, all of these."""
    place = {source_name(file.path): k for k, file in reversed([*enumerate(files)])}
    owner = {id(column.table): source_name(file.path) for file in files for column in file.columns}
    incomplete = {source_name(file.path) for file in pool}
    groups = [{owner[id(table)] for table in _tables_of(loop)} for loop in loops]
    groups = [group | incomplete if group & incomplete else group for group in groups]
    merged: list[set[str]] = []
    for group in groups:
        alike = [one for one in merged if one & group]
        merged = [one for one in merged if not one & group] + [group.union(*alike)]
    whole = {name: group for group in merged for name in group}
    return [tuple(sorted(whole[next(iter(group))], key=place.__getitem__)) for group in groups]


def _nothing_read(failures: list[SourceFailure], refusal: RecordError | None, pool: list[str]) -> StictionError:
    """The error of a source of several files that holds no loop."""
    errors = {failure.file: failure.error for failure in failures}
    if refusal is not None:
        errors = {name: error for name, error in errors.items() if name not in pool} | {"": refusal}
    if len(errors) == 1:
        return next(iter(errors.values()))
    reasons = " ".join(f"({k}) {error}" for k, error in enumerate(list(errors.values())[:MAX_LISTED], 1))
    return RecordError(f"no loop could be read from {len(failures)} files: {reasons}")
