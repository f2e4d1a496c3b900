"""`read`: from a file, folder, frame or database to the records of its loops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any, BinaryIO

from stiction.errors import ParameterError
from stiction.records.record_list import Records
from stiction.sources.find_loops import find_loops
from stiction.sources.options import MAX_BYTES, ReadOptions

if TYPE_CHECKING:
    import os
    from datetime import datetime

    from stiction.sources.loops import Loops

__all__ = ["open_loops", "read"]

_DATABASE = {name: name for name in ("query", "table", "time", "value", "quality", "tags", "since", "until")}
_DATABASE["tag_column"] = "tag"
"""Option of `read` -> argument of `read_database`."""


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
    max_memory: str | int | None = None,
    good_codes: str | Sequence[str | int] | None = None,
    keep_uncertain: bool = False,
    query: str | None = None,
    table: str | None = None,
    time: str | None = None,
    value: str | None = None,
    quality: str | None = None,
    tag_column: str | None = None,
    tags: Sequence[str] | None = None,
    since: datetime | str | float | None = None,
    until: datetime | str | float | None = None,
) -> Records:
    """Read every control loop of a source.

    Parameters
    ----------
    source : str, path, binary file, data frame or list of files
        A file (CSV and other text, Excel, Parquet, Feather or Arrow, MATLAB; also compressed as gz, zst or zip), a
        folder, a pattern such as ``"data/*.csv"`` or a list of files (which may each hold one tag), "-" for the
        standard input, a frame of pandas, polars or pyarrow, or the URL of a database (``postgresql+psycopg://...``),
        an OPC UA server (``opc.tcp://host:4840``) or a PI Web API (``pi+https://host/piwebapi``).
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
        Size of a file after decompression up to which it is read [bytes]; of Parquet and Arrow, of the columns read.
    max_memory : str or int, optional
        Memory that the reading of a loop may take [bytes], also as "2GB"; half of the machine when not given. Of a
        longer Parquet or Arrow file the last rows are read.
    good_codes : str or sequence, optional
        Codes of the quality columns that are good [-], such as "0,4"; all others are bad. By the vendors' schemes when
        not given.
    keep_uncertain : bool
        Whether values of uncertain quality are used; they are missing by default.
    query, table : str, optional
        Of a database: a SELECT, or the name of a table or view.
    time, tag_column, value, quality : str, optional
        Columns of a long database table; of a wide one, `time`.
    tags : sequence of str, optional
        Of a database or historian: the only loops to read, of a historian also as patterns such as ``"FIC*"``.
    since, until : datetime or str or float, optional
        Of a database or historian: first time, and the time before which the rows end [unit of the time column; a text
        as ISO 8601].

    Returns
    -------
    Records
        A list with a record for each loop, evenly sampled; a tag is an index too. All assumptions stand in
        ``record.provenance.assumptions``.

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
    options = dict(locals())
    return Records(open_loops(**options).read())


def open_loops(source: Any, **options: Any) -> Loops:
    """Find the loops of a source by the options of `read`, with its errors, and read their signals later.

    >>> import io
    >>> lines = ["time_s,FIC-101.PV,FIC-101.OP", *(f"{k},{50 + k % 5},{40 + k % 7}" for k in range(60))]
    >>> loops = open_loops(io.BytesIO(chr(10).join(lines).encode()))
    >>> loops.tags, len(loops.read_one(0))
    (['FIC-101'], 60)
    """
    chosen = {name: value for name, value in options.items() if value is not None}
    if unknown := chosen.keys() - _DATABASE.keys() - {one.name for one in fields(ReadOptions)}:
        raise ParameterError(
            f"{', '.join(sorted(unknown))} is not an option of stiction.read; see help(stiction.read)."
        )
    database = {_DATABASE[name]: chosen.pop(name) for name in list(chosen) if name in _DATABASE}
    columns: Any = chosen.pop("columns", {})
    if isinstance(columns, Sequence) and not isinstance(columns, str):
        database["columns"] = columns
    else:
        chosen["columns"] = columns
    return find_loops(source, ReadOptions(**chosen), **database)
