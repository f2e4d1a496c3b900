"""Tables that are pieces of one: files of a day or a month each, or sheets that continue one another."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from stiction.sources.layouts.headings import parse_role, table_headings
from stiction.sources.layouts.long_table import find_long_columns

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

    from stiction.sources.table import RawTable

__all__ = ["join_pieces"]


def join_pieces(tables: Sequence[RawTable]) -> list[RawTable]:
    """Join tables with the same headings, when these name tags or the tables are long ones; others stay as they are."""
    groups: dict[tuple[str, ...], list[RawTable]] = {}
    for k, table in enumerate(tables):
        key = _headings_of_tags(table)
        groups.setdefault(key or (f"table {k}",), []).append(table)
    return [group[0] if len(group) == 1 else _join(group) for group in groups.values()]


def _headings_of_tags(table: RawTable) -> tuple[str, ...]:
    """Give the headings of a table that may be a piece; empty when they name no tag, as those of a loop's sheet."""
    names, units, _ = table_headings(table)
    has_tags = any((pair := parse_role(name)) and pair[0] for name in names)
    is_piece = has_tags or bool(find_long_columns(names, table.sample, table.decimal))
    return (*names, *units, table.decimal) if is_piece else ()


def _join(tables: Sequence[RawTable]) -> RawTable:
    first = tables[0]

    def read(positions: Sequence[int]) -> pl.DataFrame:
        import polars as pl

        names = [f"{position}" for position in positions]
        frames = [pl.DataFrame(table.reader(positions).get_columns(), schema=names) for table in tables]
        return pl.concat(frames, how="vertical_relaxed")

    shown = ", ".join(table.origin.name for table in tables[:5])
    more = f" and {len(tables) - 5} more" if len(tables) > 5 else ""
    note = f"{len(tables)} tables with the same headings are joined in this order: {shown}{more}."
    notes = [*dict.fromkeys(text for table in tables for text in table.notes), note]
    return replace(first, reader=read, notes=notes, _columns={})
