"""Text tables: CSV and its relatives, read in blocks so that a large file needs little more than itself."""

from __future__ import annotations

import csv
import io
import itertools
from collections import Counter, deque
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.number_format import count_noun
from stiction.errors import RecordError
from stiction.records.blocks import in_blocks, tagged
from stiction.records.columns import choose_names, unit_of
from stiction.records.csv_sniff import ends_within, sniff
from stiction.records.numbers import is_number, one_unit, to_numbers, usual_unit
from stiction.records.source import text_encoding
from stiction.records.table import LOOK_AHEAD, Columns
from stiction.records.thousands import grouped_cell, may_be_parted, parted_cells, torn_number

if TYPE_CHECKING:
    from _csv import Reader as CsvReader
    from collections.abc import Iterable, Iterator, Sequence

    from stiction.records.source import Source

__all__ = ["CsvTable", "open_csv"]

MAX_LINE = 1_000_000
MAX_ROWS = 5_000_000
_BLOCK = 20_000
BEFORE, SHOWN = 50, 24
"""Rows beside which the last one is seen to be cut off, and characters of it that are told."""
TORN = 0.01
"""Share of the rows that may have a number torn in two [-]."""
_NAMES = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "pipes", " ": "spaces"}


def open_csv(source: Source, *, delimiter: str | None = None, decimal: str | None = None) -> CsvTable:
    """Lay out a text table; the rows are read by `CsvTable.take`.

    Parameters
    ----------
    source : Source
        The file's bytes.
    delimiter, decimal : str, optional
        When not given they are guessed.

    Raises
    ------
    RecordError
        When the bytes are no text or hold no row of numbers.
    """
    return CsvTable(source, delimiter, decimal)


class CsvTable:
    """A text table (see `stiction.records.table.Table`)."""

    def __init__(self, source: Source, delimiter: str | None, decimal: str | None) -> None:
        encoding = text_encoding(source.data)
        if encoding is None:
            raise RecordError(f"{source.name}: is binary, not text; export the loop as CSV.")
        self.source = source
        self._encoding = encoding
        self._unended, self._cut_off = "", ""
        self._in_blocks = in_blocks(self._as_written())
        head = [line for line, _ in zip(self._lines(), range(LOOK_AHEAD), strict=False)]
        layout = sniff(source.name, head, delimiter, decimal)
        self.header, self.decimal, self.width = layout.header, layout.decimal, layout.width
        self._delimiter, self._sure = layout.delimiter, decimal is not None
        self.first_line = layout.skip + 1
        self.sample = [row for _, row in zip(range(LOOK_AHEAD), self._rows(), strict=False)]
        units = [
            usual_unit([row[i] for row in self.sample if i < len(row)], layout.decimal) for i in range(layout.width)
        ]
        if not self.header and (foreign := [unit for unit in units if unit not in ("", "%")]):
            raise RecordError(
                f"{source.name}: has numbers in {foreign[0]} under no header; write one, to say what they are."
            )
        for name, unit in zip(choose_names(self.header)[0], units, strict=False):
            if unit and (told := unit_of(name)) and told.upper() != unit.upper():
                raise RecordError(
                    f"{source.name}, column {name}: is in {told} by its header and in {unit} by its numbers; mend the "
                    "one that is wrong."
                )
        if any(units) and self.header:
            self.header = [*self.header, units]
        self.guesses: list[str] = []
        if encoding not in ("utf-8", "utf-8-sig"):
            self.guesses.append(f"The text is taken as {encoding}.")
        if delimiter is None and layout.delimiter != ",":
            self.guesses.append(f"Columns are parted by {_NAMES.get(layout.delimiter, repr(layout.delimiter))}.")
        if decimal is None and layout.decimal == ",":
            self.guesses.append("Numbers have a decimal comma.")
        if decimal is None and (seen := grouped_cell(self.sample, layout.delimiter, layout.decimal, layout.width)):
            cell, value, other = seen
            self.guesses.append(f"{cell!r} is read as {value:.10g}; if that is wrong give decimal={other!r}.")
        if layout.passed_over:
            self.guesses.append(f"Passed over: {count_noun(layout.passed_over, 'line')} above the header.")

    def is_numeric(self, column: int) -> bool:
        """Whether the first rows of a column hold numbers."""
        cells = [row[column] for row in self.sample if column < len(row) and row[column].strip()]
        return bool(cells) and 2 * sum(is_number(cell, self.decimal) for cell in cells) > len(cells)

    def take(self, text: Sequence[int], numbers: Sequence[int]) -> Columns:
        """Read some columns as text and some as numbers.

        Raises
        ------
        RecordError
            When there are more than `MAX_ROWS` rows or a line longer than `MAX_LINE` characters, or when marks between
            thousands make a number two, or may make it another.
        """
        taken = Columns(text={i: [] for i in text}, texts={i: Counter() for i in numbers})
        parts: dict[int, list] = {i: [] for i in numbers}
        units: dict[int, Counter[str]] = {i: Counter() for i in numbers}
        ragged, first_ragged = 0, 0
        torn: list[str] = []
        rows = self._rows()
        while block := [row for _, row in zip(range(_BLOCK), rows, strict=False)]:
            odd = [k for k, row in enumerate(block) if len(row) != self.width]
            if odd:
                first_ragged = first_ragged or self.first_line + taken.rows + odd[0]
                ragged += len(odd)
                for k in odd:
                    torn += filter(None, [torn_number(block[k])] if len(block[k]) > self.width else ())
                    block[k] = [*block[k], *[""] * self.width][: self.width]
            taken.rows += len(block)
            if taken.rows > MAX_ROWS:
                raise RecordError(f"{self.source.name}: has more than {MAX_ROWS} rows; export a shorter time.")
            for i in text:
                taken.text[i].extend(row[i] for row in block)
            for i in numbers:
                found = to_numbers([row[i] for row in block], self.decimal)
                parts[i].append(found.values)
                taken.texts[i] += found.texts
                units[i] += found.units
        for i in numbers:
            one_unit(units[i], f"{self.source.name}, column {self._name(i)}")
            taken.numbers[i] = np.concatenate(parts[i]) if parts[i] else np.empty(0)
        self._refuse_parted(taken, torn)
        if self._cut_off and self._cut_off not in self.guesses:
            self.guesses.append(self._cut_off)
        if ragged:
            rows = count_noun(ragged, "row")
            guess = f"{rows} of other than {self.width} cells (first near line {first_ragged}); the rest is empty."
            if guess not in self.guesses:  # columns may be taken in turns
                self.guesses.append(guess)
        return taken

    def _refuse_parted(self, taken: Columns, torn: list[str]) -> None:
        """Refuse numbers whose thousands are parted in a way that makes others of them."""
        if self._delimiter == "," and len(torn) > TORN * taken.rows:
            raise RecordError(
                f"{self.source.name}: has commas between columns and within numbers, such as {torn[0]}; export it "
                "with semicolons between columns, or with such numbers in quotes."
            )
        for i, values in taken.numbers.items():
            if self._sure or not may_be_parted(values):
                continue
            if found := parted_cells((row[i] for row in self._rows() if i < len(row)), self.decimal):
                whole, marked = found
                other = "," if self.decimal == "." else "."
                raise RecordError(
                    f"{self.source.name}, column {self._name(i)}: {whole!r} beside {marked!r} "
                    f"looks like thousands parted by {self.decimal!r}; give decimal={other!r} if they are, "
                    f"decimal={self.decimal!r} if not."
                )

    def _name(self, column: int) -> str | int:
        names, _ = choose_names(self.header)
        return names[column] if names and names[column] else column

    def _lines(self) -> Iterator[str]:
        return tagged(self._as_written()) if self._in_blocks else self._as_written()

    def _as_written(self) -> Iterator[str]:
        stream = io.TextIOWrapper(io.BytesIO(self.source.data), encoding=self._encoding, errors="replace")
        for number, line in enumerate(iter(lambda: stream.readline(MAX_LINE), ""), start=1):
            if len(line) >= MAX_LINE:
                raise RecordError(
                    f"{self.source.name}, line {number}: is longer than {MAX_LINE} characters; "
                    "export one row per sample, each on a line of its own."
                )
            self._unended = "" if line.endswith("\n") else line
            yield line

    def _rows(self) -> Iterator[list[str]]:
        lines = self._lines()
        for _ in range(self.first_line - 1):
            next(lines, None)
        reader, before = self._cut(lines), deque(maxlen=BEFORE)
        for number in itertools.count(1):
            row, why = [], ""
            try:
                row = next(reader)
            except StopIteration:
                return
            except csv.Error as error:
                why = str(error)
            if reader.line_num > number:
                # A quote that is never closed would swallow the rows after it.
                why = "a cell in quotes goes on over the next line; take the quote or the line break out"
            if why:
                where = self.first_line - 1 + number
                raise RecordError(f"{self.source.name}, line {where}: cannot be cut into columns ({why}).")
            if any(cell and not cell.isspace() for cell in row):
                if self._unended and not self._in_blocks and ends_within(row, before):
                    where, end = self.first_line - 1 + number, self._unended[-SHOWN:]
                    self._cut_off = (
                        f"The file ends within line {where} ({end!r}), as one that was cut off: that row is left out; "
                        "export or copy it again."
                    )
                    return
                before.append(row)
                yield row

    def _cut(self, lines: Iterable[str]) -> CsvReader:
        if self._delimiter == " ":
            lines = (line.strip() for line in lines)
        return csv.reader(lines, delimiter=self._delimiter, skipinitialspace=True)
