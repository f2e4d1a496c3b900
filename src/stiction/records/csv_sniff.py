"""Guess how a text table is written: delimiter, decimal mark, where the header ends.

Each row is seen as a word with a letter for each cell, such as ``tnn-`` for a stamp, two numbers and an empty cell.
"""

from __future__ import annotations

import csv
import itertools
import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

from stiction.errors import RecordError
from stiction.records.dialects import MISSING_WORDS, STATUS_WORDS
from stiction.records.numbers import as_number, is_number
from stiction.records.thousands import GROUPS, torn_number
from stiction.records.timestamps import is_clock, is_date, is_stamp

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["Layout", "ends_within", "sniff", "split"]

DELIMITERS = (",", ";", "\t", "|", " ")
_FILLERS = {*MISSING_WORDS, *STATUS_WORDS}
_NUMBER, _GROUPED, _STAMP, _FILLER, _TEXT = "ngt-x"
_SENSE = {_NUMBER: 1.0, _STAMP: 1.0, _GROUPED: 0.9, _FILLER: 0.5, _TEXT: 0.0}
_VALUES = {_NUMBER, _STAMP}
_HEADER_ROWS = 6
ALIKE = 20
"""Rows that write their last number with as many decimals from which one with fewer is cut off [-]: of numbers without
closing zeros one in ten has fewer."""


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


def split(lines: list[str], delimiter: str) -> tuple[list[list[str]], list[int]]:
    """Cut lines into rows of cells, with the lines above each row; quotes may hold line ends, spaces may repeat."""
    if delimiter == " ":
        lines = [line.strip() for line in lines]
    reader = csv.reader(lines, delimiter=delimiter, skipinitialspace=True)
    ends, rows = [0], []
    for row in reader:
        rows.append(row)
        ends.append(reader.line_num)
    return rows, ends[:-1]


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
    best_score, broken, doubled, short = 0.0, "", "", ""
    there = [mark for mark in DELIMITERS if mark == "," or any(mark in line for line in lines)]
    for mark in (delimiter,) if delimiter else there:
        try:
            cells, above_row = split(lines, mark)
        except csv.Error as error:
            broken = f"a quote that never closes ({error})"
            continue
        for point in (decimal,) if decimal else (".", ","):
            words = ["".join(_letter(cell, point, mark) for cell in row) for row in cells]
            first = _first_row(cells, words, point)
            if first is None:
                continue
            data = [word for row, word in zip(cells[first:], words[first:], strict=True) if _is_written(row)]
            width = Counter(map(len, data)).most_common(1)[0][0]
            score = _score(data, width)
            if score > best_score + 1e-9:
                header, passed_over = _header(cells[:first], words[:first], width, cells[first])
                short = _short(cells, first, width, header)
                doubled = _doubled(cells, first, width, bool(header)) if mark == "," else ""
                best_score, best = score, Layout(mark, point, header, above_row[first], width, passed_over)
    if doubled or (broken and best is None):
        raise RecordError(
            f"{name}: holds {doubled or broken}; export it with semicolons between columns, or without quotes."
        )
    if best is not None and short:
        raise RecordError(f"{name}: has {short}; write one over each column, so that it is plain which is which.")
    if best is None:
        first_line = lines[0].strip()[:60] if lines else ""
        raise RecordError(
            f"{name}, line 1: no row of numbers was found (the file begins {first_line!r}); "
            "export a table with a header and one row of numbers per sample."
        )
    return best


def _doubled(cells: list[list[str]], first: int, width: int, has_header: bool) -> str:
    """What commas within numbers have done to a table with commas between columns; empty where nothing."""
    above = len(cells[first - 1]) if first else 0
    what = f"rows of {width} cells under a header of {above}: "
    if above > 1 and not has_header and width in (2 * above - 1, 2 * above):
        return what + "a decimal comma between commas"
    torn = [torn_number(row) for row in cells[first:] if len(row) == width]
    if 1 < above < width and 2 * sum(map(bool, torn)) > len(torn):
        return what + f"commas between columns and within numbers, such as {next(filter(None, torn))}"
    return ""


def _short(cells: list[list[str]], first: int, width: int, header: list[list[str]]) -> str:
    """That a column without a name stands among the others; empty where none does, or one that is empty, at the end."""
    rows = [row for row in cells[first:] if len(row) == width]
    put_in = bool(header) and header[-1][0] == "Date" != [*cells[first - 1], ""][0]
    if not header or put_in or max(map(len, cells[:first])) >= width:
        return ""
    filled = sum(bool(row[-1].strip()) for row in rows)
    return f"{width - 1} names over {width} columns" if 2 * filled > len(rows) else ""


def _is_written(row: list[str]) -> bool:
    return any(cell.strip() for cell in row)


def _letter(cell: str, decimal: str, delimiter: str) -> str:
    text = cell.strip()
    if text.upper() in _FILLERS:
        return _FILLER
    if is_number(text, decimal, grouped=False):
        return _NUMBER
    if is_stamp(text):
        return _STAMP
    if decimal == "." and delimiter == "," and GROUPS.fullmatch(text):
        return _NUMBER  # quoted "1,234" between commas is more likely a group of thousands
    return _GROUPED if is_number(text, decimal) else _TEXT


def _score(data: list[str], width: int) -> float:
    """Share of cells that make sense; a single column counts half, one more column a little."""
    good = sum(_SENSE[letter] for word in data if len(word) == width for letter in word)
    return good / sum(map(len, data)) * (1.0 if width > 1 else 0.5) + 0.001 * min(width, 50)


def _first_row(cells: list[list[str]], words: list[str], decimal: str) -> int | None:
    """The row from which on the rows, taken together, are most like those of the lower half."""
    plain = [word.replace(_GROUPED, _NUMBER) for word in words]
    written = [i for i, row in enumerate(cells) if _is_written(row)]
    lower = written[len(written) // 2 :]
    if not lower:
        return None
    width = Counter(len(plain[i]) for i in lower).most_common(1)[0][0]
    lower = [i for i in lower if len(plain[i]) == width]
    usual = ""
    for column in zip(*(plain[i] for i in lower), strict=True):
        known = Counter(letter for letter in column if letter != _FILLER)
        usual += known.most_common(1)[0][0] if known else _FILLER
    numbers = [j for j, letter in enumerate(usual) if letter == _NUMBER]
    rising = (j for j in numbers if _only_rises([as_number(cells[i][j], decimal) for i in lower]))
    key = usual.index(_STAMP) if _STAMP in usual else next(rising, None)
    best, first, total = 0.0, None, 0.0
    for i in reversed(written):
        total += _likeness(plain[i], usual, key)
        if total >= best and _VALUES & set(plain[i]):
            best, first = total, i
    return first


def _only_rises(values: list[float]) -> bool:
    """Whether numbers go one way only, as time and counters do."""
    pairs = [(a, b) for a, b in itertools.pairwise(values) if a == a and b == b]
    return bool(pairs) and (all(a < b for a, b in pairs) or all(a > b for a, b in pairs))


def _likeness(word: str, usual: str, key: int | None) -> float:
    """From -1, no row of the table, to 1; the key column, time or a counter, says most about a row."""
    pairs = list(zip(word, usual, strict=False))
    alike = sum(a in _VALUES and b in (a, _FILLER) for a, b in pairs)
    shown = word[key] if key is not None and key < len(word) else _FILLER
    if key is not None and shown == usual[key]:
        return alike / len(usual)
    other = sum(b in _VALUES and a not in (b, _FILLER) for a, b in pairs)
    return -1.0 if shown != _FILLER else (alike - other) / len(usual)


def _header(rows: list[list[str]], words: list[str], width: int, data: list[str]) -> tuple[list[list[str]], int]:
    """A few rows just above the data and as wide as it, and how many written lines above are none.

    Lines of a title block have a value behind the word in the first cell, or a blank line between them and the header.
    """
    header: list[list[str]] = []
    written = sum(any(cell.strip("# ") for cell in row) for row in rows)
    for row, word in zip(reversed(rows), reversed(words), strict=True):
        blank = not any(cell.strip("# ") for cell in row)
        if len(header) == _HEADER_ROWS or (blank and any(all(above) for above in header)):
            break
        if blank or (row[0].strip() and _VALUES & set(word)):
            continue
        if abs(len(row) - width) > 1:
            break
        if len(row) < width and len(data) > 1 and is_date(data[0]) and is_clock(data[1]):
            row = ["Date", *row]  # "2026-02-01 10:00:00 1.5" between spaces under one heading
        header.insert(0, [" ".join(cell.split()) for cell in [*row, ""][:width]])
    plain = [row for row in header if not re.match(r"#\s*\w", row[0])]
    header = [[row[0].lstrip("# "), *row[1:]] for row in plain or header]
    return header, written - len(header)


def ends_within(row: Sequence[str], before: Sequence[Sequence[str]]) -> bool:
    """Whether the last row of a file that closes no line is cut off: it has less than all rows before it.

    Parameters
    ----------
    row : sequence of str
        Its cells.
    before : sequence of sequences of str
        Those of the rows before it.

    Examples
    --------
    >>> rows = [["10:00", f"{50 + k / 7:.3f}"] for k in range(30)]
    >>> [ends_within(row, rows) for row in (["10:0"], ["10:00", "51."], ["10:00", "51.28"], ["10:00", "51.286"])]
    [True, True, True, False]
    """
    if before and all(len(row) == len(other) - 1 and not other[-1].strip() for other in before):
        before = [other[:-1] for other in before]  # a delimiter closes each row, and need not close the last
    ends = [other[-1].strip() for other in before if len(other) == len(row)]
    if len(ends) < len(before) or len(before) < 2:
        return len(before) > 1 and all(len(row) < len(other) for other in before)
    last = row[-1].strip()
    if not last:  # a column that is shorter than others ends so, and nothing is lost
        return False
    if last[-1] in ".,+-eE":
        return not any(end.endswith(last[-1]) for end in ends)
    marked = [re.search(r"\d[.,](\d+)$", end) for end in ends]
    places = {len(mark[1]) for mark in marked if mark}
    if not all(marked):
        return all(end != last and end.startswith(last) for end in ends) and not last[-1].isdigit()
    found = re.search(r"\d[.,](\d+)$", last)
    return len(ends) >= ALIKE and len(places) == 1 and (len(found[1]) if found else 0) < places.pop()
