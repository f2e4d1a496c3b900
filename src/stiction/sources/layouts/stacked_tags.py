"""Tags below each other, each under a line that names it: blocks of time and value."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiction.errors import RecordError
from stiction.sources.layouts.headings import find_clock, forget_note_on_lines_above, parse_role, table_headings
from stiction.sources.layouts.row_groups import TagRows, columns_of_rows, readable_rows
from stiction.sources.roles.vocabulary import TAG_WORDS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable
    from stiction.sources.tag_column import TagColumn

__all__ = ["read", "recognises"]

MAX_COLUMNS = 4
"""Columns of a block: date, clock, value and quality [columns]."""
MAX_HEADING_LENGTH = 100
UNIT_HEADINGS = ("UNIT", "UNITS", "ENG UNITS", "ENGINEERING UNITS")
_TAG = "|".join(sorted(map(re.escape, TAG_WORDS), key=len, reverse=True))
_HEADING = re.compile(rf"(?:(?:{_TAG})\s*[:=,]\s*)?([^:,]{{1,80}})", re.IGNORECASE)
_UNIT = re.compile(r"(?:eng\w*\.?\s+)?units?\s*[:=,]\s*([^,\s]{1,12})", re.IGNORECASE)


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
    if table.width > MAX_COLUMNS or not (first := _first_tag(table)):
        return False
    return any(name != first for name in _find_blocks(table).names)


def _first_tag(table: RawTable) -> str:
    """Give the tag that stands directly above the data; empty where none does."""
    rows = reversed([*table.above, *table.header])
    return next((name for row in rows if (name := _tag_of(row))), "")


def _tag_of(cells: Sequence[str]) -> str:
    """Give the tag that a line names and holds nothing beside; empty where it is no heading."""
    text = _join(cells)
    if not text or len(text) > MAX_HEADING_LENGTH or text[-1].isdigit() or _UNIT.fullmatch(text):
        return ""
    found = _HEADING.fullmatch(text)
    pair = parse_role(found[1].strip()) if found else None
    return found[1].strip() if found and pair and pair[0] else ""


def _join(cells: Sequence[str]) -> str:
    """Join the cells of a line, without the marks around it."""
    return ",".join(cell.strip() for cell in cells if cell.strip()).strip("\"'[]# ").replace(":,", ":")


def _find_blocks(table: RawTable) -> _Blocks:
    import polars as pl

    table.load(range(table.width))
    cells = [table.column(i).cast(pl.String).fill_null("").alias(f"{i}") for i in range(table.width)]
    word = pl.col("0").str.strip_chars("\"'[]#:= ").str.to_uppercase()
    is_alone = pl.all_horizontal(pl.lit(value=True), *(pl.col(f"{i}") == "" for i in range(1, table.width)))
    known = [*TAG_WORDS, *UNIT_HEADINGS, *(row[0].strip("\"'[]#:= ").upper() for row in table.header)]
    lines = (
        pl.DataFrame(cells)
        .with_row_index("row")
        .filter(word.str.contains(r"^[^\d\s]") & (is_alone | word.is_in(list(filter(None, known)))))
    )
    blocks = _Blocks([], [], {}, lines["row"].to_numpy().astype(np.int64))
    for row, *texts in lines.iter_rows():
        if name := _tag_of(texts):
            blocks.names.append(name)
            blocks.starts.append(row + 1)
        elif found := _UNIT.fullmatch(_join(texts)):
            blocks.units[row] = found[1]
    return blocks


def read(table: RawTable, options: ReadOptions) -> list[TagColumn]:
    """Give the tag of each block with its rows.

    One for each tag; blocks of the same tag are joined.

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
    unit_above = next((found[1] for row in [*table.above, *table.header] if (found := _UNIT.fullmatch(_join(row)))), "")
    tags: dict[str, TagRows] = {}
    starts = [0, *blocks.starts]
    for name, start, end in zip([_first_tag(table), *blocks.names], starts, [*starts[1:], readable.size], strict=True):
        rows = start + np.flatnonzero(readable[start:end])
        unit = next((unit for row, unit in blocks.units.items() if start <= row < end), "" if start else unit_above)
        tag = tags.setdefault(name, TagRows(name, rows[:0], unit))
        tag.rows = np.concatenate([tag.rows, rows])
    free = [i for i in range(table.width) if i not in no_signals]
    names = table_headings(table).names
    quality = [i for i in free if (role := parse_role(names[i])) and role[1] == "quality"]
    value = next(i for i in free if i not in quality)
    forget_note_on_lines_above(table)
    table.notes.append(f"The table holds {len(tags)} tags below each other, each under a line with its name.")
    return columns_of_rows(table, stamps, tags.values(), value, quality[0] if quality else None)
