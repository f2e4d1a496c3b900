"""Columns of which each tag has rows of its own: the rows of a tag, their stamps and their cells."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.display.number_format import count_noun
from stiction.errors import RecordError
from stiction.sources.tag_column import Clock, TagColumn

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from stiction.sources.table import RawTable
    from stiction.sources.time.stamps import Stamps

    Rows = NDArray[np.integer]

__all__ = ["pick_rows", "pick_stamps", "readable_rows", "share_clocks"]


def pick_rows(column: TagColumn, rows: Rows, clock: Clock | None, **changes: Any) -> TagColumn:
    """Give some rows of a column, with the clock of these rows."""
    load, quality = column.load, column.quality
    return replace(
        column,
        clock=clock,
        load=lambda: load().gather(rows),
        quality=None if quality is None else lambda: quality().gather(rows),
        **changes,
    )


def pick_stamps(clock: Clock, rows: Rows) -> Clock:
    """Give the clock of some rows."""

    def parse() -> Stamps:
        stamps = clock.stamps
        return replace(stamps, seconds=stamps.seconds[rows], notes=list(stamps.notes), first_unread=None)

    return Clock(parse)


def share_clocks(clocks: Sequence[Clock]) -> list[Clock]:
    """Give for each clock the first one with equal stamps."""
    known: dict[tuple[float, ...], list[Clock]] = {}
    shared = []
    for clock in clocks:
        seconds = clock.stamps.seconds
        alike = known.setdefault((seconds.size, *seconds[:1], *seconds[-1:]), [])
        first = next((other for other in alike if np.array_equal(other.stamps.seconds, seconds)), clock)
        shared.append(first)
        alike += [clock] if first is clock else []
    return shared


def readable_rows(table: RawTable, stamps: Stamps, *, ignored: Rows | None = None) -> NDArray[np.bool_]:
    """Mark the rows whose time stamp was understood, and note how many were not, `ignored` ones aside."""
    readable = np.isfinite(stamps.seconds)
    if readable.sum() < 2:
        row, cell = stamps.first_unread or (0, "")
        raise RecordError(
            f"{table.origin.name}, line {table.first_line + row}: {cell!r} is no time stamp known here; "
            "give time_format='...' (--time-format)."
        )
    counted = ~readable
    counted[[] if ignored is None else ignored] = False
    if lost := int(counted.sum()):
        note = f"Left out: {count_noun(lost, 'row')} without a readable time stamp."
        table.notes.extend([] if note in table.notes else [note])
    return readable
