"""The rows of an audit as CSV, Parquet and Excel files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError

if TYPE_CHECKING:
    from io import BytesIO

    import polars as pl

    from stiction.fleet.audit_result import Audit

__all__ = ["write_exports", "write_table"]

WIDTHS = {"reason": 420, "action": 420, "next_step": 420, "finding": 230, "priority_reason": 320, "tag": 140}
"""Width of a column of a workbook [pixels]; 100 of others."""
MAX_CELL = 32767
"""Characters that a cell of a workbook can hold [-]."""


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
    written = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for kind in ("csv", "parquet", "xlsx"):
            part, target = folder / f".{os.getpid()}.loops.{kind}", folder / f"loops.{kind}"
            try:
                write_table(frame, kind, part)
                os.replace(part, target)
            finally:
                part.unlink(missing_ok=True)
            written.append(target)
    except OSError as error:
        reason = error.strerror or error
        raise RecordError(
            f"the exports cannot be written ({reason}); check the access rights and the free space.", where=folder
        ) from None
    return written


def write_table(frame: pl.DataFrame, kind: str, target: Path | BytesIO) -> None:
    """Write a table of loops as "csv", "parquet" or "xlsx"; no text in it becomes a formula or a link."""
    import polars as pl

    if kind == "parquet":
        frame.write_parquet(target)
    elif kind == "csv":
        text = pl.col(pl.String)
        frame.with_columns(text.str.replace(r"^([=+\-@\t\r])", "'${1}")).write_csv(target)
    else:
        _write_excel(frame, target)


def _write_excel(frame: pl.DataFrame, target: Path | BytesIO) -> None:
    import polars as pl
    import xlsxwriter

    frame = frame.drop("finding", strict=False).rename({"finding_text": "finding"}, strict=False)
    names = {name: name.replace("_", " ") for name in frame.columns}
    colours = {"type": "2_color_scale", "min_color": "#FFFFFF", "max_color": "#E0776B"}
    coloured = [name for name in ("priority", "probability", "severity") if name in names and frame.height]
    widths: Any = {head: WIDTHS.get(name, 100) for name, head in names.items()}
    options = {"strings_to_formulas": False, "strings_to_urls": False, "in_memory": not isinstance(target, Path)}
    with xlsxwriter.Workbook(str(target) if isinstance(target, Path) else target, options) as book:
        frame.rename(names).with_columns(pl.col(pl.String).str.head(MAX_CELL)).write_excel(
            book,
            "Loops",
            column_widths=widths,
            conditional_formats=dict.fromkeys(coloured, colours),
            float_precision=6,
            freeze_panes=(1, 1),
        )
