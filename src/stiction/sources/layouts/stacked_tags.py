"""Tags below each other, each under a line that names it: blocks of time and value."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.errors import RecordError
from stiction.sources.layouts.headings import (
    UNIT_HEADINGS,
    find_clock,
    forget_note_on_lines_above,
    parse_role,
    table_headings,
)
from stiction.sources.layouts.row_groups import TagRows, columns_of_rows, readable_rows
from stiction.sources.layouts.tag_lines import MARKS, first_unit, last_tag, tag_in_line, unit_in_line
from stiction.sources.roles.vocabulary import TAG_WORDS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable
    from stiction.sources.tag_column import TagColumn

__all__ = ["read", "recognises"]

MAX_COLUMNS = 4
"""Columns of a block: date, clock, value and quality [columns]."""


class _Blocks(NamedTuple):
    """Where blocks begin below the first one, and the lines that hold no data."""

    names: list[str]
    starts: list[int]
    units: dict[int, str]
    """Row -> unit that stands there."""
    lines: NDArray[np.int64]
    """Rows of headings, of units and of repeated headers."""


def recognises(table: RawTable, options: ReadOptions) -> bool:  # noqa: ARG001
    """Whether a line above the data names a tag, and a line among the data names another one."""
    if table.width > MAX_COLUMNS or not (first := last_tag(table)):
        return False
    return any(name != first for name in _find_blocks(table).names)


def _find_blocks(table: RawTable) -> _Blocks:
    import polars as pl

    table.load(range(table.width))
    cells = [table.column(i).cast(pl.String).fill_null("").alias(f"{i}") for i in range(table.width)]
    word = pl.col("0").str.strip_chars(MARKS).str.to_uppercase()
    is_alone = pl.all_horizontal(pl.lit(value=True), *(pl.col(f"{i}") == "" for i in range(1, table.width)))
    known = [*TAG_WORDS, *UNIT_HEADINGS, *(row[0].strip(MARKS).upper() for row in table.header)]
    lines = (
        pl.DataFrame(cells)
        .with_row_index("row")
        .filter(word.str.contains(r"^[^\d\s]") & (is_alone | word.is_in(list(filter(None, known)))))
    )
    blocks = _Blocks([], [], {}, lines["row"].to_numpy().astype(np.int64))
    for row, *texts in lines.iter_rows():
        if name := tag_in_line(texts):
            blocks.names.append(name)
            blocks.starts.append(row + 1)
        elif unit := unit_in_line(texts):
            blocks.units[row] = unit
    return blocks


def read(table: RawTable, options: ReadOptions) -> list[TagColumn]:
    """Give the tag of each block with its rows; blocks of the same tag are joined.

    Raises
    ------
    RecordError
        When there is no time column, or no stamp is understood.
    """
    clock, no_signals = find_clock(table, options)
    if clock is None:
        raise RecordError(f"{table.origin.name}: holds tags below each other without times; export the times too.")
    blocks = _find_blocks(table)
    stamps = clock.stamps
    readable = readable_rows(table, stamps, ignored=blocks.lines)
    tags: dict[str, TagRows] = {}
    starts = [0, *blocks.starts]
    for name, start, end in zip([last_tag(table), *blocks.names], starts, [*starts[1:], readable.size], strict=True):
        rows = start + np.flatnonzero(readable[start:end])
        unit = next(
            (unit for row, unit in blocks.units.items() if start <= row < end), "" if start else first_unit(table)
        )
        tag = tags.setdefault(name, TagRows(name, rows[:0], unit))
        tag.rows = np.concatenate([tag.rows, rows])
    free = [i for i in range(table.width) if i not in no_signals]
    names = table_headings(table).names
    quality = [i for i in free if (role := parse_role(names[i])) and role[1] == "quality"]
    value = next(i for i in free if i not in quality)
    forget_note_on_lines_above(table)
    table.notes.append(f"The table holds {len(tags)} tags below each other, each under a line with its name.")
    return columns_of_rows(table, stamps, tags.values(), value, quality[0] if quality else None)
