"""Export of a table as the page shows it, in a worker."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

from stiction.errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["FORMATS", "export_table"]

FORMATS = {
    "csv": "text/csv; charset=utf-8",
    "xlsx": "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
    "parquet": "application/vnd.apache.parquet",
}
"""Format -> media type."""


def export_table(kind: str, columns: Sequence[dict[str, str]], rows: Sequence[Sequence[Any]]) -> bytes:
    r"""Write a table.

    `columns`: `name`, and `type`: "number" or "text". `rows`: cells in the order of the columns; None is empty. Raises
    ParameterError when a row has another number of cells than there are columns, or a number is none.

    Examples
    --------
    >>> export_table("csv", [{"name": "Loop", "type": "text"}, {"name": "S", "type": "number"}], [["=A1", 2.5]])
    b"Loop,S\n'=A1,2.5\n"
    """
    import polars as pl

    from stiction.fleet.exports import write_table

    if any(len(row) != len(columns) for row in rows):
        raise ParameterError("The table has rows of different length; load the page again.")
    series = []
    for k, column in enumerate(columns):
        cells = [row[k] for row in rows]
        if column.get("type") == "number":
            if any(not isinstance(cell, (int, float, type(None))) for cell in cells):
                raise ParameterError(
                    f"The column {column.get('name')} contains a text among its numbers; load the page again."
                )
            series.append(pl.Series(str(column["name"]), cells, dtype=pl.Float64, strict=False))
        else:
            texts = [None if cell is None else str(cell) for cell in cells]
            series.append(pl.Series(str(column["name"]), texts, dtype=pl.String))
    file = io.BytesIO()
    write_table(pl.DataFrame(series), kind, file)
    return file.getvalue()
