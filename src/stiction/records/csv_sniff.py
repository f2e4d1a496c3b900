"""Guess how a text table is written: delimiter, decimal mark, where the header ends."""

from __future__ import annotations

import csv
import re
from collections import Counter
from dataclasses import dataclass

from stiction.errors import RecordError
from stiction.records.dialects import MISSING_WORDS, STATUS_WORDS
from stiction.records.numbers import is_number
from stiction.records.timestamps import is_clock, is_date, is_stamp

__all__ = ["Layout", "grouped_cell", "sniff", "split"]

DELIMITERS = (",", ";", "\t", "|", " ")
_GROUPS = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_FILLERS = {*MISSING_WORDS, *STATUS_WORDS}


@dataclass(frozen=True)
class Layout:
    """How a text table is written."""

    delimiter: str
    decimal: str
    header: list[list[str]]
    """Header rows, each padded to `width`."""
    skip: int
    """Lines before the first row of data."""
    width: int
    """Fields in a row of data."""
    passed_over: int
    """Written lines above the header."""


def split(lines: list[str], delimiter: str) -> list[list[str]]:
    """Cut lines into cells, honouring quotes; runs of spaces count as one delimiter."""
    if delimiter == " ":
        lines = [line.strip() for line in lines]
    return list(csv.reader(lines, delimiter=delimiter, skipinitialspace=True))


def sniff(name: str, lines: list[str], delimiter: str | None, decimal: str | None) -> Layout:
    """Lay out a table from its first lines.

    Raises
    ------
    RecordError
        When no row of numbers is found.
    """
    if lines and (marked := re.fullmatch(r'"?sep=(.)"?\s*', lines[0], re.IGNORECASE)):
        delimiter = delimiter or marked.group(1)
    best: Layout | None = None
    best_score, broken, doubled = 0.0, "", ""
    for mark in (delimiter,) if delimiter else DELIMITERS:
        try:
            cells = split(lines, mark)
        except csv.Error as error:
            broken = f"a quote that never closes ({error})"
            continue
        for point in (decimal,) if decimal else (".", ","):
            first = next((i for i, row in enumerate(cells) if _is_data(row, point, mark)), None)
            if first is None:
                continue
            data = [row for row in cells[first:] if any(cell.strip() for cell in row)]
            width = Counter(map(len, data)).most_common(1)[0][0]
            score = _score(data, width, point, mark)
            if score > best_score + 1e-9:
                header, passed_over = _header(cells[:first], width, data[0])
                above = len(cells[first - 1]) if first and not header else 0
                twice = mark == "," and above > 1 and width in (2 * above - 1, 2 * above)
                doubled = f"rows of {width} cells under a header of {above}: a decimal comma between commas" * twice
                best_score, best = score, Layout(mark, point, header, first, width, passed_over)
    if doubled or (broken and best is None):
        raise RecordError(
            f"{name}: holds {doubled or broken}; export it with semicolons between columns, or without quotes."
        )
    if best is None:
        first_line = lines[0].strip()[:60] if lines else ""
        raise RecordError(
            f"{name}, line 1: no row of numbers was found (the file begins {first_line!r}); "
            "export a table with a header and one row of numbers per sample."
        )
    return best


def _score(data: list[list[str]], width: int, decimal: str, delimiter: str) -> float:
    """Share of cells that make sense; a single column counts half, one more column a little."""
    good = sum(_sense(cell, decimal, delimiter) for row in data if len(row) == width for cell in row)
    return good / sum(map(len, data)) * (1.0 if width > 1 else 0.5) + 0.001 * min(width, 50)


def _sense(cell: str, decimal: str, delimiter: str) -> float:
    text = cell.strip()
    if text.upper() in _FILLERS:
        return 0.5
    if is_number(text, decimal, grouped=False) or is_stamp(text):
        return 1.0
    if decimal == "." and delimiter == "," and _GROUPS.fullmatch(text):
        return 1.0  # quoted "1,234" between commas is more likely a group of thousands
    return 0.9 if is_number(text, decimal) else 0.0


def _is_data(row: list[str], decimal: str, delimiter: str) -> bool:
    marks = [_sense(cell, decimal, delimiter) for cell in row if cell.strip()]
    return any(mark > 0.5 for mark in marks) and 2 * sum(mark > 0.0 for mark in marks) >= len(marks)


def grouped_cell(rows: list[list[str]], layout: Layout) -> str | None:
    """Find a cell such as "1,234" between commas, whose comma may be a decimal mark after all."""
    if (layout.delimiter, layout.decimal) != (",", "."):
        return None
    return next((cell for row in rows for cell in row if _GROUPS.fullmatch(cell.strip())), None)


def _header(rows: list[list[str]], width: int, data: list[str]) -> tuple[list[list[str]], int]:
    """Up to three rows just above the data and as wide as it, and how many written lines above are none."""
    header: list[list[str]] = []
    rest = [[row[0].lstrip("# "), *row[1:]] for row in rows if any(cell.strip("# ") for cell in row)]
    while rest and len(header) < 3 and abs(len(rest[-1]) - width) <= 1:
        row = rest.pop()
        if len(row) < width and len(data) > 1 and is_date(data[0]) and is_clock(data[1]):
            row = ["Date", *row]  # "2026-02-01 10:00:00 1.5" between spaces under one heading
        header.insert(0, [" ".join(cell.split()) for cell in [*row, ""][:width]])
    return header, len(rest)
