"""The rows of an audit as CSV, Parquet and Excel files."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError

if TYPE_CHECKING:
    from pathlib import Path

    import polars as pl

    from stiction.fleet.audit_result import Audit

__all__ = ["write_exports"]


def write_exports(audit: Audit, folder: Path | None = None) -> list[Path]:
    """Write `loops.csv`, `loops.parquet` and `loops.xlsx`.

    Parameters
    ----------
    audit : Audit
        The audit.
    folder : Path, optional
        Where to; the folder `exports` of the audit when not given.

    Returns
    -------
    list of Path
        The files. A text that begins as a formula has an apostrophe before it in the CSV file, and is stored as text in
        the Excel file.

    Raises
    ------
    RecordError
        When a file cannot be written; the old one stays.
    """
    folder = folder or audit.folder / "exports"
    labels = audit.labels()
    frame = audit.to_frame()
    if frame.height:
        import polars as pl

        tags = frame["tag"].to_list()
        frame = frame.with_columns(
            pl.Series("label", [labels[tag].label if tag in labels else "" for tag in tags]),
            pl.Series("note", [labels[tag].note if tag in labels else "" for tag in tags]),
        )
    writers = {
        "loops.csv": lambda path: _without_formulas(frame).write_csv(path),
        "loops.parquet": lambda path: frame.write_parquet(path),
        "loops.xlsx": lambda path: _write_excel(frame, path),
    }
    written = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, write in writers.items():
            part = folder / f".{os.getpid()}.{name}"
            try:
                write(part)
                os.replace(part, folder / name)
            finally:
                part.unlink(missing_ok=True)
            written.append(folder / name)
    except OSError as error:
        reason = error.strerror or error
        raise RecordError(
            f"the exports cannot be written ({reason}); check the access rights and the free space.", where=folder
        ) from None
    return written


def _without_formulas(frame: pl.DataFrame) -> pl.DataFrame:
    """Put an apostrophe before each text that a spreadsheet would take for a formula."""
    import polars as pl

    text = pl.col(pl.String)
    return frame.with_columns(text.str.replace(r"^([=+\-@\t\r])", "'${1}"))


def _write_excel(frame: pl.DataFrame, path: Path) -> None:
    import xlsxwriter

    options = {"constant_memory": True, "strings_to_formulas": False, "strings_to_urls": False, "in_memory": False}
    with xlsxwriter.Workbook(str(path), options) as book:
        sheet = book.add_worksheet("Loops")
        head = book.add_format({"bold": True, "text_wrap": True, "valign": "top", "bottom": 1})
        for k, name in enumerate(frame.columns):
            sheet.set_column(k, k, {"tag": 24, "reason": 60, "action": 60}.get(name, 13))
            sheet.write_string(0, k, name.replace("_", " "), head)
        for number, row in enumerate(frame.iter_rows(), 1):
            for k, value in enumerate(row):
                _write_cell(sheet, number, k, value)
        sheet.freeze_panes(1, 1)
        if frame.height:
            sheet.autofilter(0, 0, frame.height, frame.width - 1)
            for name in ("priority", "probability", "severity"):
                k = frame.columns.index(name)
                colours = {"type": "2_color_scale", "min_color": "#FFFFFF", "max_color": "#E0776B"}
                sheet.conditional_format(1, k, frame.height, k, colours)


def _write_cell(sheet: Any, row: int, column: int, value: Any) -> None:
    if value is None:
        return
    if isinstance(value, bool):
        sheet.write_boolean(row, column, value)
    elif isinstance(value, (int, float)):
        sheet.write_number(row, column, value)
    else:
        sheet.write_string(row, column, str(value)[:32767])
