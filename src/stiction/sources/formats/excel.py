"""Excel and OpenDocument workbooks: xlsx, xlsm, xlsb, xls, ods; each sheet that holds a table is one."""

from __future__ import annotations

import datetime as dt
import re
from dataclasses import replace
from io import BytesIO
from typing import TYPE_CHECKING, Any

import polars as pl

from stiction.errors import ParameterError, RecordError
from stiction.foreign_errors import damage_refused
from stiction.sources.formats.table_rows import table_from_rows
from stiction.sources.formats.workbook_checks import (
    OLE_START,
    REMEDY,
    require_area,
    require_size,
    require_survivable,
)
from stiction.sources.table import SNIFF_ROWS
from stiction.sources.typed_table import make_series

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.sources.byte_source import ByteSource
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import Origin, RawTable

__all__ = ["read", "recognises"]

ZIP_MEMBERS = re.compile(rb"\[Content_Types\]\.xml|xl/workbook|xl/_rels|opendocument\.spreadsheet")
"""What the first members of a zipped workbook are called; an OpenDocument one begins with its type."""
ENCRYPTED = "EncryptedPackage".encode("utf-16-le")
"""Name of the stream of an encrypted workbook."""
DEFAULT_SHEET_NAME = re.compile(r"(sheet|tabelle|feuil|hoja|foglio|blad|planilha|ark|taul)\s*\d*", re.IGNORECASE)
"""Sheet names that say nothing about the loop."""


def recognises(head: bytes, name: str) -> bool:
    """Whether a file is a workbook, by its first bytes and its name."""
    workbook_name = name.lower().endswith((".xlsx", ".xlsm", ".xlsb", ".xls", ".ods"))
    if head.startswith(b"PK"):
        return workbook_name or bool(ZIP_MEMBERS.search(head))
    return head.startswith(OLE_START)


def read(source: ByteSource, options: ReadOptions) -> list[RawTable]:
    """Read the visible sheets that hold a table, or `options.sheet`; of several, each is named after its sheet."""
    from python_calamine import CalamineWorkbook, PasswordError, SheetTypeEnum, SheetVisibleEnum

    name, content = source.origin.name, source.path.read_bytes()
    encrypted = RecordError("is encrypted; save it without a password.", where=name)
    if ENCRYPTED in content:
        raise encrypted
    require_size(source)
    with damage_refused(name, REMEDY):
        if not source.head.startswith(b"PK") or b"opendocument" in source.head[:128] or name.lower().endswith(".xlsb"):
            require_survivable(source)
        try:
            book = CalamineWorkbook.from_filelike(BytesIO(content))  # by content, not by name
        except PasswordError:
            raise encrypted from None
        visible = [
            sheet.name
            for sheet in book.sheets_metadata
            if sheet.typ == SheetTypeEnum.WorkSheet and (sheet.visible == SheetVisibleEnum.Visible or options.sheet)
        ]
        names = visible if options.sheet is None else [_sheet_named(options.sheet, visible, name)]
        sheets = [(sheet, *_rows_of(book.get_sheet_by_name(sheet), source)) for sheet in names]
    tables = [table for sheet in sheets if (table := _make_table(source.origin, *sheet, options)) is not None]
    if not tables:
        raise RecordError("no sheet contains a table of numbers; write one row per time, with a header.", where=name)
    if len(tables) == 1 and (options.sheet is None or DEFAULT_SHEET_NAME.fullmatch(options.sheet)):
        tables[0].origin = replace(tables[0].origin, stem=source.origin.stem)
    return tables


def _make_table(
    origin: Origin, sheet: str, rows: list[list[Any]], lines: list[int], options: ReadOptions
) -> RawTable | None:
    """Find where the table of a sheet begins; None where there is none."""
    head = [_head_row(row) for row in rows[:SNIFF_ROWS]]
    table = table_from_rows(replace(origin, name=f"{origin.name}, sheet {sheet}", stem=sheet), head, options)
    if table is None:
        return None
    first = table.first_line - 1
    table.first_line = lines[first]

    def read_columns(positions: Sequence[int]) -> pl.DataFrame:
        return pl.DataFrame({str(k): _make_column([row[k] for row in rows[first:]]) for k in positions})

    table.reader = read_columns
    return table


def _sheet_named(asked: str, names: Sequence[str], file: str) -> str:
    for name in names:
        if name.strip().casefold() == asked.strip().casefold():
            return name
    raise ParameterError(f"has no sheet {asked!r}; give one of {', '.join(names[:10])}.", where=file)


def _rows_of(sheet: Any, source: ByteSource) -> tuple[list[list[Any]], list[int]]:
    """Give the rows of a sheet that hold anything, and their numbers (from 1)."""
    require_area(source, sheet.height, sheet.width)
    rows = sheet.to_python()
    offset = (sheet.start or (0, 0))[0] + 1
    written = [k for k, row in enumerate(rows) if any(cell != "" for cell in row)]
    return [rows[k] for k in written], [k + offset for k in written]


def _make_column(cells: list[Any]) -> pl.Series:
    """Make a column of the cells of a sheet: numbers, times, durations or text."""
    kinds = {type(cell) for cell in cells if cell != ""}
    if kinds <= {dt.datetime, dt.date} or kinds <= {int, float, dt.timedelta}:  # midnight comes as a date
        return make_series([None if cell == "" else cell for cell in cells])
    return pl.Series([_as_text(cell) for cell in cells], dtype=pl.String)


def _head_row(row: list[Any]) -> list[str]:
    """Give a row as text; a title, without numbers, ends at its last cell that is written."""
    texts = [_as_text(cell) for cell in row]
    if all(isinstance(cell, str) for cell in row):
        del texts[max((k + 1 for k, text in enumerate(texts) if text), default=0) :]
    return texts


def _as_text(cell: Any) -> str:
    """Give a cell as text: numbers so that they are read back exactly, ISO 8601 times."""
    if isinstance(cell, str):
        return cell.strip()
    if isinstance(cell, bool):
        return "TRUE" if cell else "FALSE"
    if isinstance(cell, float):
        return str(int(cell)) if cell.is_integer() and abs(cell) < 1e15 else repr(cell)
    if type(cell) is dt.date:
        return f"{cell} 00:00:00"
    if isinstance(cell, dt.timedelta):
        return repr(cell.total_seconds())
    return str(cell)
