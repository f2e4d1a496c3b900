"""Turned tables: the tags stand in rows and the times in columns."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.sources.layouts import wide
from stiction.sources.layouts.headings import UNIT_HEADINGS, forget_note_on_lines_above, parse_role
from stiction.sources.layouts.long_table import DESCRIPTION_WORDS
from stiction.sources.roles.column_names import normalise_name
from stiction.sources.table import SNIFF_ROWS, RawTable
from stiction.sources.time.parse import is_timestamp

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

    from stiction.sources.options import ReadOptions
    from stiction.sources.tag_column import TagColumn

__all__ = ["read", "recognises"]

MIN_TIMES = 4
"""Time stamps that stand side by side in a turned table [columns]."""
MAX_LEADING_COLUMNS = 6
"""Columns of names, units and descriptions before the first time [columns]."""


def recognises(table: RawTable, options: ReadOptions) -> bool:  # noqa: ARG001
    """Whether a row of time stamps stands above rows that begin with the name of a signal."""
    found = _row_of_times(table)
    return found is not None and _tag_column(table, found[1]) is not None


def _row_of_times(table: RawTable) -> tuple[list[str], int] | None:
    """Find the row of time stamps, and the column of the first one."""
    for row in [*table.header, *reversed(table.above), *table.sample[:1]]:
        if len(row) < MIN_TIMES + 1 or abs(len(row) - table.width) > 1:
            continue
        first = next((i for i, cell in enumerate(row[: MAX_LEADING_COLUMNS + 1]) if is_timestamp(cell)), 0)
        filled = [cell for cell in row[first:] if cell.strip()]
        if first > 0 and len(filled) >= MIN_TIMES and all(map(is_timestamp, filled)):
            return row, first
    return None


def _tag_column(table: RawTable, first_time: int) -> int | None:
    """Find the column of the names of signals."""
    for i in range(first_time):
        cells = table.sample_column(i)
        if cells and 2 * sum(parse_role(cell) is not None for cell in cells) >= len(cells):
            return i
    return None


def read(table: RawTable, options: ReadOptions) -> list[TagColumn]:
    """Turn the table round and give its columns, one for each row."""
    import polars as pl

    found = _row_of_times(table)
    assert found is not None
    times, first = found
    tag_position = _tag_column(table, first)
    assert tag_position is not None
    forget_note_on_lines_above(table)
    table.load(range(table.width))
    frame = pl.DataFrame([table.column(i).alias(f"{i}") for i in range(table.width)])
    frame = frame.select(pl.all().cast(pl.String).fill_null(""))
    frame = frame.filter(pl.Series([cell not in times[first:] for cell in frame[f"{first}"]]))
    used = [i for i in range(first, min(len(times), table.width)) if times[i].strip()]
    stamps = pl.Series("time", [times[i] for i in used])
    turned = frame.select(f"{i}" for i in used).transpose()
    columns = [stamps, *turned.get_columns()]
    header = [["Time", *frame[f"{tag_position}"].to_list()]]
    for known in (UNIT_HEADINGS, DESCRIPTION_WORDS):
        header += [["", *frame[f"{i}"].to_list()] for i in range(first) if normalise_name(times[i]) in known]
    note = "The table is turned: its tags stand in rows and its times in columns."
    rows = list(zip(*(column.head(SNIFF_ROWS).to_list() for column in columns), strict=True))
    upright = RawTable(
        table.origin,
        header,
        [list(row) for row in rows],
        len(columns),
        lambda positions: _pick(columns, positions),
        first_line=table.first_line,
        decimal=table.decimal,
        notes=[*table.notes, note],
        metadata=table.metadata,
    )
    return wide.read(upright, options)


def _pick(columns: Sequence[pl.Series], positions: Sequence[int]) -> pl.DataFrame:
    import polars as pl

    return pl.DataFrame([columns[i].alias(f"{i}") for i in positions])
