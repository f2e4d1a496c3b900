"""`read`: from a file, folder, frame or database to the records of its loops."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from glob import glob, has_magic
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from stiction.errors import ParameterError, RecordError
from stiction.sources.build_record import RecordBuilder
from stiction.sources.options import MAX_BYTES, ReadOptions

if TYPE_CHECKING:
    from datetime import datetime

    from stiction.records.record import LoopRecord
    from stiction.sources.roles.loop_roles import LoopRoles
    from stiction.sources.table import RawTable

__all__ = ["Loops", "find_loops", "read"]


def read(
    source: str | os.PathLike[str] | BinaryIO | Any,
    *,
    dt: float | None = None,
    tag: str | None = None,
    columns: Mapping[str, str | int] | Sequence[str] | None = None,
    loop_type: str | None = None,
    map: str | os.PathLike[str] | None = None,  # noqa: A002 (the option of the command line has this name)
    sheet: str | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    time_format: str | None = None,
    day_first: bool | None = None,
    timezone: str | None = None,
    op_range: tuple[float, float] | None = None,
    mv_range: tuple[float, float] | None = None,
    align: str | None = None,
    max_gap: float | None = None,
    max_bytes: int = MAX_BYTES,
    query: str | None = None,
    table: str | None = None,
    time: str | None = None,
    value: str | None = None,
    quality: str | None = None,
    tag_column: str | None = None,
    tags: Sequence[str] | None = None,
    since: datetime | str | float | None = None,
    until: datetime | str | float | None = None,
) -> list[LoopRecord]:
    """Read every control loop of a source.

    Parameters
    ----------
    source : str, path, binary file or data frame
        A file (CSV and other text, Excel, Parquet, Feather or Arrow, MATLAB; also compressed as gz, zst or zip), a
        folder or a pattern such as ``"data/*.csv"`` (the files may each hold one tag), "-" for the standard input, a
        frame of pandas, polars or pyarrow, or the URL of a database (``postgresql+psycopg://...``).
    dt : float, optional
        Sampling period [s]; the median step of the time stamps when not given. Stamps that do not fit it are not used:
        the rows are then `dt` apart.
    tag : str, optional
        The only loop to read; the name of the loop when the source names none.
    columns : mapping, optional
        Signal (time, pv, sp, op, mv, valve_signal, mode, bad, quality) -> column name, or number from 0; the other
        signals are found by name. With a database also a sequence of the only columns to read.
    loop_type : str, optional
        flow, level, pressure, temperature, analyser (or concentration) or other; by the tag when not given.
    map : path, optional
        A mapping file that settles tag, loop, role and unit of every column (`stiction read --write-map` writes one).
    sheet : str, optional
        Sheet of a workbook; all by default.
    delimiter, decimal : str, optional
        How a text is written; found when not given.
    time_format : str, optional
        A `datetime.strptime` format.
    day_first : bool, optional
        Whether 01/02/2026 is the first of February; found when not given.
    timezone : str, optional
        Time zone of stamps without one, such as "Europe/Berlin".
    op_range, mv_range : pair of float, optional
        OP, or the valve position, at 0 and at 100 % of span [unit of the column].
    align : {"last", "interpolate"}, optional
        How a PV with time stamps of its own goes on the common clock; the last value by default.
    max_gap : float, optional
        Longest time over which a value is held or interpolated [s].
    max_bytes : int
        Size of a file after decompression up to which it is read [bytes].
    query, table : str, optional
        Of a database: a SELECT, or the name of a table or view.
    time, tag_column, value, quality : str, optional
        Columns of a long database table; of a wide one, `time`.
    tags : sequence of str, optional
        Of a database: the only loops to read.
    since, until : datetime or str or float, optional
        Of a database: first time, and the time before which the rows end.

    Returns
    -------
    list of LoopRecord
        One for each loop, evenly sampled. All assumptions stand in ``record.provenance.assumptions``.

    Raises
    ------
    RecordError
        When the source cannot be read as loops: what, where and the remedy.
    ParameterError
        When an option is outside its limits.

    Examples
    --------
    >>> import io
    >>> import stiction as st
    >>> lines = ["time_s,FIC-101.PV,FIC-101.OP", *(f"{k},{50 + k % 5},{40 + k % 7}" for k in range(60))]
    >>> [record] = st.read(io.BytesIO(chr(10).join(lines).encode()))
    >>> record.tag, record.loop_type, record.dt, len(record)
    ('FIC-101', 'flow', 1.0, 60)
    """
    database = {
        "query": query, "table": table, "time": time, "tag": tag_column, "value": value, "quality": quality,
        "tags": tags, "since": since, "until": until,
    }  # fmt: skip
    if columns is not None and not isinstance(columns, Mapping):
        if isinstance(columns, str) or not isinstance(columns, Sequence):
            raise ParameterError(
                f"columns = {columns!r} is no mapping of signals to columns; give for example columns={{'op': 'CO'}}."
            )
        database["columns"], columns = columns, None
    options = ReadOptions(
        dt=dt, tag=tag, columns=dict(columns or {}), loop_type=loop_type, map=map, sheet=sheet, delimiter=delimiter,
        decimal=decimal, time_format=time_format, day_first=day_first, timezone=timezone, op_range=op_range,
        mv_range=mv_range, align=align, max_gap=max_gap, max_bytes=max_bytes,
    )  # fmt: skip
    return find_loops(source, options, **{name: value for name, value in database.items() if value is not None}).read()


@dataclass(eq=False)
class Loops:
    """The loops of a source, found but not yet read."""

    roles: list[LoopRoles]
    """The columns of each loop; empty when `records` holds them."""
    options: ReadOptions
    """Options of the source."""
    records: list[LoopRecord] | None = None
    """Loops that were stored as records (`LoopRecord.to_parquet`)."""

    def read(self) -> list[LoopRecord]:
        """Read all loops.

        Raises
        ------
        RecordError
            When none can be read. A loop that cannot, while others can, is an assumption of the others.
        """
        if self.records is not None:
            return self.records
        _load_columns(self.roles)
        builder = RecordBuilder(self.options)
        records, failures = [], []
        for loop in self.roles:
            try:
                records.append(builder.build(loop))
            except RecordError as error:
                if len(self.roles) == 1:
                    raise
                failures.append(error)
        if not records:
            raise failures[0]
        return _with_notes(_linked(records, self.roles), tuple(f"Left out: {error}" for error in failures))


def find_loops(source: Any, options: ReadOptions, **database: Any) -> Loops:
    """Find the loops of a source without reading their signals, as far as its format allows.

    Parameters
    ----------
    source : str, path, binary file or data frame
        As in `read`.
    options : ReadOptions
        What the user said about the source.
    **database
        Arguments of `stiction.sources.sql.read_database`.

    Returns
    -------
    Loops
        The loops.
    """
    from stiction.sources.layouts import read_layout
    from stiction.sources.roles.assign import assign_roles
    from stiction.sources.roles.map_file import read_map

    tables, records = _tables(source, options, database)
    if records is not None:
        return Loops([], options, records)
    rows = None if options.map is None else read_map(options.map)
    return Loops(assign_roles(read_layout(tables, options), options, rows), options)


def _tables(
    source: Any, options: ReadOptions, database: dict[str, Any]
) -> tuple[list[RawTable], list[LoopRecord] | None]:
    """Open a source: its tables, or its records when it holds records."""
    if _is_database_url(source):
        from stiction.sources.sql import read_database

        columns = {k: v for k, v in options.columns.items() if isinstance(v, str)}
        given = {"columns": list(columns.values())} if columns and "table" in database else {}
        return read_database(source, max_bytes=options.max_bytes, **{**given, **database}), None
    if database:
        names = ", ".join(sorted(database))
        raise ParameterError(f"{names}: only for a database; {source!r} is no database URL such as sqlite:///plant.db.")
    if _is_path(source) or hasattr(source, "read"):
        return _file_tables(source, options)
    from stiction.sources.frame import frame_to_table, is_frame

    if is_frame(source):
        return [frame_to_table(source)], None
    raise RecordError(
        f"cannot read {type(source).__name__} as a record; give a file name, an open binary file, a data frame or a "
        "database URL."
    )


def _is_path(source: object) -> bool:
    return isinstance(source, (str, os.PathLike))


def _is_database_url(source: object) -> bool:
    return isinstance(source, str) and "://" in source and not source.startswith("file:")


def _file_tables(source: Any, options: ReadOptions) -> tuple[list[RawTable], list[LoopRecord] | None]:
    from stiction.records.parquet_records import read_parquet_records
    from stiction.sources.byte_source import open_sources
    from stiction.sources.formats import parquet, read_format

    paths = _files(source) if _is_path(source) and source != "-" else [source]
    sources = [one for path in paths for one in open_sources(path, options)]
    if all(parquet.recognises(one.head, one.origin.name) for one in sources):
        stored = [read_parquet_records(one.path, options.tag if len(sources) == 1 else None) for one in sources]
        if all(records is not None for records in stored):
            return [], [record for records in stored for record in records or ()]
        if len(sources) > 1:
            return parquet.read_data_set(sources, options), None
    tables = [table for one in sources for table in read_format(one, options)]
    return tables, None


def _files(source: str | os.PathLike[str]) -> list[str]:
    """The files of a path, a folder or a pattern."""
    text = os.fspath(source)
    if os.path.isdir(text):
        files = sorted(str(path) for path in Path(text).iterdir() if path.is_file() and not path.name.startswith("."))
        if not files:
            raise RecordError(f"{text}: is a folder without files; name the folder that holds the exports.")
        return files
    if has_magic(text) and not os.path.exists(text):
        files = sorted(path for path in glob(text, recursive=True) if os.path.isfile(path))
        if not files:
            raise RecordError(f"{text}: no file matches this pattern; check the folder and the spelling.")
        return files
    return [text]


def _load_columns(loops: list[LoopRoles]) -> None:
    """Read the columns of all loops, in one pass for each table."""
    wanted: dict[int, tuple[RawTable, set[int]]] = {}
    for loop in loops:
        for column in loop.roles.values():
            if column.position is not None:
                wanted.setdefault(id(column.table), (column.table, set()))[1].add(column.position)
    for table, positions in wanted.values():
        table.load(positions)


def _linked(records: list[LoopRecord], loops: list[LoopRoles]) -> list[LoopRecord]:
    """Name in each record the loop whose set point its OP is."""
    if len(records) < 2:
        return records
    from stiction.sources.roles.cascade import find_secondary_tags

    masters = {loop.tag: loop.master for loop in loops if loop.master}
    found = find_secondary_tags(records, masters)
    return [
        replace(record, provenance=replace(record.provenance, secondary_tag=name)) if name else record
        for record, name in zip(records, found, strict=True)
    ]


def _with_notes(records: list[LoopRecord], notes: tuple[str, ...]) -> list[LoopRecord]:
    if not notes:
        return records
    return [
        replace(one, provenance=replace(one.provenance, assumptions=(*one.provenance.assumptions, *notes)))
        for one in records
    ]
