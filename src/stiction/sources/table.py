"""A table as a file format gives it, and the recorded signals (tag columns) that the layouts find in it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from stiction.errors import RecordError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    import numpy as np
    import polars as pl
    from numpy.typing import NDArray

    from stiction.sources.time.stamps import Stamps

__all__ = ["SNIFF_ROWS", "Clock", "Origin", "RawTable", "TagColumn", "find_column"]

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
    reader: Callable[..., pl.DataFrame]
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
    count_rows: Callable[[], int] | None = None
    """Returns the number of rows, where the format tells it without reading them; then `reader` takes a first row
    too."""
    spreads: dict[int, Callable[[], NDArray[np.float64]]] = field(default_factory=dict)
    """Column of averages -> gives the range of the signal within each interval, shape (n_rows,)."""
    first_row: int = 0
    """First row that is read; those before it do not fit into the memory."""
    clock: set[int] = field(default_factory=set)
    """Columns that tell the time, where they were found; they are read with the first signals, in one pass."""
    _columns: dict[int, pl.Series] = field(default_factory=dict, repr=False)

    def load(self, positions: Iterable[int]) -> None:
        """Read some columns in one pass, if they were not read before."""
        wanted = set(positions) - self._columns.keys()
        if wanted:
            wanted = sorted(wanted | (self.clock - self._columns.keys()))
            frame = self.reader(wanted, self.first_row) if self.first_row else self.reader(wanted)
            self._columns.update(zip(wanted, frame.get_columns(), strict=True))

    def column(self, position: int) -> pl.Series:
        """Give one column, shape (n_rows,)."""
        self.load([position])
        return self._columns[position]

    def keep_last(self, rows: int) -> None:
        """Read no more than the last rows; nothing changes where columns were read already."""
        n = self.count_rows() if self.count_rows and not self._columns else 0
        if n > rows and not self.first_row:
            self.first_row = n - rows
            self.notes.append(
                f"Of {n:,} rows only the last {rows:,} are read, as more do not fit into the memory; allow more with "
                "max_memory."
            )

    def drop(self, positions: Iterable[int]) -> None:
        """Forget the cells of columns that are not needed any more, to save memory."""
        for position in positions:
            self._columns.pop(position, None)
            self.clock.discard(position)

    def sample_column(self, position: int) -> list[str]:
        """Give the cells of a column in the first rows, without the empty ones."""
        return [cell for row in self.sample if position < len(row) and (cell := row[position].strip())]


@dataclass(eq=False)
class Clock:
    """Time stamps that one or several columns share, parsed when they are first needed."""

    parse: Callable[[], Stamps]
    parse_first: Callable[[], Stamps] | None = None
    """Parses the first rows alone."""

    @cached_property
    def kind(self) -> str:
        """Kind of the stamps: "utc", "local" or "relative"; by the first rows where that is possible."""
        return (self.parse_first() if self.parse_first else self.stamps).kind

    @cached_property
    def stamps(self) -> Stamps:
        """Time of each row."""
        return self.parse()


@dataclass(eq=False)
class TagColumn:
    """One column of cells. Columns with the same `clock` object have the same rows."""

    name: str
    """Heading as written, such as ``FIC-101.PV``; of a long table the tag."""
    table: RawTable
    """The table it comes from."""
    clock: Clock | None
    """Time of each row; None when the source has no time column, and rows are evenly spaced."""
    load: Callable[[], pl.Series]
    """Returns the cells, shape (n_rows,)."""
    unit: str = ""
    """Unit as written; empty when the source names none."""
    description: str = ""
    """Description as written; empty when there is none."""
    position: int | None = None
    """Column position in the table (from 0), where the user may name it by number."""
    flags: dict[str, Callable[[], pl.Series]] = field(default_factory=dict)
    """Heading -> gives the quality or bad flag that stands with each value, where each row has one (long tables)."""
    spread: Callable[[], NDArray[np.float64]] | None = None
    """Returns the range of the signal within the interval of each average; None where that is not known."""
    own_clock: bool = False
    """Whether this tag was stored at times of its own, so that it must be aligned with the loop's other tags."""
    address: str = ""
    """How a historian finds the tag; empty elsewhere."""
    parts: tuple[TagColumn, ...] = ()
    """The columns of several files of which it is made, in the order of time; empty where it is one."""

    @cached_property
    def cells(self) -> pl.Series:
        """The cells, shape (n_rows,)."""
        return self.load()


def find_column(
    wanted: str | int, names: Sequence[str], positions: Sequence[int | None], last: int, what: str, where: str
) -> int:
    """Find the place of a column that the user names, by its name or else its position, of which `last` is the largest.

    Raises RecordError, with the signal as `what` and the file as `where`, when there is none.
    """
    text = str(wanted).strip().upper()
    by_name = (k for k, name in enumerate(names) if isinstance(wanted, str) and name.strip().upper() == text)
    by_number = (k for k, position in enumerate(positions) if text == str(position))
    if (place := next(by_name, next(by_number, None))) is not None:
        return place
    if text.lstrip("-").isdigit():
        raise RecordError(f"has no column {text} for {what}; they are numbered 0 to {last}.", where=where)
    shown = ", ".join(filter(None, names[:20])) or "none, as the file has no header: give a number from 0"
    raise RecordError(f"has no column {wanted!r} for {what}; its columns are {shown}.", where=where)
