"""The loops of a source, found before their signals are read."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from stiction.display.number_format import count_noun
from stiction.errors import RecordError, Setting
from stiction.foreign_errors import data_error, failure_of
from stiction.sources.build_record import RecordBuilder
from stiction.sources.memory import memory_limit, rows_that_fit

if TYPE_CHECKING:
    from stiction.errors import StictionError
    from stiction.records.record import LoopRecord
    from stiction.sources.formats.stored_records import StoredRecords
    from stiction.sources.options import ReadOptions
    from stiction.sources.roles.loop_roles import LoopRoles
    from stiction.sources.table import RawTable, TagColumn

__all__ = ["Loops", "SourceFailure"]

MAX_NOTED_FAILURES = 3
"""Failures that the records of the other loops name each [-]."""


class SourceFailure(NamedTuple):
    """A file or a loop that could not be read, while others could."""

    file: str
    """Name of the file."""
    tag: str | None
    """Tag of the loop; None where the file holds none."""
    error: StictionError
    """Why."""


@dataclass(eq=False)
class Loops:
    """The loops of a source. Their tags are known, their signals are read when they are asked for."""

    options: ReadOptions
    """Options of the source."""
    roles: list[LoopRoles] = field(default_factory=list)
    """The columns of each loop that is no stored record."""
    stored: list[StoredRecords] = field(default_factory=list)
    """Files of records (`LoopRecord.to_parquet`); their loops come last."""
    failures: list[SourceFailure] = field(default_factory=list)
    """Files that could not be read, or hold no loop."""
    files: list[tuple[str, ...]] = field(default_factory=list)
    """Files that must be opened together to find each loop; empty where the source is one file."""
    columns: list[TagColumn] = field(default_factory=list)
    """All columns of the files, those without a signal of a loop too."""
    zones: dict[str, str] = field(default_factory=dict)
    """Files whose time stamps have no zone, among others that have -> the zone in which they are taken."""
    _is_loaded: bool = False

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
        if k < len(self.roles):
            loop = self.roles[k]
            try:
                self._fit_into_memory(loop)
                _load_columns([loop])
                return self._builder.build(loop)
            except BaseException as error:
                known = data_error(error, loop.roles["op"].table.origin.name)
                if known is None or known is error:
                    raise
                raise known from None
            finally:
                if not self._is_loaded:
                    self._forget(loop)
        stored = [(file, place) for file in self.stored for place in range(len(file.tags))]
        file, place = stored[k - len(self.roles)]
        return file.read_one(place)

    def read_all(self) -> tuple[list[LoopRecord], list[SourceFailure]]:
        """Read all loops and what failed; raises RecordError when the only loop of the only file fails."""
        records, roles, failures = [], [], list(self.failures)
        is_single = len(self) == 1 and not failures
        if self._fits_at_once():
            try:
                _load_columns(self.roles)
                self._is_loaded = True
            except RecordError:  # each loop says below whether it is its columns that cannot be read
                if is_single:
                    raise
        for k, tag in enumerate(self.tags):
            try:
                record = self.read_one(k)
            except BaseException as error:
                if is_single:
                    raise
                name = self.roles[k].roles["op"].table.origin.name if k < len(self.roles) else ""
                failures.append(SourceFailure(name, tag, failure_of(error, name)))
            else:
                records.append(record)
                roles += self.roles[k : k + 1]
        return (_link_cascades(records, roles) if self.roles else records), failures

    def read(self) -> list[LoopRecord]:
        """Read all loops; others that cannot be read are an assumption of these. Raises RecordError when none can."""
        records, failures = self.read_all()
        if not records:
            raise failures[0].error
        notes = [f"Left out: {failure.error}" for failure in failures[:MAX_NOTED_FAILURES]]
        if more := len(failures) - len(notes):
            notes.append(f"Left out: {count_noun(more, 'more file or loop', 'more files or loops')}.")
        return [_with_provenance(one, assumptions=(*one.provenance.assumptions, *notes)) for one in records]

    def _fit_into_memory(self, loop: LoopRoles) -> None:
        """Leave out the first rows of a table of which one loop alone takes too much memory."""
        for table in {id(column.table): column.table for column in loop.roles.values()}.values():
            columns = [column for column in loop.roles.values() if column.table is table]
            if all(column.position is not None and not column.parts for column in columns):
                limit = memory_limit(self.options.max_memory)
                table.keep_last(rows_that_fit(limit, 1 + len(columns)))

    def _fits_at_once(self) -> bool:
        """Whether columns, then records, of all loops fit into the memory; RecordError if the records do not."""
        for loop in self.roles:
            self._fit_into_memory(loop)
        limit = memory_limit(self.options.max_memory)
        cells = [(column.table, role) for loop in self.roles for role, column in loop.roles.items()]
        tables = {table for table, _ in cells}
        rows = {table: table.count_rows() - table.first_row if table.count_rows else 0 for table in tables}
        size = 8 * sum(rows[table] for table, _ in cells)
        if size > limit and len(self.roles) > 1:
            raise RecordError(
                f"{len(self.roles)} loops take {size / 1e9:.3g} GB of memory, more than {limit / 1e9:.3g} GB",
                remedy=("audit them, read one with ", Setting("tag"), ", or allow more with ", Setting("max_memory")),
                where=cells[0][0].origin.name,
            )
        return 4 * size <= limit

    def _forget(self, loop: LoopRoles) -> None:
        """Drop the cells of a loop, so that the loops read before do not fill the memory; the time is kept."""
        for column in loop.roles.values():
            for part in (column, *column.parts):
                part.__dict__.pop("cells", None)
                if part.position is not None:
                    part.table.drop([part.position])

    @cached_property
    def _builder(self) -> RecordBuilder:
        return RecordBuilder(self.options)


def _load_columns(loops: list[LoopRoles]) -> None:
    """Read the columns of all loops, in one pass for each table."""
    wanted: dict[RawTable, set[int]] = {}
    for loop in loops:
        for column in loop.roles.values():
            for part in column.parts or (column,):
                if part.position is not None:
                    wanted.setdefault(part.table, set()).add(part.position)
    for table, positions in wanted.items():
        table.load(positions)


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
