"""How a text table is written: each delimiter is tried, and the one that gives the best table is taken."""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from typing import TYPE_CHECKING

from stiction.errors import RecordError
from stiction.sources.formats.table_rows import find_table
from stiction.sources.values.thousands import find_torn_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stiction.sources.formats.table_rows import Dialect

__all__ = ["sniff_text", "split_lines", "unwrap"]

DELIMITERS = (",", ";", "\t", "|", " ")
_FORMULA_TEXT = re.compile(r'="(.*)"')


def unwrap(cell: str) -> str:
    """Give the text of a cell that a spreadsheet program wrote as the formula ``="text"``."""
    match = _FORMULA_TEXT.fullmatch(cell.strip()) if cell.startswith('="') else None
    return match[1] if match else cell


def split_lines(lines: Sequence[str], delimiter: str) -> tuple[list[list[str]], list[int]]:
    """Split lines into rows of cells, with the number of lines above each row; quotes may hold line ends."""
    if delimiter == " ":
        lines = [line.strip() for line in lines]
    reader = csv.reader(lines, delimiter=delimiter, skipinitialspace=True)
    has_formula = any('="' in line for line in lines)
    ends, rows = [0], []
    for row in reader:
        rows.append([unwrap(cell) for cell in row] if has_formula else row)
        ends.append(reader.line_num)
    return rows, ends[:-1]


def sniff_text(name: str, lines: list[str], delimiter: str | None, decimal: str | None) -> Dialect:
    """Find the dialect by the first lines; raises RecordError without numbers, or if names or commas do not fit."""
    if lines and (match := re.fullmatch(r'"?sep=(.)"?\s*', lines[0], re.IGNORECASE)):
        delimiter = delimiter or match[1]
        lines = ["\n", *lines[1:]]
    best: tuple[Dialect, list[list[str]], int] | None = None
    problem = ""
    candidates = [mark for mark in DELIMITERS if mark == "," or any(mark in line for line in lines)]
    for mark in (delimiter,) if delimiter else candidates:
        try:
            rows, lines_above = split_lines(lines, mark)
        except csv.Error as error:
            problem = f"a quote that never closes ({error})"
            continue
        dialect = find_table(rows, decimal, delimiter=mark)
        if dialect is not None and (best is None or dialect.score > best[0].score + 1e-9):
            best = dialect, rows, lines_above[dialect.first_row]
    if best is None and not problem:
        first_line = lines[0].strip()[:60] if lines else ""
        raise RecordError(
            f"no row of numbers was found (the file begins {first_line!r}); "
            "export a table with a header and one row of numbers per sample.",
            where=f"{name}, line 1",
        )
    if best is not None:
        problem = _find_split_numbers(best[0], best[1])
    if best is None or problem:
        raise RecordError(
            f"contains {problem}; export it with semicolons between columns, or without quotes.", where=name
        )
    dialect, rows, first_line = best
    if _lacks_name(dialect, rows):
        raise RecordError(
            f"has {dialect.width - 1} names for {dialect.width} columns; write one name above each column, so "
            "that it is clear which is which.",
            where=name,
        )
    return replace(dialect, first_row=first_line)


def _find_split_numbers(dialect: Dialect, rows: list[list[str]]) -> str:
    """Say how commas within numbers split the cells of a table with commas between columns; empty when none do."""
    first, width = dialect.first_row, dialect.width
    header_width = len(rows[first - 1]) if first else 0
    if dialect.delimiter != "," or header_width < 2:
        return ""
    what = f"rows of {width} cells under a header of {header_width}: "
    if not dialect.header and width in (2 * header_width - 1, 2 * header_width):
        return what + "a decimal comma between commas"
    torn = [find_torn_number(row) for row in rows[first:] if len(row) == width]
    if header_width < width and 2 * sum(map(bool, torn)) > len(torn):
        return what + f"commas between columns and within numbers, such as {next(filter(None, torn))}"
    return ""


def _lacks_name(dialect: Dialect, rows: list[list[str]]) -> bool:
    """Whether the header has one name less than there are columns, and the last column is not an empty one."""
    first, width, header = dialect.first_row, dialect.width, dialect.header
    if not header or width < 3 or max(map(len, rows[:first])) >= width:
        return False
    if header[-1][0] == "Date" != [*rows[first - 1], ""][0]:  # `_split_header` gave the clock after a date its name
        return False
    data = [row for row in rows[first:] if len(row) == width]
    return 2 * sum(bool(row[-1].strip()) for row in data) > len(data)
