"""Lines of a text table, all checked: every row gets the same number of cells, and every repair is counted.

Rows that need no repair are never touched in Python; the file is copied only when some row does.
"""

from __future__ import annotations

import csv
import io
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from stiction.errors import RecordError
from stiction.sources.formats.text_dialect import unwrap
from stiction.sources.values.thousands import find_torn_number

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from typing import BinaryIO

    from numpy.typing import NDArray

__all__ = ["MAX_LINE_LENGTH", "LineCheck", "check_lines", "line_too_long"]

MAX_LINE_LENGTH = 1_000_000
"""Longest line that is read [bytes]."""
BLOCK_BYTES = 8 << 20
_NEWLINE, _QUOTE, _RETURN = b'\n"\r'
_BEFORE_QUOTE, _AFTER_QUOTE = b'\n"', b'\r\n"'
_BLANKS = b' \t\r\n"'


@dataclass
class LineCheck:
    """What the check of all lines found."""

    path: Path
    """The file itself, or a copy with the repaired rows."""
    skip_lines: int
    """Lines of `path` above the data."""
    n_rows: int = 0
    """Rows of data that `path` holds [-]."""
    ragged_rows: int = 0
    """Rows with another number of cells [-]."""
    first_ragged_line: int = 0
    torn_numbers: list[str] = field(default_factory=list)
    """Numbers of ragged rows that a comma between thousands may have split into two cells."""
    has_padding: bool = False
    """Whether some cells begin or end with a blank."""
    has_formulas: bool = False
    """Whether some cells are written as the formula ``="text"``."""
    n_lines: int = 0
    """Lines that were read, those above the data included [-]."""


def check_lines(
    path: Path, copy: Path, name: str, *, delimiter: str, width: int, skip_lines: int, end: int
) -> LineCheck:
    """Check the lines of a UTF-8 file below its header, and repair rows in a copy when some need it.

    Parameters
    ----------
    path, copy : Path
        The file, and where the repaired copy goes.
    name : str
        Name of the source for messages.
    delimiter : str
        Mark between the cells.
    width : int
        Cells in a row.
    skip_lines : int
        Lines above the first row of data.
    end : int
        Size up to which the file is read [bytes]; the copy ends there.

    Raises
    ------
    RecordError
        When a line is too long, or a cell in quotes goes on over the next line.
    """
    found = LineCheck(path, skip_lines)
    check = _RowCheck(name, delimiter, width, found)
    out: BinaryIO | None = None
    with open(path, "rb") as file, ExitStack() as stack:
        for _ in range(skip_lines):
            file.readline()
        line, offset = skip_lines + 1, file.tell()
        is_cut = end < path.stat().st_size
        for block in _blocks(file, name, end):
            n_lines, pieces = check.repair(block, line, is_last=offset + len(block) == end)
            if out is None and (pieces is not None or is_cut):
                out = stack.enter_context(open(copy, "wb"))
                _copy_start(path, out, offset)
            if out is not None:
                out.writelines([block] if pieces is None else pieces)
            line += n_lines
            offset += len(block)
    found.n_lines = line - 1
    if out is not None:
        found.path = copy
    return found


class _RowCheck:
    """Finds the rows of a block that are not plain, and writes them plainly."""

    def __init__(self, name: str, delimiter: str, width: int, found: LineCheck) -> None:
        self.name, self.delimiter, self.width, self.found = name, delimiter, width, found
        self._code = ord(delimiter)
        self._structural = np.zeros(256, dtype=bool)
        self._structural[[_NEWLINE, _QUOTE, self._code]] = True
        self._blank = np.zeros(256, dtype=bool)
        self._blank[[*_BLANKS, self._code]] = True

    def repair(self, block: bytes, first_line: int, *, is_last: bool) -> tuple[int, list[bytes] | None]:
        """Count the lines and give the block in pieces, with repaired rows; None when all its rows are plain."""
        has_quote = b'"' in block
        is_spaced = self._code == ord(" ") and not has_quote
        if is_spaced:
            block = _join_spaces(block) or b"\n"
        data = np.frombuffer(block, dtype=np.uint8)
        ends = np.flatnonzero(data == _NEWLINE) + 1
        if not ends.size or ends[-1] != data.size:
            ends = np.append(ends, data.size)
        starts = np.concatenate([[0], ends[:-1]])
        odd = np.flatnonzero(self._find_odd_rows(data, starts, has_quote=has_quote))
        self.found.has_formulas = self.found.has_formulas or (has_quote and b'"=""' in block)
        self.found.has_padding = self.found.has_padding or self._has_padding(data)
        self.found.n_rows += len(starts)
        blank = self._find_blank_rows(data, starts)
        if not odd.size and not blank.size:
            return len(starts), [block] if is_spaced else None
        pieces, done = [], 0
        for k in np.union1d(odd, blank).tolist():
            pieces.append(block[done : starts[k]])
            done = int(ends[k])
            row = self._parse(block[starts[k] : done], first_line + k, may_end=is_last and done == data.size)
            if any(cell and not cell.isspace() for cell in row):
                pieces.append(self._write(row, first_line + k))
            else:
                self.found.n_rows -= 1
        pieces.append(block[done:])
        return len(starts), pieces

    def _find_odd_rows(
        self, data: NDArray[np.uint8], starts: NDArray[np.int64], *, has_quote: bool
    ) -> NDArray[np.bool_]:
        """Mark rows with another number of cells or with misplaced quotes."""
        n = len(starts)
        if has_quote and self._code == ord(" "):
            return np.ones(n, dtype=bool)
        if not has_quote:
            at = np.flatnonzero(data == self._code)
            if self.width > 1 and len(at) == n * (self.width - 1):
                at = at.reshape(n, -1)
                if (at[:, 0] >= starts).all() and (at[:-1, -1] < starts[1:]).all():
                    return np.zeros(n, dtype=bool)
            row = np.searchsorted(starts, at.ravel(), side="right") - 1
            return np.bincount(row, minlength=n) != self.width - 1
        marks = np.flatnonzero(self._structural[data])
        code = data[marks]
        row = np.searchsorted(starts, marks, side="right") - 1
        is_quote = code == _QUOTE
        before = np.cumsum(is_quote) - is_quote  # quotes of the block before this mark
        before_row = np.concatenate([[0], np.cumsum(np.bincount(row[is_quote], minlength=n))])[:-1]
        is_outside = (before - before_row[row]) % 2 == 0
        per_row = np.bincount(row[is_outside & (code == self._code)], minlength=n)
        odd = (per_row != self.width - 1) | (np.bincount(row[is_quote], minlength=n) % 2 == 1)
        opening, closing = marks[is_quote & is_outside], marks[is_quote & ~is_outside]
        previous = np.where(opening > 0, data[opening - 1], _NEWLINE)
        following = np.where(closing + 1 < data.size, data[np.minimum(closing + 1, data.size - 1)], _NEWLINE)
        odd[row[is_quote & is_outside][~np.isin(previous, [*_BEFORE_QUOTE, self._code])]] = True
        odd[row[is_quote & ~is_outside][~np.isin(following, [*_AFTER_QUOTE, self._code])]] = True
        return odd

    def _has_padding(self, data: NDArray[np.uint8]) -> bool:
        """Whether a blank stands beside a mark or a line end."""
        blank = data == ord(" ")
        if self._code != ord("\t"):
            blank |= data == ord("\t")
        at = np.flatnonzero(blank)
        before, after = data[np.maximum(at - 1, 0)], data[np.minimum(at + 1, data.size - 1)]
        return bool((self._structural[before] | self._structural[after] | (after == _RETURN)).any())

    def _find_blank_rows(self, data: NDArray[np.uint8], starts: NDArray[np.int64]) -> NDArray[np.int64]:
        """Find rows without a written cell; only rows that begin with a blank are looked at."""
        maybe = np.flatnonzero(self._blank[data[starts]])
        if not maybe.size:
            return maybe
        if maybe.size < 0.01 * len(starts):
            stops = np.append(starts, data.size)
            return np.array([k for k in maybe if self._blank[data[stops[k] : stops[k + 1]]].all()], dtype=np.int64)
        return np.flatnonzero(np.logical_and.reduceat(self._blank[data], starts))

    def _parse(self, line: bytes, number: int, *, may_end: bool) -> list[str]:
        """Split one line into cells as the csv module does."""
        text = line.decode().strip() if self.delimiter == " " else line.decode()
        reader = csv.reader(iter([text, "\n"]), delimiter=self.delimiter, skipinitialspace=True)
        try:
            row = next(reader)
            if reader.line_num > 1 and not may_end:
                raise csv.Error("a cell in quotes goes on over the next line; take the quote or the line break out")
        except csv.Error as error:
            raise RecordError(f"{self.name}, line {number}: cannot be split into columns ({error}).") from None
        return [unwrap(cell) for cell in row]

    def _write(self, row: list[str], number: int) -> bytes:
        """Write a row plainly, with the right number of cells."""
        if len(row) != self.width:
            found = self.found
            found.ragged_rows += 1
            found.first_ragged_line = found.first_ragged_line or number
            if len(row) > self.width and (torn := find_torn_number(row)):
                found.torn_numbers.append(torn)
            row = [*row, *[""] * self.width][: self.width]
        text = io.StringIO()
        csv.writer(text, delimiter=self.delimiter, lineterminator="\n").writerow(
            [" ".join(cell.splitlines()) for cell in row]
        )
        return text.getvalue().encode()


def _join_spaces(block: bytes) -> bytes:
    """Make one space of several between cells, and none of those at the ends of a line."""
    data = np.frombuffer(block, dtype=np.uint8)
    is_space = data == ord(" ")
    follows = np.concatenate([[True], is_space[:-1] | (data[:-1] == _NEWLINE)])
    joined = np.append(data[~(is_space & follows)], np.uint8(_NEWLINE))
    ends = (joined[1:] == _NEWLINE) | (joined[1:] == _RETURN)
    return joined[:-1][~((joined[:-1] == ord(" ")) & ends)].tobytes()


def _blocks(file: BinaryIO, name: str, end: int) -> Iterator[bytes]:
    """Read a file in blocks that end with a line; refuse a line that is longer than `MAX_LINE_LENGTH`."""
    rest = b""
    while data := file.read(min(BLOCK_BYTES, end - file.tell())):
        data = rest + data
        cut = data.rfind(b"\n") + 1
        block, rest = data[:cut], data[cut:]
        start = 0
        while start + MAX_LINE_LENGTH < len(data):
            next_start = block.rfind(b"\n", start, start + MAX_LINE_LENGTH) + 1
            start = next_start or _refuse_line(file, name, len(data) - start)
        if block:
            yield block
    if rest:
        yield rest


def _refuse_line(file: BinaryIO, name: str, n_bytes: int) -> NoReturn:
    """Refuse the line that begins `n_bytes` before the place to which a file is read."""
    start = file.tell() - n_bytes
    file.seek(0)
    number = 1
    while start > 0 and (data := file.read(min(BLOCK_BYTES, start))):
        number += data.count(b"\n")
        start -= len(data)
    raise line_too_long(name, number)


def line_too_long(name: str, line: int) -> RecordError:
    """Make the error for a line longer than `MAX_LINE_LENGTH`."""
    return RecordError(
        f"{name}, line {line}: is longer than {MAX_LINE_LENGTH} characters; export one row per sample, each on a line "
        "of its own."
    )


def _copy_start(path: Path, out: BinaryIO, n_bytes: int) -> None:
    """Copy the first bytes of a file."""
    with open(path, "rb") as file:
        while n_bytes > 0 and (data := file.read(min(n_bytes, BLOCK_BYTES))):
            out.write(data)
            n_bytes -= len(data)
