"""Tables from rows of text cells: what text files and spreadsheets share."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import polars as pl

from stiction.sources.roles.vocabulary import MISSING_WORDS, STATUS_TEXTS
from stiction.sources.table import SNIFF_ROWS, RawTable
from stiction.sources.time.text_stamps import is_clock, is_date, is_timestamp
from stiction.sources.values.number_text import is_number, parse_number, usual_unit
from stiction.sources.values.thousands import GROUPS, find_ambiguous_cell

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import Origin

__all__ = ["Dialect", "find_table", "make_table", "ragged_note", "table_from_rows"]

_NO_VALUE_TEXTS = {*MISSING_WORDS, *STATUS_TEXTS}
_NUMBER, _GROUPED, _STAMP, _NO_VALUE, _TEXT = "ngt-x"
_WEIGHT = {_NUMBER: 1.0, _STAMP: 1.0, _GROUPED: 0.9, _NO_VALUE: 0.5, _TEXT: 0.0}
_VALUES = {_NUMBER, _STAMP}
_HEADER_ROWS = 6


@dataclass(frozen=True)
class Dialect:
    """How a table is written."""

    delimiter: str
    decimal: str
    header: list[list[str]]
    """Header rows, each `width` cells long."""
    above: list[list[str]]
    """Other written rows above the data."""
    first_row: int
    """Rows, or lines of a text, above the first row of data."""
    width: int
    """Cells in a row of data."""
    score: float = 0.0
    """Share of cells that are stamps, numbers or known status texts [-]."""


def find_table(rows: list[list[str]], decimal: str | None, *, delimiter: str = "") -> Dialect | None:
    """Find the table in the first rows; None without numbers. `delimiter` is empty for a spreadsheet."""
    best: Dialect | None = None
    for mark in (decimal,) if decimal else (".", ","):
        words = ["".join(_letter(cell, mark, delimiter) for cell in row) for row in rows]
        first = _first_row(rows, words, mark)
        if first is None:
            continue
        data = [word for row, word in zip(rows[first:], words[first:], strict=True) if _is_written(row)]
        width = Counter(map(len, data)).most_common(1)[0][0]
        score = _score(data, width)
        if best is None or score > best.score + 1e-9:
            header, above = _split_header(rows[:first], words[:first], width, rows[first])
            best = Dialect(delimiter, mark, header, above, first, width, score)
        if not any(letter in word for word in data for letter in (_GROUPED, _TEXT)):
            break  # all cells are understood
    return best


def _is_written(row: Sequence[str]) -> bool:
    return any(cell.strip() for cell in row)


def _letter(cell: str, decimal: str, delimiter: str) -> str:
    text = cell.strip()
    if is_number(text, decimal, grouped=False):
        return _NUMBER
    if text.upper() in _NO_VALUE_TEXTS:
        return _NO_VALUE
    if is_timestamp(text):
        return _STAMP
    if decimal == "." and delimiter == "," and GROUPS.fullmatch(text):
        return _NUMBER  # quoted "1,234" between commas is a thousand, not a decimal comma
    return _GROUPED if is_number(text, decimal) else _TEXT


def _score(data: list[str], width: int) -> float:
    """Share of cells that are understood; a single column counts half, one more column a little."""
    good = sum(_WEIGHT[letter] for word in data if len(word) == width for letter in word)
    return good / sum(map(len, data)) * (1.0 if width > 1 else 0.5) + 0.001 * min(width, 50)


def _first_row(rows: list[list[str]], words: list[str], decimal: str) -> int | None:
    """Find the row from which on the rows, taken together, are most like those of the lower half."""
    plain = [word.replace(_GROUPED, _NUMBER) for word in words]
    written = [i for i, row in enumerate(rows) if _is_written(row)]
    lower = written[len(written) // 2 :]
    if not lower:
        return None
    width = Counter(len(plain[i]) for i in lower).most_common(1)[0][0]
    lower = [i for i in lower if len(plain[i]) == width]
    usual = ""
    for column in zip(*(plain[i] for i in lower), strict=True):
        known = Counter(letter for letter in column if letter != _NO_VALUE)
        usual += known.most_common(1)[0][0] if known else _NO_VALUE
    numbers = [j for j, letter in enumerate(usual) if letter == _NUMBER]
    monotonic = (j for j in numbers if _is_monotonic([parse_number(rows[i][j], decimal) for i in lower]))
    key = usual.index(_STAMP) if _STAMP in usual else next(monotonic, None)
    best, first, total = 0.0, None, 0.0
    for i in reversed(written):
        total += _likeness(plain[i], usual, key)
        if total >= best and _VALUES & set(plain[i]):
            best, first = total, i
    return first


def _is_monotonic(values: list[float]) -> bool:
    """Whether numbers only rise or only fall, as time and counters do."""
    pairs = [(a, b) for a, b in itertools.pairwise(values) if a == a and b == b]
    return bool(pairs) and (all(a < b for a, b in pairs) or all(a > b for a, b in pairs))


def _likeness(word: str, usual: str, key: int | None) -> float:
    """From -1, no row of the table, to 1; the key column, time or a counter, says most about a row."""
    pairs = list(zip(word, usual, strict=False))
    alike = sum(a in _VALUES and b in (a, _NO_VALUE) for a, b in pairs)
    shown = word[key] if key is not None and key < len(word) else _NO_VALUE
    if key is not None and shown == usual[key]:
        return alike / len(usual)
    other = sum(b in _VALUES and a not in (b, _NO_VALUE) for a, b in pairs)
    return -1.0 if shown != _NO_VALUE else (alike - other) / len(usual)


def _split_header(
    rows: list[list[str]], words: list[str], width: int, data: list[str]
) -> tuple[list[list[str]], list[list[str]]]:
    """Split the rows above the data into header rows, as wide as the data, and a title block and other lines."""
    positions: list[int] = []
    header: list[list[str]] = []
    for i in reversed(range(len(rows))):
        row = rows[i]
        blank = not any(cell.strip("# ") for cell in row)
        if len(header) == _HEADER_ROWS or (blank and any(all(above) for above in header)):
            break
        if blank or (row[0].strip() and _VALUES & set(words[i])):
            continue
        if abs(len(row) - width) > 1:
            break
        if len(row) < width and len(data) > 1 and is_date(data[0]) and is_clock(data[1]):
            row = ["Date", *row]  # "2026-02-01 10:00:00 1.5" between spaces under one heading
        header.insert(0, [" ".join(cell.split()) for cell in [*row, ""][:width]])
        positions.insert(0, i)
    plain = [k for k, row in enumerate(header) if not re.match(r"#\s*\w", row[0])]
    used = {positions[k] for k in plain} or set(positions)
    header = [header[k] for k in plain] or header
    above = [row for i, row in enumerate(rows) if i not in used and any(cell.strip("# ") for cell in row)]
    return [[row[0].lstrip("# "), *row[1:]] for row in header], above


def table_from_rows(
    origin: Origin, rows: list[list[str]], options: ReadOptions, *, first_line: int = 1
) -> RawTable | None:
    """Make a table of rows of text cells, title and header included; None when there is no row of numbers."""
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
