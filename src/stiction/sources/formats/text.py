"""Text tables: CSV and its relatives. The head is read in Python, the columns by polars."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import polars as pl

from stiction.errors import RecordError
from stiction.sources.formats.table_rows import make_table, ragged_note
from stiction.sources.formats.text_dialect import sniff_text, split_lines
from stiction.sources.formats.text_encoding import find_encoding, to_utf8
from stiction.sources.formats.text_lines import MAX_LINE_LENGTH, RowRepair, line_too_long
from stiction.sources.table import SNIFF_ROWS

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from stiction.sources.byte_source import ByteSource
    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable

__all__ = ["read", "recognises"]

MIN_HEAD_LINES, MAX_HEAD_LENGTH = 60, 250_000
"""Lines that are always looked at, and characters from which no more are [-]."""
MAX_TORN_SHARE = 0.01
"""Share of the rows in which a comma may have split a number into two cells [-]."""
_DELIMITER_NAMES = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "pipes", " ": "spaces"}


def recognises(head: bytes, name: str) -> bool:  # noqa: ARG001 (all formats have these arguments)
    """Whether a file is a text, by its first bytes."""
    return find_encoding(head) is not None


def read(source: ByteSource, options: ReadOptions) -> list[RawTable]:
    """Read a text table: one table with text columns; an empty cell is null, or "" when it stood in quotes."""
    name = source.origin.name
    path, encoding = to_utf8(source, find_encoding(source.head) or "latin-1")
    head = _read_head(path, name)
    dialect = sniff_text(name, head[:SNIFF_ROWS], options.delimiter, options.decimal)
    mark, width, skip_lines = dialect.delimiter, dialect.width, dialect.first_row
    rows = RowRepair(name, mark, width)
    path = rows.run(path, source.scratch.path() / f"{source.path.name}.rows", skip_lines=skip_lines)
    if mark == "," and len(rows.torn_numbers) > MAX_TORN_SHARE * rows.n_rows:
        raise RecordError(
            f"has commas between columns and within numbers, such as {rows.torn_numbers[0]}; export it with "
            "semicolons between columns, or with such numbers in quotes.",
            where=name,
        )
    has_padding = re.search(rf'[ \t](["\r\n]|{re.escape(mark)})|(["\n]|{re.escape(mark)})[ \t]|="', "".join(head))

    def read_columns(positions: Sequence[int]) -> pl.DataFrame:
        name = source.origin.name  # the source keeps the temporary file
        try:
            lazy = pl.scan_csv(
                path,
                has_header=False,
                separator=mark,
                schema={f"c{i}": pl.String for i in range(width)},
                skip_lines=skip_lines,
                glob=False,
            )
            frame = lazy.select(f"c{i}" for i in positions).collect()
        except (pl.exceptions.PolarsError, OSError) as error:
            reason = str(error).strip().partition("\n")[0]
            raise RecordError(f"cannot be split into columns ({reason}); export it as plain CSV.", where=name) from None
        if frame.height != rows.n_rows:
            raise RecordError(
                f"has {rows.n_rows} rows of data, of which {frame.height} were read; export it as plain CSV.",
                where=name,
            )
        return frame.select(pl.all().str.strip_chars().str.replace(r'^="(.*)"$', "$1")) if has_padding else frame

    sample = [row for line in head[skip_lines:] for row in split_lines([line], mark)[0] if any(map(str.strip, row))]
    table = make_table(source.origin, dialect, sample[:SNIFF_ROWS], read_columns, options, first_line=skip_lines + 1)
    if options.delimiter is None and mark != ",":
        table.notes.insert(0, f"Columns are separated by {_DELIMITER_NAMES.get(mark, repr(mark))}.")
    if encoding not in ("utf-8", "utf-8-sig"):
        table.notes.insert(0, f"The text encoding is taken as {encoding}.")
    if rows.cut_off:
        table.notes.append(
            f"The file ends within line {rows.n_lines + 1} ({rows.cut_off!r}), so it was cut off: that row is left "
            "out; export or copy it again."
        )
    if rows.ragged_rows:
        table.notes.append(ragged_note(rows.ragged_rows, width, rows.first_ragged_line))
    return [table]


def _read_head(path: Path, name: str) -> list[str]:
    """Read the first lines; fewer of a table with many columns."""
    lines: list[str] = []
    length = 0
    with open(path, encoding="utf-8-sig", newline="\n") as file:
        while len(lines) < (2 * SNIFF_ROWS if length < MAX_HEAD_LENGTH else MIN_HEAD_LINES):
            line = file.readline(MAX_LINE_LENGTH)
            if not line:
                break
            if len(line) >= MAX_LINE_LENGTH:
                raise line_too_long(name, len(lines) + 1)
            lines.append(line)
            length += len(line)
    return lines
