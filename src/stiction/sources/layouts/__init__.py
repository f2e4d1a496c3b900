"""How the tags of a source are arranged in its tables: one page for each layout."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from stiction.sources.layouts import (
    long_table,
    one_tag,
    stacked_loops,
    stacked_tags,
    tags_in_rows,
    time_value_pairs,
    wide,
)
from stiction.sources.layouts.pieces import join_pieces

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable
    from stiction.sources.tag_column import TagColumn

__all__ = ["LAYOUTS", "Layout", "read_layout", "register_layout"]


class Layout(Protocol):
    """A page, or any object, that reads one layout."""

    def recognises(self, table: RawTable, options: ReadOptions) -> bool:
        """Whether this layout can read the table."""
        ...

    def read(self, table: RawTable, options: ReadOptions) -> list[TagColumn]:
        """Give the columns of the table that are not time."""
        ...


LAYOUTS: list[Layout] = [
    tags_in_rows,
    stacked_tags,
    time_value_pairs,
    stacked_loops,
    long_table,
    one_tag,
    wide,
]
"""Layouts in the order in which they are tried; the last one reads every table."""


def register_layout(layout: Layout) -> None:
    """Add a layout; it is tried before all others.

    Parameters
    ----------
    layout : module or object
        Has the functions ``recognises(table, options)`` and ``read(table, options)``.

    Examples
    --------
    >>> from stiction.sources.layouts import LAYOUTS, register_layout, wide
    >>> register_layout(wide)
    >>> LAYOUTS.pop(0) is wide
    True
    """
    LAYOUTS.insert(0, layout)


def read_layout(tables: Sequence[RawTable], options: ReadOptions) -> list[TagColumn]:
    """Give all columns of the tables of a source that are not time.

    Parameters
    ----------
    tables : sequence of RawTable
        The tables: one file, the files of a folder or an archive, or the sheets of a workbook.
    options : ReadOptions
        What the user said about the source.

    Returns
    -------
    list of TagColumn
        In the order of the source. Columns with the same clock have the same rows; the columns of one loop may come
        from several tables.

    Raises
    ------
    RecordError
        When a table cannot be read: what, where and the remedy.

    Examples
    --------
    >>> import polars as pl
    >>> from stiction.sources.options import ReadOptions
    >>> from stiction.sources.table import Origin, RawTable
    >>> rows = [[f"FIC-1.{word}", f"2026-02-01 10:00:0{k}", f"{k}.5"] for k in range(3) for word in ("PV", "OP")]
    >>> frame = pl.DataFrame(rows, schema=["a", "b", "c"], orient="row")
    >>> table = RawTable(Origin("x.csv", "x"), [["Tag", "Time", "Value"]], rows, 3, lambda i: frame[:, i])
    >>> [(column.name, column.cells.to_list()) for column in read_layout([table], ReadOptions())]
    [('FIC-1.PV', ['0.5', '1.5', '2.5']), ('FIC-1.OP', ['0.5', '1.5', '2.5'])]
    """
    columns: list[TagColumn] = []
    for table in join_pieces(tables):
        layout = next(layout for layout in LAYOUTS if layout.recognises(table, options))
        columns += layout.read(table, options)
    return columns
