"""Values of the signals of one loop: numbers, bad values, units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError, Setting
from stiction.sources.layouts.headings import table_headings
from stiction.sources.roles.group_columns import flag_role
from stiction.sources.roles.loop_roles import column_label
from stiction.sources.values.bad_values import find_bad_values
from stiction.sources.values.numeric_cells import parse_numbers
from stiction.sources.values.quality_codes import read_quality
from stiction.sources.values.thousands import refuse_other_decimal
from stiction.sources.values.units import scale_between

if TYPE_CHECKING:
    from collections import Counter

    import polars as pl
    from numpy.typing import NDArray

    from stiction.sources.options import ReadOptions
    from stiction.sources.roles.loop_roles import LoopRoles
    from stiction.sources.table import TagColumn
    from stiction.sources.values.bad_values import BadValues

__all__ = ["EmptySignalError", "SignalValues", "parse_signals", "refuse_without_numbers"]


class EmptySignalError(RecordError):
    """A signal of a loop has no number."""


@dataclass(frozen=True)
class SignalValues:
    """Values of the signals of a loop, by one reading of its quality codes."""

    values: dict[str, NDArray[np.float64]]
    """Role -> values, NaN where they are bad."""
    units: dict[str, str]
    """Role -> unit as written."""
    bad: BadValues
    """What was bad."""
    reading: str = ""
    """How the quality codes were read; empty where there is only one way."""


def parse_signals(loop: LoopRoles, columns: dict[str, TagColumn], options: ReadOptions) -> list[SignalValues]:
    """Values of each role, for each way to read the quality codes, the likeliest first."""
    decimal_is_given = options.decimal is not None
    values: dict[str, NDArray[np.float64]] = {}
    units: dict[str, str] = {}
    texts: dict[str, Counter[str]] = {}
    flags: dict[str, tuple[str, pl.Series]] = {}
    notes: list[str] = []
    for role, column in columns.items():
        decimal, where = column.table.decimal, f"{column.table.origin.name}, column {column_label(column)}"
        numbers = parse_numbers(
            column.cells, decimal, where=where, decimal_is_given=decimal_is_given, unit=loop.unit_of(role)
        )
        if decimal_is_given:
            refuse_other_decimal(numbers.texts, len(column.cells), decimal, where)
        values[role], texts[role] = numbers.values, numbers.texts
        units[role] = _one_unit(loop, role, numbers.unit)
        notes += [f"{column_label(column)}: {numbers.note}"] if numbers.note else []
        for k, (heading, load) in enumerate(column.flags.items()):
            flags[f"{role} {flag_role(heading, ()) or 'quality'} {k}"] = (heading, load())
    for role, column in loop.roles.items():
        if role not in columns and role != "mode":
            flags.setdefault(role, (column_label(column), column.cells))
    of_sp, of_pv = units.get("sp", ""), units.get("pv", "")
    if of_sp and of_pv and of_sp.upper() != of_pv.upper() and (scale := scale_between(of_sp, of_pv)):
        values["sp"] = values["sp"] * scale[0] + scale[1]
        notes.append(f"SP is given in {of_sp} and was converted to {of_pv}.")
    labels = {role: column_label(column) for role, column in columns.items()}
    tables = {id(column.table): column.table for column in loop.roles.values()} if flags else {}
    others = {name.strip().upper() for table in tables.values() for name in table_headings(table).names}
    readings = read_quality(
        flags, others, good_codes={key: loop.good_codes.get(key, options.good_codes) for key in flags},
        keep_uncertain=options.keep_uncertain,
        where=loop.roles["op"].table.origin.name,
    )  # fmt: skip
    results = []
    for reading in readings:
        bad = find_bad_values(values, texts=texts, flags=reading.masks, labels=labels)
        bad.notes[:0] = [*notes, *reading.notes]
        good = {
            role: np.where(bad.masks[role], np.nan, x) if bad.masks[role].any() else x for role, x in values.items()
        }
        results.append(SignalValues(good, units, bad, " ".join(reading.notes) if len(readings) > 1 else ""))
    return results


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
