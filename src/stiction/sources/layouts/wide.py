"""Wide tables: a row for each time and a column for each signal, also where each signal has rows of its own."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError
from stiction.sources.layouts.headings import find_clock, heading_column, parse_role, table_headings
from stiction.sources.layouts.row_groups import select_stamps
from stiction.sources.roles.column_names import normalise_name
from stiction.sources.roles.vocabulary import MISSING_WORDS
from stiction.sources.tag_column import Clock

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable
    from stiction.sources.tag_column import TagColumn

__all__ = ["read", "recognises"]

MAX_SHARED_ROWS = 0.5
"""Share of rows that hold both OP and PV below which each was stored at times of its own [-]."""
MAX_BLANK_ROWS = 20
"""Rows without a value up to which a signal was stored at times of its own; more are a gap [rows]."""
MIN_STORED_ROWS = 10
"""Values in the first rows that each of both signals needs [rows]."""
MIN_FULL_SHARE = 0.95
"""Share of rows with a value from which a signal of such a table has the times of the table [-]."""


def recognises(table: RawTable, options: ReadOptions) -> bool:  # noqa: ARG001
    """Whether this layout can read a table: it reads all that no other layout recognises."""
    return table.width > 0


def read(table: RawTable, options: ReadOptions) -> list[TagColumn]:
    """Give the columns of a wide table; in a sparse one, each with the rows at which it was stored.

    Raises
    ------
    RecordError
        When the table has no header and the user named no columns.

    Examples
    --------
    >>> import polars as pl
    >>> from stiction.sources.options import ReadOptions
    >>> from stiction.sources.table import Origin, RawTable
    >>> rows = [["0", "50.1", "40.2"], ["1", "50.3", "40.4"]]
    >>> frame = pl.DataFrame(rows, schema=["a", "b", "c"], orient="row")
    >>> table = RawTable(Origin("x.csv", "x"), [["time_s", "FIC-1.PV", "FIC-1.OP"]], rows, 3, lambda i: frame[:, i])
    >>> [column.name for column in read(table, ReadOptions())]
    ['FIC-1.PV', 'FIC-1.OP']
    """
    if not any(table_headings(table).names) and not options.columns and options.map is None:
        raise RecordError(
            f"{table.origin.name}, line {table.first_line}: there is no header above the {table.width} columns; "
            "say what they are, for example columns={'time': 0, 'pv': 1, 'op': 2}."
        )
    clock, no_signals = find_clock(table, options)
    columns = [heading_column(table, i, clock) for i in range(table.width) if i not in no_signals]
    if clock is not None and (sparse := _find_sparse(table, columns)):
        qualities = [column for column in columns if (role := parse_role(column.name)) and role[1] == "quality"]
        for column in columns:
            column.quality = next((one.load for one in qualities if _is_quality_of(one, column, qualities)), None)
        columns = [column for column in columns if column not in qualities]
        columns = [_stored_rows_only(column) if column.position in sparse else column for column in columns]
        columns = [column for column in columns if _has_cells(column)]
    return columns


def _is_quality_of(quality: TagColumn, column: TagColumn, qualities: Sequence[TagColumn]) -> bool:
    """Whether a column tells the quality of another one: by its name, by its place, or as the only one of its loop."""
    tag, own = (parse_role(quality.name) or ("", ""))[0], parse_role(column.name)
    if tag.upper() == normalise_name(column.name):
        return True
    if sum(one.name == quality.name for one in qualities) > 1:
        return quality.position == (column.position or 0) + 1
    return not tag or (own is not None and tag.upper() == own[0].upper())


def _find_sparse(table: RawTable, columns: Sequence[TagColumn]) -> set[int]:
    """Find the columns that were stored at times of their own; none where OP and PV of each loop share most rows."""
    roles = {i: parse_role(column.name) for column in columns if (i := column.position) is not None}
    loops: dict[str, dict[str, int]] = {}
    for i, role in roles.items():
        if role and role[1] in ("pv", "op"):
            loops.setdefault(role[0], {})[role[1]] = i
    pairs = [(loop["pv"], loop["op"]) for loop in loops.values() if len(loop) == 2]
    if not any(_is_sparse(_stored_mask(table, i), _stored_mask(table, k)) for i, k in pairs):
        return set()
    return {i for i in roles if _stored_mask(table, i).mean() < MIN_FULL_SHARE}


def _stored_mask(table: RawTable, position: int) -> np.ndarray:
    """Mark the first rows in which a column holds something."""
    cells = (row[position].strip().upper() if position < len(row) else "" for row in table.sample)
    return np.array([cell not in MISSING_WORDS for cell in cells])


def _has_cells(column: TagColumn) -> bool:
    """Whether a column holds anything; only a column that is blank in the first rows is read for that."""
    i = column.position or 0
    return not column.own_clock or bool(_stored_mask(column.table, i).any()) or len(column.cells) > 0


def _is_sparse(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two signals seldom stand in the same row, and neither is missing for long."""
    if (one & other).mean() >= MAX_SHARED_ROWS or min(one.sum(), other.sum()) < MIN_STORED_ROWS:
        return False
    blanks = [np.diff(np.flatnonzero(np.r_[True, stored, True])).max() - 1 for stored in (one, other)]
    return max(blanks) <= MAX_BLANK_ROWS


def _stored_rows_only(column: TagColumn) -> TagColumn:
    """Give a column with the rows at which it was stored, on a clock of its own."""
    clock, whole, quality = column.clock, column.load, column.quality
    assert clock is not None

    def stored() -> pl.Series:
        import polars as pl

        cells = whole()
        if cells.dtype != pl.String:
            return cells.is_not_null()
        return cells.is_not_null() & ~cells.str.strip_chars().str.to_uppercase().is_in(list(MISSING_WORDS))

    return replace(
        column,
        clock=Clock(lambda: select_stamps(clock.stamps, stored().arg_true().to_numpy())),
        load=lambda: whole().filter(stored()),
        quality=None if quality is None else lambda: quality().filter(stored()),
        own_clock=True,
    )
