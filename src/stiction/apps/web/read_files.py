"""Reading of files in a worker: their loops as records, what was assumed, and the columns to correct."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from stiction.errors import RecordError, Setting

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.sources.loops import Loops
    from stiction.sources.table import TagColumn

__all__ = ["MAP_COLUMNS", "map_as_csv", "page_text", "read_files"]

MAX_PREVIEWS = 60
"""Columns of a source of which a preview is drawn [-]."""
PREVIEW_POINTS = 120
"""Points of a preview [-]."""
MAX_COLUMNS = 20_000
"""Columns of a source above which it is refused [-]."""
MAP_COLUMNS = ("tag", "loop", "role", "unit", "low", "high", "area", "master", "importance")
"""Columns of a map, in the order of its file."""
OPTIONS = {
    "columns": "the table of columns",
    "dt": "the sampling period",
    "time_format": "the format of the time",
    "day_first": "day first",
    "timezone": "the time zone",
    "delimiter": "the delimiter",
    "decimal": "the decimal mark",
    "op_range": "the range of OP",
    "sheet": "the sheet",
    "map": "the table of columns",
}
"""Option of the reader -> its name on the page."""


class _NamedFile:
    """A stored file under the name that the user gave it; it is open only while it is read."""

    def __init__(self, path: str, name: str) -> None:
        self.name = name
        self._path = path
        self._file: BinaryIO | None = None

    def read(self, size: int) -> bytes:
        """Return the next bytes; after the end the file is read from its start again."""
        self._file = self._file or Path(self._path).open("rb")  # noqa: SIM115 (closed at the end)
        chunk = self._file.read(size)
        if not chunk:
            self._file.close()
            self._file = None
        return chunk


def read_files(
    files: Sequence[tuple[str, str]],
    options: dict[str, Any],
    map_rows: Sequence[dict[str, str]] | None,
    folder: str,
    max_bytes: int,
) -> dict[str, Any]:
    """Read files together as one source and write the record of each loop into a folder.

    Parameters
    ----------
    files : sequence of (str, str)
        Path of each file and the name to show.
    options : dict
        Options of `stiction.read`.
    map_rows : sequence of dict, optional
        Corrected columns: tag, loop, role, unit and so on; those without a role are not used.
    folder : str
        Existing folder for the records.
    max_bytes : int
        Size of a file after decompression up to which it is read [bytes].

    Returns
    -------
    dict
        `error` (text or None), `loops` (summary of each, with `path` of its record), `failures` (texts), `assumptions`,
        `columns`.
    """
    from stiction.sources import open_loops

    sources = [path if path == name else _NamedFile(path, name) for path, name in files]
    target = Path(folder)
    chosen = {**options, "max_bytes": max_bytes}
    answer: dict[str, Any] = {"error": None, "loops": [], "failures": [], "assumptions": [], "columns": []}
    try:
        if map_rows is not None:
            chosen["map"] = _write_map(map_rows, target)
        loops = open_loops(sources if len(sources) > 1 else sources[0], **chosen)
        answer |= _read(loops, target)
        answer["columns"] = _list_columns(loops)
    except RecordError as error:
        of_map = "map" in chosen and error.where.startswith(chosen["map"])
        answer["error"] = error.text(page_text, "Table of columns" if of_map else error.file_name)
        answer["columns"] = _columns_without_loop(sources, options, max_bytes)
    return answer


def _list_columns(loops: Loops) -> list[dict[str, Any]]:
    """Rows of the table of columns: each column of the source with its use."""
    if len(loops.columns) > MAX_COLUMNS:
        raise RecordError(
            f"The source has {len(loops.columns)} columns; at most {MAX_COLUMNS} can be read. Split the file."
        )
    used: dict[int, dict[str, Any]] = {}
    for loop in loops.roles:
        for role, column in loop.roles.items():
            low, high = loop.spans.get(role, ("", ""))
            use = {
                "loop": loop.tag or column.table.origin.stem, "role": role, "unit": loop.unit_of(role), "low": low,
                "high": high, "area": loop.area, "master": loop.master, "importance": loop.importance,
            }  # fmt: skip
            used |= dict.fromkeys((id(part) for part in column.parts or (column,)), use)
    return [_describe(column, k, used.get(id(column))) for k, column in enumerate(loops.columns)]


def _columns_without_loop(sources: list[Any], options: dict[str, Any], max_bytes: int) -> list[dict[str, Any]]:
    """Columns of a source in which no loop was found; none when it cannot be read as a table."""
    from stiction.sources.byte_source import open_files
    from stiction.sources.formats import read_format
    from stiction.sources.layouts import read_layout
    from stiction.sources.options import ReadOptions

    try:
        chosen = ReadOptions(**options, max_bytes=max_bytes)
        tables = [table for file in open_files(sources, chosen) for table in read_format(file, chosen)]
        return [_describe(column, k, None) for k, column in enumerate(read_layout(tables, chosen))]
    except RecordError:
        return []


def _describe(column: TagColumn, k: int, use: dict[str, Any] | None) -> dict[str, Any]:
    """One row of the table of columns."""
    row: dict[str, Any] = {"tag": column.name, "description": column.description, **dict.fromkeys(MAP_COLUMNS[1:], "")}
    row |= use or {"unit": column.unit}
    row["preview"] = _preview(column) if k < MAX_PREVIEWS else []
    return row


def _preview(column: TagColumn) -> list[float | None]:
    """Some values of a column; empty when it holds no numbers."""
    import numpy as np
    import polars as pl

    from stiction.apps.web.trend_data import thin_values

    try:
        values = column.cells.cast(pl.Float64, strict=False).to_numpy()
    except (pl.exceptions.PolarsError, RecordError):
        return []
    return [] if not np.isfinite(values).any() else thin_values(values, PREVIEW_POINTS)


def _read(loops: Loops, folder: Path) -> dict[str, Any]:
    """Write the records and summarise them."""
    from stiction.records import summarise
    from stiction.records.parquet_writer import to_parquet

    records, failures = loops.read_all()
    if not records and failures:
        raise failures[0].error
    areas = {loop.tag: loop.area for loop in loops.roles}
    summary = summarise(records).to_dict()
    for k, (record, entry) in enumerate(zip(records, summary["loops"], strict=True)):
        path = folder / f"{k}.parquet"
        to_parquet(record, path)
        entry |= {"path": str(path), "area": areas.get(record.tag, "")}
    reasons = [error.text(page_text) if isinstance(error, RecordError) else str(error) for _, _, error in failures]
    return {"loops": summary["loops"], "assumptions": summary["assumptions"], "failures": reasons}


def _write_map(rows: Sequence[dict[str, str]], folder: Path) -> str:
    path = folder / "map.csv"
    path.write_text(map_as_csv(rows), encoding="utf-8")
    return str(path)


def map_as_csv(rows: Sequence[dict[str, str]]) -> str:
    r"""Return the columns that have a role as the text of a mapping file.

    Examples
    --------
    >>> map_as_csv([{"tag": "CO1", "loop": "FIC-101", "role": "op"}, {"tag": "X", "loop": "", "role": ""}])
    'tag,loop,role,unit,low,high,area,master,importance\nCO1,FIC-101,op,,,,,,\n'
    """
    import csv

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(MAP_COLUMNS)
    for row in rows:
        if str(row.get("role", "")).strip():
            writer.writerow([_one_line(row.get(name, "")) for name in MAP_COLUMNS])
    return text.getvalue()


def _one_line(value: object) -> str:
    return " ".join(str(value).split())


def page_text(setting: Setting) -> str:
    """Return a setting of a message by its name on the page.

    Examples
    --------
    >>> page_text(Setting("columns", {"pv": None, "op": None})), page_text(Setting("dt"))
    ('the table of columns', 'the sampling period')
    """
    return OPTIONS.get(setting.name, setting.name)
