"""Wide tables: a row for each time and a column for each signal, also where each signal has rows of its own."""

from __future__ import annotations

import re
from operator import and_
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError, Setting
from stiction.records.quality.compression import is_stored_on_change
from stiction.sources.layouts.headings import (
    convert_units,
    find_clock,
    flag_positions,
    heading_column,
    parse_role,
    pick_rows,
    pick_stamps,
    table_headings,
    written_mask,
)
from stiction.sources.roles.column_names import is_unit, normalise_name
from stiction.sources.roles.vocabulary import MISSING_WORDS, UNIT_HEADINGS
from stiction.sources.values.numeric_cells import parse_numbers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable, TagColumn

__all__ = ["read"]

_UNIT_OF = re.compile(rf"(?:(.*?)[\s._:/-]+)?(?:{'|'.join(map(re.escape, UNIT_HEADINGS))})", re.IGNORECASE)
MIN_WRITTEN = 3
"""Cells among the first rows without which a column is not looked at, as some formats give those of few columns [-]."""


def read(table: RawTable, options: ReadOptions) -> list[TagColumn]:
    """Give the columns of a wide table; in a sparse one, each with the rows at which it was stored."""
    if not any(table_headings(table).names) and not options.columns and options.map is None:
        raise RecordError(
            f"there is no header above the {table.width} columns",
            remedy=("name them, for example with ", Setting("columns", {"time": 0, "pv": 1, "op": 2})),
            where=f"{table.origin.name}, line {table.first_line}",
        )
    clock, no_signals = find_clock(table, options)
    columns = _convert_units([heading_column(table, i, clock) for i in range(table.width) if i not in no_signals])
    if clock is None or not (sparse := _find_sparse(table, columns)):
        return columns
    table.load(range(table.width))
    flags = set(flag_positions(table))
    qualities = [column for column in columns if column.position in flags]
    stored = []
    for column in [column for column in columns if column not in qualities]:
        column.flags = {one.name: one.load for one in qualities if _is_quality_of(one, column, qualities)}
        if column in sparse:
            rows = written_mask(column.cells, MISSING_WORDS).arg_true().to_numpy()
            column = pick_rows(column, rows, pick_stamps(clock, rows), own_clock=True)
        stored += [column] if len(column.cells) else []
    return stored


def _convert_units(columns: list[TagColumn]) -> list[TagColumn]:
    """Convert each signal by its column of units, named after it (``FIC-1.PV Unit``) or right after it (``Unit``)."""
    owners = {normalise_name(column.name): column for column in columns}
    kept: list[TagColumn] = []
    for column in columns:
        found = _UNIT_OF.fullmatch(column.name.strip())
        cells = column.table.sample_column(column.position) if found and column.position is not None else []
        found = found if cells and all(map(is_unit, set(cells))) else None
        owner = owners.get(normalise_name(found[1])) if found and found[1] else (kept or [None])[-1]
        if found and owner is not None and parse_role(owner.name):
            convert_units(owner, column.load())
        else:
            kept.append(column)
    return kept


def _is_quality_of(quality: TagColumn, column: TagColumn, qualities: Sequence[TagColumn]) -> bool:
    """Whether a column tells the quality of another one: by its name, by its place, or as the only one of its loop."""
    tag, own = (parse_role(quality.name) or ("", ""))[0], parse_role(column.name)
    if tag.upper() == normalise_name(column.name):
        return True
    if sum(one.name == quality.name for one in qualities) > 1:
        return quality.position == (column.position or 0) + 1
    return not tag or (own is not None and tag.upper() == own[0].upper())


def _find_sparse(table: RawTable, columns: Sequence[TagColumn], *, min_full_share: float = 0.95) -> list[TagColumn]:
    """Columns filled in less than `min_full_share` of the rows [-]; none where OP and PV share most rows."""

    def written(column: TagColumn) -> list[bool]:
        i = column.position or 0
        cells = [row[i] if i < len(row) else "" for row in table.sample]
        return [cell != "" and cell.strip().upper() not in MISSING_WORDS for cell in cells]

    roles = [parse_role(column.name) or ("", "") for column in columns]
    loops: dict[str, dict[str, list[bool]]] = {}
    for column, (tag, role) in zip(columns, roles, strict=True):
        if role in ("pv", "op"):
            loops.setdefault(tag, {})[role] = written(column)
    blank = {id(c) for c in columns if sum(written(c)) < min_full_share * len(table.sample)}
    if not any(_is_sparse(loop["pv"], loop["op"]) for loop in loops.values() if len(loop) == 2):
        signals = [c for c, (_, role) in zip(columns, roles, strict=True) if role in ("pv", "op") and id(c) in blank]
        sampled = [column for column in signals if sum(written(column)) >= MIN_WRITTEN]
        if not (changing := [id(column) for column in sampled if _is_on_change(column)]):
            return []
        blank -= {id(column) for column in signals} - {*changing}
    return [column for column in columns if id(column) in blank]


def _is_on_change(column: TagColumn) -> bool:
    """Whether the cells between the values of a column are blank because it had not changed."""
    rows = written_mask(column.cells, MISSING_WORDS).arg_true()
    values = parse_numbers(column.cells.gather(rows), column.table.decimal).values
    return is_stored_on_change(values, rows.cast(float).to_numpy())


def _is_sparse(
    one: list[bool], other: list[bool], *, max_shared_rows: float = 0.5, min_stored: int = 10, max_blank: int = 20
) -> bool:
    """Whether two signals share few rows [-], and each has stored rows enough and is not missing for long [rows]."""
    if min(sum(one), sum(other)) < min_stored or sum(map(and_, one, other)) >= max_shared_rows * len(one):
        return False
    blanks = [np.diff(np.flatnonzero([True, *stored, True])).max() - 1 for stored in (one, other)]
    return max(blanks) <= max_blank
