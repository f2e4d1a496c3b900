"""Tables of averages, minima and maxima: the average of each interval is taken, else the middle of its limits."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import polars as pl

from stiction.errors import RecordError
from stiction.sources.layouts.headings import parse_role, table_headings
from stiction.sources.layouts.long_table import find_long_columns
from stiction.sources.roles.column_names import normalise_name, split_aggregate
from stiction.sources.roles.vocabulary import AGGREGATES, VALUE_WORDS
from stiction.sources.values.numeric_cells import parse_numbers

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable

__all__ = ["take_averages"]


def take_averages(table: RawTable, options: ReadOptions) -> RawTable:
    """Give a table with one value of each signal and interval; a column that the user names is kept."""
    table = _average_rows(table)
    names, units, descriptions = table_headings(table)
    split = [split_aggregate(name) for name in names]
    plain = {base.upper() for base, kind in split if not kind}
    groups: dict[str, dict[str, int]] = {}
    for i, (base, kind) in enumerate(split):
        if kind and (parse_role(base) or not base or normalise_name(base) in VALUE_WORDS):
            groups.setdefault(base.upper(), {}).setdefault(kind, i)
    values = [i for i, (base, kind) in enumerate(split) if not kind and normalise_name(base) in VALUE_WORDS]
    if len(values) == 1 and {"minimum", "maximum"} <= groups.get("", {}).keys():  # minimum, value, maximum
        groups[""].setdefault("average", values[0])
    # A base that is blank is the value of a long table.
    groups = {base: kinds for base, kinds in groups.items() if (base and base in plain) or _source(kinds)}
    given = {str(column).strip().upper() for column in options.columns.values()}
    if not groups or given & {names[i].strip().upper() for kinds in groups.values() for i in kinds.values()}:
        return table
    sources: list[tuple[int, ...]] = []
    spreads: dict[int, Callable[[], NDArray[np.float64]]] = {}
    header: list[list[str]] = [[], [], []]
    for i, (base, kind) in enumerate(split):
        kinds = groups.get(base.upper(), {}) if kind else {}
        source = _source(kinds) if base.upper() not in plain else ()
        if kinds and source[:1] != (i,):
            continue
        if len(source) == 1 and {"minimum", "maximum"} <= kinds.keys():
            spreads[len(sources)] = partial(_spread, table, kinds["minimum"], kinds["maximum"])
        sources.append(source or (i,))
        unit = "" if units[i].upper() in AGGREGATES else units[i]
        for row, cell in zip(header, ((base or "value") if kinds else names[i], unit, descriptions[i]), strict=True):
            row.append(cell)
    dropped = [names[i] for i in range(table.width) if not any(i in source for source in sources)]
    middle = [names[k] for source in sources if len(source) > 1 for k in source]
    used = "The average of each interval is used"
    if middle:
        used = f"The middle of minimum and maximum is used ({', '.join(middle[:4])}), as there is no average"
    left = f"; not used: {', '.join(dropped[:9])}{' ...' if dropped[9:] else ''}" if dropped else ""

    def read(positions: Sequence[int]) -> pl.DataFrame:
        wanted = sorted({k for position in positions for k in sources[position]})
        frame = dict(zip(wanted, table.reader(wanted).get_columns(), strict=True))
        columns = [_middle([frame[k] for k in sources[position]], table.decimal) for position in positions]
        return pl.DataFrame([column.alias(f"{k}") for k, column in enumerate(columns)])

    return replace(
        table,
        header=[row for row in header if any(row)],
        sample=[[row[source[0]] if source[0] < len(row) else "" for source in sources] for row in table.sample],
        width=len(sources),
        reader=read,
        notes=[*table.notes, f"{used}{left}."],
        above=[],
        spreads=spreads,
        _columns={},
    )


def _spread(table: RawTable, minimum: int, maximum: int) -> NDArray[np.float64]:
    """Range of a signal within each interval, shape (n_rows,)."""
    low, high = (parse_numbers(column, table.decimal).values for column in table.reader([minimum, maximum]))
    return high - low


def _source(kinds: dict[str, int]) -> tuple[int, ...]:
    """Give the column of the average, else those of the limits; empty where there are none."""
    if "average" in kinds:
        return (kinds["average"],)
    return (kinds["minimum"], kinds["maximum"]) if {"minimum", "maximum"} <= kinds.keys() else ()


def _middle(columns: list[pl.Series], decimal: str) -> pl.Series:
    """Give one column, or the middle of two."""
    if len(columns) == 1:
        return columns[0]
    low, high = (parse_numbers(column, decimal).values for column in columns)
    return pl.Series((low + high) / 2.0)


def _average_rows(table: RawTable) -> RawTable:
    """Keep the rows of averages where a column of a long table names the aggregate of each row."""
    names = table_headings(table).names
    width = table.width if table.width <= 40 else 0
    present = [{cell.upper() for cell in table.sample_column(i)} for i in range(width)]
    places = [i for i in range(width) if present[i] and present[i] <= AGGREGATES.keys()]
    long_columns = find_long_columns(names, table.sample, table.decimal) if len(places) == 1 else {}
    if not long_columns or places[0] in long_columns.values():
        return table
    words = table.column(places[0]).cast(pl.String).fill_null("").str.strip_chars().str.to_uppercase()
    kind = words.replace_strict(AGGREGATES, default="", return_dtype=pl.String)
    kinds = set(kind)
    if kinds == {"average"}:
        return table
    wanted = next((one for one in ("average", "minimum") if one in kinds), "")
    if not wanted or (wanted == "minimum" and (kind == "minimum").sum() != (kind == "maximum").sum()):
        raise RecordError(
            f"column {names[places[0]]} has the aggregates {', '.join(sorted(set(words))[:9])}, and no average of each "
            "interval; export averages, or raw values.",
            where=table.origin.name,
        )
    rows, upper = kind == wanted, kind == "maximum"

    def read(positions: Sequence[int]) -> pl.DataFrame:
        frame = table.reader(positions)
        kept = frame.filter(rows)
        if wanted == "minimum" and long_columns["value"] in positions:
            k = list(positions).index(long_columns["value"])
            limits = [kept.to_series(k), frame.to_series(k).filter(upper)]
            kept = kept.with_columns(_middle(limits, table.decimal).alias(frame.columns[k]))
        return kept

    used = "averages are" if wanted == "average" else "the middle of minimum and maximum is"
    note = f"Column {names[places[0]]} names aggregates ({', '.join(sorted(set(words))[:9])}): the {used} used."
    sample = [row for row in table.sample if AGGREGATES.get("".join(row[places[0] :][:1]).strip().upper()) == wanted]
    return replace(table, sample=sample, reader=read, notes=[*table.notes, note], _columns={})
