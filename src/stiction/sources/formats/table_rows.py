"""Tables from rows of text cells: what text files and spreadsheets share."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.sources.formats.table_shape import find_table
from stiction.sources.table import SNIFF_ROWS, RawTable
from stiction.sources.values.number_text import usual_unit
from stiction.sources.values.thousands import find_ambiguous_cell

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import polars as pl

    from stiction.sources.formats.table_shape import Dialect
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import Origin

__all__ = ["make_table", "ragged_note", "table_from_rows"]


def table_from_rows(
    origin: Origin, rows: list[list[str]], options: ReadOptions, *, first_line: int = 1
) -> RawTable | None:
    """Make a table of rows of text cells, title and header included; None when there is no row of numbers.

    Examples
    --------
    >>> from stiction.sources.options import ReadOptions
    >>> from stiction.sources.table import Origin
    >>> rows = [["Time", "PV", "OP"], *([f"10:00:0{k}", "5.1", "40"] for k in range(5))]
    >>> table = table_from_rows(Origin("x.xlsx", "x"), rows, ReadOptions())
    >>> table.header, table.column(1)[0], table.first_line
    ([['Time', 'PV', 'OP']], '5.1', 2)
    """
    import polars as pl

    dialect = find_table(rows[:SNIFF_ROWS], options.decimal)
    if dialect is None:
        return None
    first, width = dialect.first_row, dialect.width
    written = [(k, row) for k, row in enumerate(rows[first:]) if any(cell.strip() for cell in row)]
    ragged = [k for k, row in written if len(row) != width]
    data = [[cell.strip() or None for cell in [*row, *[""] * width][:width]] for _, row in written]

    def read_columns(positions: Sequence[int]) -> pl.DataFrame:
        return pl.DataFrame({f"c{i}": pl.Series([row[i] for row in data], dtype=pl.String) for i in positions})

    sample = [row for _, row in written[:SNIFF_ROWS]]
    table = make_table(origin, dialect, sample, read_columns, options, first_line=first_line + first)
    if ragged:
        table.notes.append(ragged_note(len(ragged), width, first_line + first + ragged[0]))
    return table


def make_table(
    origin: Origin,
    dialect: Dialect,
    sample: list[list[str]],
    reader: Callable[[Sequence[int]], pl.DataFrame],
    options: ReadOptions,
    *,
    first_line: int,
) -> RawTable:
    """Make the table of a dialect, with the units that stand after its numbers as one more header row."""
    header, decimal = dialect.header, dialect.decimal
    columns = [[row[i] for row in sample if i < len(row)] for i in range(dialect.width)]
    units = [usual_unit(cells, decimal) for cells in columns]
    if header and any(units):
        header = [*header, units]
    table = RawTable(origin, header, sample, dialect.width, reader, first_line, decimal, above=dialect.above)
    if options.decimal is None:
        if decimal == ",":
            table.notes.append("Numbers have a decimal comma.")
        ambiguous = find_ambiguous_cell(sample, decimal, delimiter=dialect.delimiter, width=dialect.width)
        if ambiguous:
            cell, value, other = ambiguous
            table.notes.append(
                f"{cell!r} is read as {value:.10g}; if that is wrong give the decimal mark (decimal) {other!r}."
            )
    if n := len(dialect.above):
        table.notes.append(f"{n} line{'s' * (n > 1)} above the header {'are' if n > 1 else 'is'} not used.")
    return table


def ragged_note(n_rows: int, width: int, first_line: int) -> str:
    """Say that rows had another number of cells than the table has columns."""
    what = "1 row does not" if n_rows == 1 else f"{n_rows} rows do not"
    near = "near" if n_rows == 1 else "first near"
    return f"{what} have {width} cells ({near} line {first_line}): missing cells are empty, extra cells are left out."
