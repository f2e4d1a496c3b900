"""Values of the signals of one loop: numbers, bad values, units."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError, Setting
from stiction.sources.roles.loop_roles import column_label
from stiction.sources.values.bad_values import find_bad_values
from stiction.sources.values.numeric_cells import parse_numbers
from stiction.sources.values.thousands import refuse_other_decimal

if TYPE_CHECKING:
    from collections import Counter

    import polars as pl
    from numpy.typing import NDArray

    from stiction.sources.roles.loop_roles import LoopRoles
    from stiction.sources.table import TagColumn
    from stiction.sources.values.bad_values import BadValues

__all__ = ["EmptySignalError", "parse_signals", "refuse_without_numbers"]


class EmptySignalError(RecordError):
    """A signal of a loop has no number."""


def parse_signals(
    loop: LoopRoles, columns: dict[str, TagColumn], *, decimal_is_given: bool
) -> tuple[dict[str, NDArray[np.float64]], dict[str, str], BadValues]:
    """Values of each role, NaN where they are bad, and their units."""
    values: dict[str, NDArray[np.float64]] = {}
    units: dict[str, str] = {}
    texts: dict[str, Counter[str]] = {}
    flags: dict[str, tuple[str, pl.Series]] = {}
    for role, column in columns.items():
        decimal, where = column.table.decimal, f"{column.table.origin.name}, column {column_label(column)}"
        found = parse_numbers(column.cells, decimal, where=where, decimal_is_given=decimal_is_given)
        if decimal_is_given:
            refuse_other_decimal(found.texts, len(column.cells), decimal, where)
        values[role], texts[role] = found.values, found.texts
        units[role] = _one_unit(loop, role, found.unit)
        if column.quality is not None:
            flags[f"{role} quality"] = (f"quality of {column_label(column)}", column.quality())
    for role, column in loop.roles.items():
        if role not in columns and role != "mode":
            flags.setdefault(role, (column_label(column), column.cells))
    labels = {role: column_label(column) for role, column in columns.items()}
    bad = find_bad_values(values, texts=texts, flags=flags, labels=labels)
    for role, mask in bad.masks.items():
        if mask.any():
            values[role] = np.where(mask, np.nan, values[role])
    return values, units, bad


def _one_unit(loop: LoopRoles, role: str, in_cells: str) -> str:
    """Unit of a signal by its header or map, or by its cells; they must not disagree."""
    written, column = loop.unit_of(role), loop.roles[role]
    if written and in_cells and written.upper() != in_cells.upper():
        raise RecordError(
            f"its header says {written}, its numbers say {in_cells}; correct the one that is wrong.",
            where=f"{column.table.origin.name}, column {column_label(column)}",
        )
    if in_cells and in_cells != "%" and not column.table.header and not written:
        raise RecordError(
            f"has numbers in {in_cells} but no header; write a header that names the signal.",
            where=column.table.origin.name,
        )
    return written or in_cells


def refuse_without_numbers(loop: LoopRoles, role: str, bad: BadValues) -> None:
    """Raise the error of a signal without a number."""
    column = loop.roles[role]
    table, label = column.table, column_label(column)
    if role in bad.masks and bad.masks[role].all():
        raise EmptySignalError(
            f"all values of {label} are flagged as bad; export good values, or leave out the "
            "flag column if it is wrong.",
            where=table.origin.name,
        )
    cells = column.cells.drop_nulls().head(1).to_list() or [""]
    raise EmptySignalError(
        f"contains no number for {role.upper()} (it begins with {str(cells[0])!r})",
        remedy=("check the column or name another one with ", Setting("columns", {role: None})),
        where=f"{table.origin.name}, line {table.first_line}, column {label}",
    )
