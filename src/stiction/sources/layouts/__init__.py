"""How the tags of a source are arranged in its tables: one page for each layout."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

import polars as pl

from stiction.display.number_format import list_first
from stiction.sources.layouts import (
    long_table,
    one_tag,
    stacked_loops,
    stacked_tags,
    tags_in_rows,
    time_value_pairs,
    wide,
)
from stiction.sources.layouts.aggregates import take_averages
from stiction.sources.layouts.headings import parse_role, table_headings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable, TagColumn

__all__ = ["LAYOUTS", "Layout", "read_layout", "register_layout"]


class Layout(Protocol):
    """A page, or any object, that reads one layout."""

    def read(self, table: RawTable, options: ReadOptions) -> list[TagColumn] | None:
        """Give the columns of the table that are not time; None where it has another layout."""
        ...


LAYOUTS: list[Layout] = [tags_in_rows, stacked_tags, time_value_pairs, stacked_loops, long_table, one_tag, wide]
"""Layouts in the order in which they are tried; the last one reads every table."""
MAX_LISTED = 5
"""Tables that a note names [-]."""


def register_layout(layout: Layout) -> None:
    """Add a layout, a module or object with ``read``; it is tried before all others.

    Examples
    --------
    >>> from stiction.sources.layouts import LAYOUTS, register_layout, wide
    >>> register_layout(wide)
    >>> LAYOUTS.pop(0) is wide
    True
    """
    LAYOUTS.insert(0, layout)


def read_layout(tables: Sequence[RawTable], options: ReadOptions) -> list[TagColumn]:
    """Give the columns of all tables that are not time, in order; columns with the same clock have the same rows."""
    columns: list[TagColumn] = []
    for table in _join_pieces([table for table in tables if table.width]):
        table = take_averages(table, options)
        found = (layout.read(table, options) for layout in LAYOUTS)
        columns += next(one for one in found if one is not None)
    return columns


def _join_pieces(tables: Sequence[RawTable]) -> list[RawTable]:
    """Join tables with the same headings, when these name tags or the tables are long ones: files of a day each."""
    groups: dict[tuple[object, ...], list[RawTable]] = {}
    for table in tables:
        names, units, _ = table_headings(table)
        has_tags = any((pair := parse_role(name)) and pair[0] for name in names)
        is_piece = has_tags or long_table.find_long_columns(names, table.sample, table.decimal)
        groups.setdefault((*names, *units, table.decimal) if is_piece else (id(table),), []).append(table)
    return [group[0] if len(group) == 1 else _join(group) for group in groups.values()]


def _join(tables: Sequence[RawTable]) -> RawTable:
    """Make one table whose rows are those of several, in their order."""

    def read(positions: Sequence[int]) -> pl.DataFrame:
        names = [f"{position}" for position in positions]
        frames = [pl.DataFrame(table.reader(positions).get_columns(), schema=names) for table in tables]
        return pl.concat(frames, how="vertical_relaxed")

    shown = list_first([table.origin.name for table in tables], MAX_LISTED)
    note = f"{len(tables)} tables with the same headings were joined in this order: {shown}."
    notes = [*dict.fromkeys(text for table in tables for text in table.notes), note]
    return replace(tables[0], reader=read, notes=notes, _columns={})
