"""Columns of which each tag has rows of its own: the rows of a tag, their stamps and their cells."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError
from stiction.sources.tag_column import Clock, TagColumn

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import polars as pl
    from numpy.typing import NDArray

    from stiction.sources.table import RawTable
    from stiction.sources.time.stamps import Stamps

__all__ = ["MIN_STAMPS", "TagRows", "columns_of_rows", "gather_rows", "readable_rows", "select_stamps", "shared_clocks"]

MIN_STAMPS = 2
"""Time stamps that must be understood in a table of this kind [rows]."""


@dataclass
class TagRows:
    """Where a tag stands in a table."""

    name: str
    rows: NDArray[np.integer]
    """Rows of the tag, in the order of the table."""
    unit: str = ""
    description: str = ""


def select_stamps(stamps: Stamps, rows: NDArray[np.integer]) -> Stamps:
    """Give the stamps of some rows."""
    return replace(stamps, seconds=stamps.seconds[rows], notes=list(stamps.notes), first_unread=None)


def readable_rows(table: RawTable, stamps: Stamps, *, ignored: NDArray[np.integer] | None = None) -> NDArray[np.bool_]:
    """Mark the rows whose time stamp was understood, and note how many were not, `ignored` ones aside.

    Raises
    ------
    RecordError
        When fewer than `MIN_STAMPS` were understood.
    """
    readable = np.isfinite(stamps.seconds)
    if readable.sum() < MIN_STAMPS:
        row, cell = stamps.first_unread or (0, "")
        raise RecordError(
            f"{table.origin.name}, line {table.first_line + row}: {cell!r} is no time stamp known here; "
            "give time_format='...' (--time-format)."
        )
    counted = np.ones(readable.size, dtype=bool)
    counted[[] if ignored is None else ignored] = False
    if lost := int((counted & ~readable).sum()):
        rows = "1 row" if lost == 1 else f"{lost} rows"
        note = f"Left out: {rows} without a readable time stamp."
        table.notes.extend([] if note in table.notes else [note])
    return readable


def shared_clocks(stamps: Sequence[Stamps]) -> list[Clock]:
    """Give a clock for each set of stamps, the same one where all stamps are equal."""
    known: dict[tuple[float, ...], list[Clock]] = {}
    clocks = []
    for one in stamps:
        seconds = one.seconds
        key = (seconds.size, *seconds[:1], *seconds[-1:])
        alike = known.setdefault(key, [])
        found = next((clock for clock in alike if np.array_equal(clock.stamps.seconds, seconds)), None)
        if found is None:
            found = Clock(lambda one=one: one)
            alike.append(found)
        clocks.append(found)
    return clocks


def columns_of_rows(
    table: RawTable, stamps: Stamps, tags: Iterable[TagRows], value: int, quality: int | None = None
) -> list[TagColumn]:
    """Make a column of each tag from one column of values; tags with the same time stamps share a clock."""
    tags = list(tags)
    clocks = shared_clocks([select_stamps(stamps, tag.rows) for tag in tags])
    return [
        TagColumn(
            name=tag.name,
            table=table,
            clock=clock,
            load=partial(gather_rows, table, value, tag.rows),
            unit=tag.unit,
            description=tag.description,
            quality=None if quality is None else partial(gather_rows, table, quality, tag.rows),
            own_clock=True,
        )
        for tag, clock in zip(tags, clocks, strict=True)
    ]


def gather_rows(table: RawTable, position: int, rows: NDArray[np.integer]) -> pl.Series:
    """Give some rows of a column."""
    return table.column(position).gather(rows)
