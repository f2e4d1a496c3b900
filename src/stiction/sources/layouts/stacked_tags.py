"""Tags below each other, each under a line that names it: blocks of time and value."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from stiction.errors import RecordError
from stiction.sources.layouts import headings
from stiction.sources.layouts.headings import pick_rows, pick_stamps, readable_rows, share_clocks
from stiction.sources.roles.vocabulary import TAG_WORDS, UNIT_HEADINGS

if TYPE_CHECKING:
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable, TagColumn

__all__ = ["read"]


def _lines_between(table: RawTable) -> list[tuple[int, str, str]]:
    """Rows of headings, of units and of repeated headers, with the tag or the unit that they name."""
    table.load(range(table.width))
    cells = [table.column(i).cast(pl.String).fill_null("").alias(f"{i}") for i in range(table.width)]
    word = pl.col("0").str.strip_chars(headings.MARKS).str.to_uppercase()
    is_alone = pl.all_horizontal(pl.lit(value=True), *(pl.col(f"{i}") == "" for i in range(1, table.width)))
    known = {*TAG_WORDS, *UNIT_HEADINGS, *(row[0].strip(headings.MARKS).upper() for row in table.header)} - {""}
    frame = pl.DataFrame(cells).with_row_index("row")
    lines = frame.filter(word.str.contains(r"^[^\d\s]") & (is_alone | word.is_in(list(known))))
    named = [(row, headings.tag_in_line(texts), texts) for row, *texts in lines.iter_rows()]
    return [(row, name, "" if name else headings.unit_in_line(texts)) for row, name, texts in named]


def read(table: RawTable, options: ReadOptions) -> list[TagColumn] | None:
    """Give the tag of each block with its rows, blocks of the same tag joined, where lines name two tags or more.

    The blocks have at most date, clock, value and quality.
    """
    first = headings.last_tag(table) if table.width <= 4 else ""
    lines = _lines_between(table) if first else []
    if not any(name not in ("", first) for _, name, _ in lines):
        return None
    clock, no_signals = headings.find_clock(table, options)
    if clock is None:
        raise RecordError(
            "contains tags one below the other, without times; export the times too.", where=table.origin.name
        )
    readable = readable_rows(table, clock.stamps, ignored=np.array([row for row, *_ in lines], dtype=np.int64))
    names = [first, *(name for _, name, _ in lines if name)]
    starts = [0, *(row + 1 for row, name, _ in lines if name)]
    rows: dict[str, list[np.ndarray]] = {}
    units: dict[str, str] = {}
    for name, start, end in zip(names, starts, [*starts[1:], readable.size], strict=True):
        rows.setdefault(name, []).append(start + np.flatnonzero(readable[start:end]))
        within = (unit for row, _, unit in lines if unit and start <= row < end)
        units.setdefault(name, next(within, "" if start else headings.first_unit(table)))
    free = [i for i in range(table.width) if i not in no_signals]
    flags = set(headings.flag_positions(table))
    headings.forget_note_on_lines_above(table)
    whole = headings.heading_column(table, next(i for i in free if i not in flags), clock)
    whole.flags = headings.flag_loaders(table, flags & set(free))
    picked = [np.concatenate(parts) for parts in rows.values()]
    clocks = share_clocks([pick_stamps(clock, one) for one in picked])
    table.notes.append(f"The table contains {len(rows)} tags one below the other, each under a line with its name.")
    return [
        pick_rows(whole, one, own, name=name, unit=units[name], position=None, own_clock=True)
        for name, one, own in zip(rows, picked, clocks, strict=True)
    ]
