"""Text tables: CSV and its relatives. The head is read in Python, the columns by polars."""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING

from stiction.errors import RecordError
from stiction.sources.formats.cut_off import find_cut_off
from stiction.sources.formats.table_rows import make_table, ragged_note
from stiction.sources.formats.text_dialect import sniff_text, split_lines
from stiction.sources.formats.text_encoding import find_encoding, to_utf8
from stiction.sources.formats.text_lines import MAX_LINE_LENGTH, check_lines, line_too_long
from stiction.sources.table import SNIFF_ROWS

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import polars as pl

    from stiction.sources.byte_source import ByteSource
    from stiction.sources.formats.text_dialect import Dialect
    from stiction.sources.formats.text_lines import LineCheck
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable

__all__ = ["read", "recognises"]

MAX_TORN_SHARE = 0.01
"""Share of the rows in which a comma may have split a number into two cells [-]."""
_DELIMITER_NAMES = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "pipes", " ": "spaces"}


def recognises(head: bytes, name: str) -> bool:  # noqa: ARG001 (all formats have these arguments)
    """Whether a file is a text, by its first bytes.

    Examples
    --------
    >>> recognises(b"time,PV,OP", "x.csv"), recognises(bytes(range(200)), "x.csv")
    (True, False)
    """
    return find_encoding(head) is not None


def read(source: ByteSource, options: ReadOptions) -> list[RawTable]:
    r"""Read a text table.

    Parameters
    ----------
    source : ByteSource
        The file.
    options : ReadOptions
        `delimiter` and `decimal`, where the user gave them.

    Returns
    -------
    list of RawTable
        One table with text columns; an empty cell is null, or "" when it stood in quotes.

    Raises
    ------
    RecordError
        When the file is no text, holds no row of numbers, a line cannot be split into columns, or a comma between
        thousands splits numbers.

    Examples
    --------
    >>> import io
    >>> from stiction.sources.byte_source import open_source
    >>> from stiction.sources.options import ReadOptions
    >>> text = "time;PV;OP\n" + "".join(f"{k};5,{k};40\n" for k in range(9))
    >>> [table] = read(open_source(io.BytesIO(text.encode()), ReadOptions()), ReadOptions())
    >>> table.header, table.decimal, table.column(1)[2]
    ([['time', 'PV', 'OP']], ',', '5,2')
    """
    name, encoding = source.origin.name, find_encoding(source.head)
    if encoding is None:
        raise RecordError(f"{name}: is binary, not text; export the loop as CSV.")
    path, encoding = to_utf8(source, encoding)
    head = _read_head(path, name)
    dialect = sniff_text(name, head[:SNIFF_ROWS], options.delimiter, options.decimal)
    end, last_line = find_cut_off(path, dialect)
    copy = source.scratch.path() / f"{source.path.name}.rows"
    found = check_lines(
        path, copy, name, delimiter=dialect.delimiter, width=dialect.width, skip_lines=dialect.first_row, end=end
    )
    _refuse_torn_numbers(name, dialect, found)
    table = make_table(
        source.origin,
        dialect,
        _sample(head[dialect.first_row :], dialect.delimiter),
        _ColumnReader(source, found, dialect),
        options,
        first_line=dialect.first_row + 1,
    )
    notes = []
    if encoding not in ("utf-8", "utf-8-sig"):
        notes.append(f"The text encoding is taken as {encoding}.")
    if options.delimiter is None and dialect.delimiter != ",":
        mark = _DELIMITER_NAMES.get(dialect.delimiter, repr(dialect.delimiter))
        notes.append(f"Columns are separated by {mark}.")
    table.notes[:0] = notes
    if last_line:
        table.notes.append(
            f"The file ends within line {found.n_lines + 1} ({last_line!r}), so it was cut off: that row is left out; "
            "export or copy it again."
        )
    if found.ragged_rows:
        table.notes.append(ragged_note(found.ragged_rows, dialect.width, found.first_ragged_line))
    return [table]


class _ColumnReader:
    """Reads columns of the checked file; it keeps the temporary files of the source."""

    def __init__(self, source: ByteSource, found: LineCheck, dialect: Dialect) -> None:
        self._source, self._found, self._dialect = source, found, dialect

    def __call__(self, positions: Sequence[int]) -> pl.DataFrame:
        import polars as pl

        name, found, dialect = self._source.origin.name, self._found, self._dialect
        columns = [f"c{i}" for i in range(dialect.width)]
        try:
            frame = (
                pl.scan_csv(
                    found.path,
                    has_header=False,
                    separator=dialect.delimiter,
                    schema=dict.fromkeys(columns, pl.String),
                    skip_lines=found.skip_lines,
                    glob=False,
                )
                .select(self._cell(columns[i]) for i in positions)
                .collect()
            )
        except (pl.exceptions.PolarsError, OSError) as error:
            reason = str(error).strip().partition("\n")[0]
            raise RecordError(f"{name}: cannot be split into columns ({reason}); export it as plain CSV.") from None
        if frame.height != found.n_rows:
            raise RecordError(
                f"{name}: has {found.n_rows} rows of data, of which {frame.height} were read; export it as plain CSV."
            )
        return frame

    def _cell(self, column: str) -> pl.Expr:
        import polars as pl

        cell = pl.col(column)
        if self._found.has_padding:
            cell = cell.str.strip_chars()
        return cell.str.replace(r'^="(.*)"$', "$1") if self._found.has_formulas else cell


def _read_head(path: Path, name: str) -> list[str]:
    """Read the first lines."""
    lines: list[str] = []
    with open(path, encoding="utf-8-sig", newline="\n") as file:
        while len(lines) < 2 * SNIFF_ROWS and (line := file.readline(MAX_LINE_LENGTH)):
            if len(line) >= MAX_LINE_LENGTH:
                raise line_too_long(name, len(lines) + 1)
            lines.append(line)
    return lines


def _sample(lines: list[str], delimiter: str) -> list[list[str]]:
    """Split the first written lines of data into cells."""
    try:
        rows, _ = split_lines(lines, delimiter)
    except csv.Error:
        rows = [row for line in lines for row in split_lines([line], delimiter)[0]]
    return [row for row in rows if any(cell and not cell.isspace() for cell in row)][:SNIFF_ROWS]


def _refuse_torn_numbers(name: str, dialect: Dialect, found: LineCheck) -> None:
    torn = found.torn_numbers
    if dialect.delimiter == "," and len(torn) > MAX_TORN_SHARE * found.n_rows:
        raise RecordError(
            f"{name}: has commas between columns and within numbers, such as {torn[0]}; export it with semicolons "
            "between columns, or with such numbers in quotes."
        )
