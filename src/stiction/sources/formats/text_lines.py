"""Rows of a text table: those without the usual number of cells are repaired in a copy, and counted."""

from __future__ import annotations

import csv
import io
import re
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError
from stiction.sources.formats.text_dialect import split_lines, unwrap
from stiction.sources.values.thousands import find_torn_number

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path
    from typing import BinaryIO

    from numpy.typing import NDArray

__all__ = ["MAX_LINE_LENGTH", "RowRepair", "is_cut_off", "line_too_long"]

MAX_LINE_LENGTH = 1_000_000
"""Longest line that is read [bytes]."""
BLOCK_BYTES = 8 << 20
ROWS_BEFORE = 50
"""Rows with which the last one is compared [-]."""
MAX_SHOWN = 24
"""Characters of an incomplete row in the message."""
_NEWLINE, _QUOTE, _RETURN, _SPACE = b'\n"\r '


@dataclass
class RowRepair:
    """Checks the rows of a UTF-8 file; raises RecordError when a line is too long, or a quote goes on over lines."""

    name: str
    """Name of the source for messages."""
    delimiter: str
    width: int
    """Cells that every row gets."""
    n_rows: int = 0
    """Rows of data [-]."""
    n_lines: int = 0
    """Lines that were read, those above the data included [-]."""
    ragged_rows: int = 0
    """Rows with another number of cells [-]."""
    first_ragged_line: int = 0
    torn_numbers: list[str] = field(default_factory=list)
    """Numbers of ragged rows that a comma between thousands may have split into two cells."""
    cut_off: str = ""
    """End of an incomplete last row, which is left out; empty where the file ends with a whole row."""

    def run(self, path: Path, copy: Path, *, skip_lines: int) -> Path:
        """Check the rows after the header, and leave out an incomplete last one; give the file, or a copy if needed."""
        out: BinaryIO | None = None
        with open(path, "rb") as file, ExitStack() as stack:
            offset = sum(len(file.readline()) for _ in range(skip_lines))
            self.n_lines, size, before = skip_lines, path.stat().st_size, b""
            for block in _blocks(file):
                is_last = offset + len(block) == size
                if is_last and not block.endswith(b"\n") and block.strip():
                    self.cut_off = self._find_cut_off(before, block)
                pieces = [] if self.cut_off else self._repair(block, is_last=is_last)
                if out is None and pieces is not None:
                    out = stack.enter_context(open(copy, "wb"))
                    _copy_start(path, out, offset)
                if out is not None:
                    out.writelines([block] if pieces is None else pieces)
                offset, before = offset + len(block), block
        return path if out is None else copy

    def _find_cut_off(self, before: bytes, last: bytes) -> str:
        """Give the end of the last line, which no line feed ends, where it is less than a row; else an empty text."""
        lines = [*before.rsplit(b"\n", ROWS_BEFORE + 1)[-ROWS_BEFORE - 1 : -1], last]
        texts = [line.decode(errors="replace") for line in lines]
        try:
            *rows, row = [split_lines([text], self.delimiter)[0][0] for text in texts if text.strip()]
        except csv.Error:  # `_split` refuses the line
            return ""
        return texts[-1][-MAX_SHOWN:] if is_cut_off(row, [row for row in rows if any(map(str.strip, row))]) else ""

    def _repair(self, block: bytes, *, is_last: bool) -> list[bytes] | None:
        """Give a block in pieces, with repaired rows; None when none needs it."""
        is_spaced = self.delimiter == " " and b'"' not in block
        block = _join_spaces(block) if is_spaced else block
        data = np.frombuffer(block, dtype=np.uint8)
        ends = np.flatnonzero(data == _NEWLINE) + 1
        if not ends.size or ends[-1] != data.size:
            ends = np.append(ends, data.size)
        starts = np.concatenate([[0], ends[:-1]])
        lengths = ends - starts
        if (lengths > MAX_LINE_LENGTH).any():
            raise line_too_long(self.name, self.n_lines + 1 + int(np.argmax(lengths > MAX_LINE_LENGTH)))
        is_odd = self._count_marks(data, starts, has_quote=b'"' in block) != self.width - 1
        is_odd |= np.isin(data[starts], [*b' \t\r\n"', ord(self.delimiter)]) & (lengths < 3 * self.width + 2)  # blank?
        first_line = self.n_lines + 1
        self.n_lines += len(starts)
        self.n_rows += len(starts)
        if not is_odd.any():
            return [block] if is_spaced else None
        pieces, done, odd = [], 0, np.flatnonzero(is_odd)
        for k, start, end in zip(odd.tolist(), starts[odd].tolist(), ends[odd].tolist(), strict=True):
            row = self._split(block[start:end].decode(), first_line + k, is_last and end == data.size)
            pieces += [block[done:start], self._write(row, first_line + k)]
            done = end
        return [*pieces, block[done:]]

    def _count_marks(self, data: NDArray[np.uint8], starts: NDArray[np.int64], *, has_quote: bool) -> NDArray[np.int64]:
        """Count the delimiters of each row outside quotes; -1 where quotes do not stand at the ends of cells."""
        n, code = len(starts), ord(self.delimiter)
        if not has_quote:
            at = np.flatnonzero(data == code)
            if self.width > 1 and len(at) == n * (self.width - 1):  # the usual table: no row is odd
                table = at.reshape(n, -1)
                if (table[:, 0] >= starts).all() and (table[:-1, -1] < starts[1:]).all():
                    return np.full(n, self.width - 1)
            return np.bincount(np.searchsorted(starts, at, side="right") - 1, minlength=n)
        at = np.flatnonzero((data == code) | (data == _QUOTE))
        row = np.searchsorted(starts, at, side="right") - 1
        is_quote = data[at] == _QUOTE
        quotes_before = np.cumsum(is_quote) - is_quote
        quotes_in_row = np.bincount(row[is_quote], minlength=n)
        is_outside = (quotes_before - (np.cumsum(quotes_in_row) - quotes_in_row)[row]) % 2 == 0
        counts = np.bincount(row[is_outside & ~is_quote], minlength=n)
        before, after = data[np.maximum(at - 1, 0)], data[np.minimum(at + 1, data.size - 1)]
        before[at == 0], after[at == data.size - 1] = _NEWLINE, _NEWLINE
        opens = np.isin(before, [_NEWLINE, _QUOTE, code])
        closes = np.isin(after, [_NEWLINE, _RETURN, _QUOTE, code])
        counts[row[is_quote & ~np.where(is_outside, opens, closes)]] = -1
        counts[quotes_in_row % 2 == 1] = -1
        return counts

    def _split(self, line: str, number: int, may_end: bool) -> list[str]:
        """Split one line into cells as the csv module does."""
        if '"' not in line and self.delimiter != " ":
            return line.split(self.delimiter)
        lines = iter([line.strip() if self.delimiter == " " else line, "\n"])
        reader = csv.reader(lines, delimiter=self.delimiter, skipinitialspace=True)
        try:
            row = next(reader)
            if reader.line_num > 1 and not may_end:
                raise csv.Error("a cell in quotes goes on over the next line; take the quote or the line break out")
        except csv.Error as error:
            raise RecordError(
                f"cannot be split into columns ({error}); correct the line.", where=f"{self.name}, line {number}"
            ) from None
        return row

    def _write(self, row: list[str], number: int) -> bytes:
        """Write a row plainly, with the right number of cells; a row without a written cell is dropped."""
        if not "".join(row).strip():
            self.n_rows -= 1
            return b""
        if len(row) != self.width:
            self.ragged_rows += 1
            self.first_ragged_line = self.first_ragged_line or number
            if self.delimiter == "," and len(row) > self.width and (torn := find_torn_number(row)):
                self.torn_numbers.append(torn)
        cells = [cell.strip() for cell in row[: self.width]] + [""] * (self.width - len(row))
        joined = self.delimiter.join(cells)  # most rows need no quotes, and the csv module takes three times as long
        if '"' not in joined and len(joined.splitlines()) == 1 and joined.count(self.delimiter) < self.width:
            return f"{joined}\n".encode()
        text = io.StringIO()
        cells = [unwrap(" ".join(cell.splitlines())).strip() for cell in cells]
        csv.writer(text, delimiter=self.delimiter, lineterminator="\n").writerow(cells)
        return text.getvalue().encode()


def _join_spaces(block: bytes) -> bytes:
    """Make one space of several between cells, and none of those at the ends of a line."""
    data = np.frombuffer(block + b"\n", dtype=np.uint8)
    is_space = data == _SPACE
    follows = np.concatenate([[True], is_space[:-1] | (data[:-1] == _NEWLINE)])
    joined = data[~(is_space & follows)]
    ends = (joined[1:] == _NEWLINE) | (joined[1:] == _RETURN)
    return joined[:-1][~((joined[:-1] == _SPACE) & ends)].tobytes() or b"\n"


def _blocks(file: BinaryIO) -> Iterator[bytes]:
    """Read a file in blocks that end with a line, or within one that is too long."""
    rest = b""
    while data := file.read(BLOCK_BYTES):
        data = rest + data
        cut = data.rfind(b"\n") + 1
        if len(data) - cut > MAX_LINE_LENGTH:
            cut = len(data)
        rest = data[cut:]
        if cut:
            yield data[:cut]
    if rest:
        yield rest


def line_too_long(name: str, line: int) -> RecordError:
    """Make the error for a line longer than `MAX_LINE_LENGTH`."""
    return RecordError(
        f"is longer than {MAX_LINE_LENGTH} characters; export one row per sample, each on a line of its own.",
        where=f"{name}, line {line}",
    )


def _copy_start(path: Path, out: BinaryIO, n_bytes: int) -> None:
    with open(path, "rb") as file:
        while n_bytes > 0 and (data := file.read(min(n_bytes, BLOCK_BYTES))):
            out.write(data)
            n_bytes -= len(data)


def is_cut_off(row: Sequence[str], before: Sequence[Sequence[str]], *, min_rows: int = 20) -> bool:
    """Whether the last row has fewer cells than all others, or fewer decimals than the `min_rows` rows before."""
    if before and all(len(row) == len(other) - 1 and not other[-1].strip() for other in before):
        before = [other[:-1] for other in before]  # a delimiter ends each row, and need not end the last
    ends = [other[-1].strip() for other in before if len(other) == len(row)]
    if len(ends) < len(before) or len(before) < 2:
        return len(before) > 1 and all(len(row) < len(other) for other in before)
    last = row[-1].strip()
    if not last:  # a column that is shorter than others ends so, and nothing is lost
        return False
    if last[-1] in ".,+-eE":
        return not any(end.endswith(last[-1]) for end in ends)
    decimals = [re.search(r"\d[.,](\d+)$", end) for end in ends]
    if not all(decimals):
        return all(end != last and end.startswith(last) for end in ends) and not last[-1].isdigit()
    places = {len(match[1]) for match in decimals if match}
    match = re.search(r"\d[.,](\d+)$", last)
    return len(ends) >= min_rows and len(places) == 1 and (len(match[1]) if match else 0) < places.pop()
