"""Loops below each other: a row for each loop and time, with the loop's name in a column and its signals in others."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from stiction.sources.layouts import wide
from stiction.sources.layouts.headings import (
    find_clock,
    flag_positions,
    has_loop,
    heading_column,
    parse_role,
    pick_rows,
    pick_stamps,
    table_headings,
)
from stiction.sources.layouts.long_table import find_series_columns
from stiction.sources.roles.column_names import normalise_name
from stiction.sources.roles.vocabulary import TAG_WORDS, loop_type_of
from stiction.sources.time.time_order import MAX_SHARED_STAMPS

if TYPE_CHECKING:
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable, TagColumn

__all__ = ["read"]

MIN_LOOP_ROWS = 10
"""Rows that a loop needs [rows]."""
MAX_PROBED_ROWS = 1_000_000
"""Last rows of a large file by which the columns that tell loops apart are found [rows]."""
MIN_EVEN_SHARE = 0.9
"""Share of the rows that must be one usual step after the row before, within their loop [-]."""


def _tag_column(names: list[str], options: ReadOptions) -> int | None:
    """Find the column whose heading says that it names the loop of each row."""
    named = {str(column).strip().upper() for column in options.columns.values()}
    free = [i for i, name in enumerate(names) if name.strip().upper() not in named]
    return next((i for i in free if normalise_name(names[i]) in TAG_WORDS), None)


def _find_keys(table: RawTable, names: list[str], options: ReadOptions, tag: int | None) -> list[int]:
    """Find the columns, beside `tag`, with which each time is single and each part even; empty where none is needed."""
    named = {str(column).strip().upper() for column in options.columns.values()}
    flags = flag_positions(table)
    free = [i for i, name in enumerate(names) if not parse_role(name) and name.strip().upper() not in named]
    free = [i for i in free if i not in (tag, *flags) and str(i) not in named]
    if not free:
        return []
    # A copy, so that a large file is not read as a whole.
    first_row = max(0, table.count_rows() - MAX_PROBED_ROWS) if table.count_rows else table.first_row
    probe = replace(table, first_row=first_row, notes=[], clock=set(), _columns={})
    clock, no_signals = find_clock(probe, options, taken=[] if tag is None else [tag])
    free = [i for i in free if i not in no_signals]
    if clock is None or not free:
        return []
    seconds = clock.stamps.seconds
    texts = {} if tag is None else {"tag": _texts(probe, tag)}
    frame = pl.DataFrame({**texts, "time": seconds}).filter(np.isfinite(seconds))
    if frame.height - frame.n_unique() <= MAX_SHARED_STAMPS * frame.height:
        return []
    chosen = find_series_columns(probe, texts, list(texts), seconds, free)
    parts = pl.DataFrame({**texts, **{f"{i}": _texts(probe, i) for i in chosen}, "time": seconds})
    parts = parts.filter(np.isfinite(seconds)).sort("time", maintain_order=True)
    steps = [np.diff(t.to_numpy()) for t in parts.group_by([*texts, *map(str, chosen)]).agg("time")["time"]]
    even = sum(int((own == np.median(own)).sum()) for own in steps if own.size >= MIN_LOOP_ROWS)
    return sorted(chosen) if len(steps) > 1 and even >= MIN_EVEN_SHARE * frame.height else []


def _texts(table: RawTable, position: int) -> pl.Series:
    return table.column(position).cast(pl.String).str.strip_chars().fill_null("")


def read(table: RawTable, options: ReadOptions) -> list[TagColumn] | None:
    """Give the columns of each loop, named like ``FIC-1.PV``; those of the whole table where the names are no tags."""
    names = table_headings(table).names
    if {pair[0] for name in names if (pair := parse_role(name))} != {""} or not has_loop(names):
        return None
    tag_position = _tag_column(names, options)
    keys = _find_keys(table, names, options, tag_position)
    if tag_position is None and not keys:
        return None
    name_columns = sorted({*keys, *(() if tag_position is None else (tag_position,))})
    clock, no_signals = find_clock(table, options, taken=name_columns)
    table.load({*name_columns, *no_signals, *(i for i, name in enumerate(names) if parse_role(name))})
    parts = pl.DataFrame([_texts(table, i).alias(f"{i}") for i in name_columns])
    tags = parts.select(pl.concat_str(pl.all(), separator=".").str.strip_chars(".").alias("tag")).to_series()
    times = [table.column(i).alias(f"time {i}") for i in sorted(no_signals)]
    groups = tags.to_frame().with_row_index("row").filter(pl.col("tag") != "")
    groups = groups.group_by("tag", maintain_order=True).agg("row")
    if keys:
        shown = " and ".join(names[i] or f"column {i}" for i in keys)
        table.notes.append(f"The rows are split into loops by {shown}, as each time is there once for each of them.")
    elif not _are_loops(groups, pl.DataFrame([tags, *times])):
        table.notes.append("The column of names does not name loops: its rows are in the order of time.")
        return [column for column in wide.read(table, options) if column.position != tag_position]
    is_long = pl.col("row").list.len() >= MIN_LOOP_ROWS
    if short := groups.filter(~is_long)["tag"].to_list():
        table.notes.append(f"Left out, because they have fewer than {MIN_LOOP_ROWS} rows: {', '.join(short[:10])}.")
    signals = [heading_column(table, i, None) for i in range(table.width) if i not in {*no_signals, *name_columns}]
    columns = []
    kept = groups.filter(is_long)
    for tag, picked in zip(kept["tag"], kept["row"], strict=True):
        rows = picked.to_numpy()
        own = None if clock is None else pick_stamps(clock, rows)
        columns += [pick_rows(signal, rows, own, name=f"{tag}.{signal.name}", position=None) for signal in signals]
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
