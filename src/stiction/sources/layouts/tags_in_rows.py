"""Turned tables: the tags stand in rows and the times in columns."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import polars as pl

from stiction.sources.layouts import wide
from stiction.sources.layouts.headings import forget_note_on_lines_above, parse_role
from stiction.sources.roles.column_names import normalise_name
from stiction.sources.roles.vocabulary import COLUMN_WORDS
from stiction.sources.table import SNIFF_ROWS
from stiction.sources.time.text_stamps import is_timestamp

if TYPE_CHECKING:
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable, TagColumn

__all__ = ["read"]


def _find_corner(table: RawTable, *, min_times: int = 4, max_leading: int = 6) -> tuple[list[str], int, int] | None:
    """Find the row of at least `min_times` stamps, the column of the first one, and that of the signal names before."""
    for row in [*table.header, *reversed(table.above), *table.sample[:1]]:
        first = next((i for i, cell in enumerate(row[: max_leading + 1]) if is_timestamp(cell)), 0)
        filled = [cell for cell in row[first:] if cell.strip()]
        is_wide = len(row) > min_times and abs(len(row) - table.width) <= 1
        if is_wide and first > 0 and len(filled) >= min_times and all(map(is_timestamp, filled)):
            samples = [table.sample_column(i) for i in range(first)]
            shares = [2 * sum(parse_role(cell) is not None for cell in cells) - len(cells) for cells in samples]
            tags = [i for i, cells in enumerate(samples) if cells and shares[i] >= 0]
            return (row, first, tags[0]) if tags else None
    return None


def read(table: RawTable, options: ReadOptions) -> list[TagColumn] | None:
    """Turn round a table with stamps above rows that begin with a signal's name; give its columns, one for each row."""
    if (corner := _find_corner(table)) is None:
        return None
    times, first, tag_position = corner
    forget_note_on_lines_above(table)
    table.load(range(table.width))
    frame = pl.DataFrame([table.column(i).alias(f"{i}") for i in range(table.width)])
    frame = frame.select(pl.all().cast(pl.String).fill_null("")).filter(~pl.col(f"{first}").is_in(times[first:]))
    used = [i for i in range(first, min(len(times), table.width)) if times[i].strip()]
    turned = frame.select(f"{i}" for i in used).transpose()
    turned = turned.insert_column(0, pl.Series("time", [times[i] for i in used]))
    header = [["Time", *frame[f"{tag_position}"]]]
    for key in ("unit", "description"):
        header += [["", *frame[f"{i}"]] for i in range(first) if normalise_name(times[i]) in COLUMN_WORDS[key]]
    upright = replace(
        table,
        header=header,
        sample=[list(row) for row in turned.head(SNIFF_ROWS).iter_rows()],
        width=turned.width,
        reader=lambda positions: turned.select(turned.columns[i] for i in positions),
        notes=[*table.notes, "The table is transposed: tags are in rows and times in columns."],
        above=[],
        _columns={},
    )
    return wide.read(upright, options)
