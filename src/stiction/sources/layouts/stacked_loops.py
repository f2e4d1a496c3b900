"""Loops below each other: a row for each loop and time, with the loop's name in a column and its signals in others."""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl

from stiction.sources.layouts import wide
from stiction.sources.layouts.headings import (
    find_clock,
    has_loop,
    heading_column,
    parse_role,
    pick_rows,
    pick_stamps,
    table_headings,
)
from stiction.sources.roles.column_names import normalise_name
from stiction.sources.roles.vocabulary import TAG_WORDS, loop_type_of

if TYPE_CHECKING:
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable, TagColumn

__all__ = ["read"]

MIN_LOOP_ROWS = 10
"""Rows that a loop needs [rows]."""


def _tag_column(names: list[str], options: ReadOptions) -> int | None:
    """Find the column that may name the loop of each row: its heading says so, and the others are one loop."""
    if {pair[0] for name in names if (pair := parse_role(name))} != {""} or not has_loop(names):
        return None
    named = {str(column).strip().upper() for column in options.columns.values()}
    free = [i for i, name in enumerate(names) if name.strip().upper() not in named]
    return next((i for i in free if normalise_name(names[i]) in TAG_WORDS), None)


def read(table: RawTable, options: ReadOptions) -> list[TagColumn] | None:
    """Give the columns of each loop, named like ``FIC-1.PV``; those of the whole table where the names are no tags."""
    names = table_headings(table).names
    if (tag_position := _tag_column(names, options)) is None:
        return None
    clock, no_signals = find_clock(table, options, taken=[tag_position])
    table.load({tag_position, *no_signals, *(i for i, name in enumerate(names) if parse_role(name))})
    tags = table.column(tag_position).cast(pl.String).str.strip_chars().fill_null("").alias("tag")
    times = [table.column(i).alias(f"time {i}") for i in sorted(no_signals)]
    groups = tags.to_frame().with_row_index("row").filter(pl.col("tag") != "")
    groups = groups.group_by("tag", maintain_order=True).agg("row")
    if not _are_loops(groups, pl.DataFrame([tags, *times])):
        table.notes.append("The column of names does not name loops: its rows are in the order of time.")
        return [column for column in wide.read(table, options) if column.position != tag_position]
    is_long = pl.col("row").list.len() >= MIN_LOOP_ROWS
    if short := groups.filter(~is_long)["tag"].to_list():
        table.notes.append(f"Left out, because they have fewer than {MIN_LOOP_ROWS} rows: {', '.join(short[:10])}.")
    signals = [heading_column(table, i, None) for i in range(table.width) if i not in {*no_signals, tag_position}]
    columns = []
    kept = groups.filter(is_long)
    for tag, picked in zip(kept["tag"], kept["row"], strict=True):
        rows = picked.to_numpy()
        own = None if clock is None else pick_stamps(clock, rows)
        columns += [pick_rows(one, rows, own, name=f"{tag}.{one.name}", position=None) for one in signals]
    return columns


def _are_loops(groups: pl.DataFrame, frame: pl.DataFrame, *, min_named_share: float = 0.9) -> bool:
    """Whether names are loops, not batches: known words or equal times, with `min_named_share` of the rows [-]."""
    sizes = groups["row"].list.len()
    if sizes.filter(sizes >= MIN_LOOP_ROWS).sum() < min_named_share * frame.height:
        return False
    if all(loop_type_of(tag) != "other" for tag in groups["tag"]):
        return True
    times = frame.drop("tag")
    changes = int((frame["tag"] != frame["tag"].shift(1)).sum())
    repeated = frame.height - times.n_unique() if times.width else 0
    return groups.height > 1 and repeated > changes // 2
