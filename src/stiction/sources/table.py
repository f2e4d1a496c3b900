"""A table as a file format hands it over: header rows, the first rows as text, and columns on demand."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    import polars as pl

__all__ = ["SNIFF_ROWS", "Origin", "RawTable"]

SNIFF_ROWS = 200
"""Rows from which the form of a table is recognised [-]."""


@dataclass(frozen=True)
class Origin:
    """Where a table comes from."""

    name: str
    """File name as given, "stdin", "frame" or a database URL without its password."""
    stem: str
    """Tag of a loop whose header names none."""
    digest: Callable[[], str] | None = field(default=None, repr=False, compare=False)
    """Computes `sha256`; None when there is no file."""

    @cached_property
    def sha256(self) -> str:
        """Digest of the file's bytes as stored; empty when there is no file, or a large one."""
        return "" if self.digest is None else self.digest()


@dataclass(eq=False)
class RawTable:
    """Columns of cells, not yet interpreted."""

    origin: Origin
    header: list[list[str]]
    """Header rows, each `width` cells long; empty when the table has none."""
    sample: list[list[str]]
    """The first `SNIFF_ROWS` rows of data as text; a row may be shorter or longer than `width`."""
    width: int
    """Number of columns."""
    reader: Callable[[Sequence[int]], pl.DataFrame]
    """From column positions to these columns, in that order. Text formats give String columns with the cells as
    written (stripped of blanks); others give the types that the file stores."""
    first_line: int = 1
    """Line or row of the source (from 1) of the first row of data, for messages."""
    decimal: str = "."
    """Decimal mark of numbers in text cells."""
    notes: list[str] = field(default_factory=list)
    """Assumptions made so far, a sentence each."""
    above: list[list[str]] = field(default_factory=list)
    """All written rows above the first row of data that are not in `header` (titles, key and value pairs, the tag of a
    file, markers such as ``#NAMES``), each with as many cells as it has."""
    metadata: dict[str, str] = field(default_factory=dict)
    """Key and value pairs stored with the table (Parquet, Arrow)."""
    _columns: dict[int, pl.Series] = field(default_factory=dict, repr=False)

    def load(self, positions: Iterable[int]) -> None:
        """Read some columns in one pass, if they were not read before."""
        wanted = sorted({position for position in positions if position not in self._columns})
        if wanted:
            frame = self.reader(wanted)
            self._columns.update(zip(wanted, frame.get_columns(), strict=True))

    def column(self, position: int) -> pl.Series:
        """Give one column, shape (n_rows,)."""
        self.load([position])
        return self._columns[position]

    def drop(self, positions: Iterable[int]) -> None:
        """Forget the cells of columns that are not needed any more, to save memory."""
        for position in positions:
            self._columns.pop(position, None)

    def sample_column(self, position: int) -> list[str]:
        """Give the cells of a column in the first rows, without the empty ones."""
        return [cell for row in self.sample if position < len(row) and (cell := row[position].strip())]
