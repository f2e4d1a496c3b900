"""The loops of a source, found before their signals are read."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from stiction.errors import ParameterError, RecordError
from stiction.sources.build_record import RecordBuilder
from stiction.sources.database_url import is_database_url
from stiction.sources.open_files import open_files
from stiction.sources.options import ReadOptions

if TYPE_CHECKING:
    from stiction.records.record import LoopRecord
    from stiction.sources.byte_source import ByteSource
    from stiction.sources.formats.stored_records import StoredRecords
    from stiction.sources.roles.loop_roles import LoopRoles
    from stiction.sources.table import RawTable, TagColumn

__all__ = ["Loops", "find_loops"]

MAX_TIME_COLUMNS = 3
"""Columns without a signal up to which they are read with the signals [-]."""


@dataclass(eq=False)
class Loops:
    """The loops of a source. Their tags are known, their signals are read when they are asked for."""

    options: ReadOptions
    """Options of the source."""
    roles: list[LoopRoles] = field(default_factory=list)
    """The columns of each loop; empty when the source holds records."""
    stored: list[StoredRecords] = field(default_factory=list)
    """Files of records (`LoopRecord.to_parquet`)."""
    time_positions: dict[RawTable, set[int]] = field(default_factory=dict)
    """Columns of each table that hold no signal but time; they are read with the signals, in one pass."""

    @property
    def tags(self) -> list[str]:
        """Tag of each loop; the record of a loop without one is named after the file."""
        return [loop.tag or loop.roles["op"].table.origin.stem for loop in self.roles] + [
            tag for file in self.stored for tag in file.tags
        ]

    def __len__(self) -> int:
        return len(self.roles) + sum(len(file.tags) for file in self.stored)

    def read_one(self, k: int) -> LoopRecord:
        """Read the loop number `k`, from 0; only its columns are read."""
        if self.roles:
            _load_columns([self.roles[k]], self.time_positions)
            return self._builder.build(self.roles[k])
        for file in self.stored:
            if k < len(file.tags):
                return file.read_one(k)
            k -= len(file.tags)
        raise IndexError(k)

    def read(self) -> list[LoopRecord]:
        """Read all loops. A loop that cannot be read, while others can, is an assumption of the others."""
        _load_columns(self.roles, self.time_positions)
        records, read_roles, failures = [], [], []
        for k in range(len(self)):
            try:
                records.append(self.read_one(k))
                read_roles += self.roles[k : k + 1]
            except RecordError as error:
                if len(self) == 1:
                    raise
                failures.append(error)
        if not records:
            raise failures[0]
        linked = _link_cascades(records, read_roles) if self.roles else records
        notes = tuple(f"Left out: {error}" for error in failures)
        return [_with_provenance(one, assumptions=(*one.provenance.assumptions, *notes)) for one in linked]

    @cached_property
    def _builder(self) -> RecordBuilder:
        return RecordBuilder(self.options)


def find_loops(source: Any, options: ReadOptions, **database: Any) -> Loops:
    """Find the loops of a source without reading their signals, as far as its format allows.

    `database` are arguments of `stiction.sources.sql.read_database`.
    """
    from stiction.sources.formats import read_format
    from stiction.sources.frame import frame_to_table
    from stiction.sources.layouts import read_layout
    from stiction.sources.roles.assign import assign_roles
    from stiction.sources.roles.map_file import read_map

    rows = None if options.map is None else read_map(options.map)
    if isinstance(source, str) and is_database_url(source):
        from stiction.sources.sql import read_database

        columns = {k: v for k, v in options.columns.items() if isinstance(v, str)}
        chosen = {"columns": list(columns.values())} if columns and "table" in database else {}
        tables = read_database(source, max_bytes=options.max_bytes, **{**chosen, **database})
    elif database:
        names = ", ".join(sorted(database))
        raise ParameterError(
            f"{names} can be used only with a database, and {source!r} is not a database URL such as sqlite:///plant.db."
        )
    elif isinstance(source, (str, os.PathLike, list, tuple)) or hasattr(source, "read"):
        files = open_files(source, options)
        if stored := _open_stored_records(files, options):
            return Loops(options, stored=stored)
        tables = [table for one in files for table in read_format(one, options)]
    else:
        tables = [frame_to_table(source)]
    columns = read_layout(tables, options)
    return Loops(
        options, assign_roles(columns, options, rows, tables[0].origin.name), time_positions=_time_positions(columns)
    )


def _open_stored_records(files: list[ByteSource], options: ReadOptions) -> list[StoredRecords]:
    """Open files of records; empty when a file is none, or an option says how to read it as a table."""
    from stiction.sources.formats import parquet

    if options != ReadOptions(tag=options.tag, max_bytes=options.max_bytes):
        return []
    if not all(parquet.recognises(one.head, one.origin.name) for one in files):
        return []
    from stiction.sources.formats.stored_records import open_records

    stored = [open_records(one.path, keep=one) for one in files]
    found = [one for one in stored if one is not None]
    if len(found) < len(stored):
        return []
    if options.tag is None:
        return found
    chosen = [part for one in found if (part := one.select(options.tag)).tags]
    if not chosen:
        names = ", ".join(tag for one in found for tag in one.tags[:10])
        raise RecordError(f"has no loop {options.tag!r}; give one of {names}.", where=files[0].origin.name)
    return chosen


def _time_positions(columns: list[TagColumn]) -> dict[RawTable, set[int]]:
    """Columns of each table that hold no signal; none where they are many, so not the time alone."""
    signals: dict[RawTable, set[int]] = {}
    for column in columns:
        if column.position is not None:
            signals.setdefault(column.table, set()).add(column.position)
    others = {table: set(range(table.width)) - positions for table, positions in signals.items()}
    return {table: positions for table, positions in others.items() if len(positions) <= MAX_TIME_COLUMNS}


def _load_columns(loops: list[LoopRoles], time_positions: dict[RawTable, set[int]]) -> None:
    """Read the columns of all loops, in one pass for each table."""
    wanted: dict[RawTable, set[int]] = {}
    for loop in loops:
        for column in loop.roles.values():
            if column.position is not None:
                wanted.setdefault(column.table, set()).add(column.position)
    for table, positions in wanted.items():
        table.load(positions | time_positions.get(table, set()))


def _link_cascades(records: list[LoopRecord], loops: list[LoopRoles]) -> list[LoopRecord]:
    """Name in each record the loop whose set point its OP is."""
    if len(records) < 2:
        return records
    from stiction.sources.roles.cascade import find_secondary_tags

    masters = {loop.tag: loop.master for loop in loops if loop.master}
    found = find_secondary_tags(records, masters)
    return [_with_provenance(record, secondary_tag=name) for record, name in zip(records, found, strict=True)]


def _with_provenance(record: LoopRecord, **changes: Any) -> LoopRecord:
    """Change the provenance of a record; the same record where nothing changes."""
    origin = replace(record.provenance, **changes)
    return record if origin == record.provenance else replace(record, provenance=origin)
