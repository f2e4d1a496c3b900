"""Long tables, a row for each tag and time: every tag on its own time stamps, as a historian stores by exception.

A stored value stands until the tag's next one; nothing is drawn between them.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import RecordError
from stiction.records.numbers import is_number, to_numbers
from stiction.records.table import Columns
from stiction.records.timestamps import Stamps

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from stiction.records.table import Table

__all__ = ["LongTable", "long_columns", "widened"]

_TAG = ("TAG", "TAGNAME", "TAG NAME", "TAG_NAME", "POINT", "POINT NAME", "SIGNAL", "VARIABLE")
_VALUE = ("VALUE", "VAL", "READING")
_QUALITY = ("QUALITY", "QUAL", "OPC QUALITY", "STATUS")
MAX_TAGS = 400
_BEST = 10.0
"""Percentile of a tag's steps that is taken as the time between two scans [%]."""
_LONGEST_REST = 20.0
"""Usual steps of the file (their 90th percentile) over which a value is held; beyond it all tags are missing."""


def long_columns(names: Sequence[str]) -> dict[str, int] | None:
    """Columns of tag, value and quality of a long table, None where it is none.

    Examples
    --------
    >>> long_columns(["Tag", "Timestamp", "Value"]), long_columns(["Time", "FIC-1.PV", "FIC-1.OP"])
    ({'tag': 0, 'value': 2}, None)
    """
    words = [name.strip().upper() for name in names]
    given = {
        role: next(i for i, word in enumerate(words) if word in known)
        for role, known in (("tag", _TAG), ("value", _VALUE), ("quality", _QUALITY))
        if any(word in known for word in words)
    }
    return given if {"tag", "value"} <= set(given) else None


class LongTable:
    """A long table laid out wide, a row for each time at which any tag was stored (see `table.Table`)."""

    def __init__(self, table: Table, stamps: Stamps, cells: dict[str, tuple[NDArray[np.int64], list[str]]]) -> None:
        self.source, self.first_line, self.decimal, self.guesses = (
            *(table.source, table.first_line, table.decimal),
            list(table.guesses),
        )
        self.stamps = stamps
        self.header = [["time", *cells]]
        self._cells = list(cells.values())
        steps = [np.diff(stamps.seconds[rows]) for rows, _ in self._cells if len(rows) > 2]
        self.dt = min((float(np.percentile(step, _BEST)) for step in steps), default=0.0)
        usual = float(np.percentile(np.diff(stamps.seconds), 90.0)) if len(stamps.seconds) > 1 else 0.0
        self.hold = _LONGEST_REST * usual
        self.sample = [["0", *(cells[0] if cells else "" for _, cells in self._cells)]]
        count = sum(len(rows) for rows, _ in self._cells)
        self.guesses.append(
            f"{count} values of {len(cells)} tags, each on its own time stamps: a value stands until the next."
        )

    def is_numeric(self, column: int) -> bool:
        """Whether a tag holds numbers."""
        cells = [cell for cell in self._cells[column - 1][1][:200] if cell.strip()] if column else ["0"]
        return 2 * sum(is_number(cell, self.decimal) for cell in cells) > len(cells)

    def stored_at(self, column: int) -> NDArray[np.int64]:
        """Row of the value that stands at each row, -1 before the first, shape (n_rows,)."""
        rows = self._cells[column - 1][0]
        return np.append(rows, -1)[np.searchsorted(rows, np.arange(len(self.stamps.seconds)), side="right") - 1]

    def take(self, text: Sequence[int], numbers: Sequence[int]) -> Columns:
        """Give tags as text or as numbers at every row."""
        n = len(self.stamps.seconds)
        taken = Columns(rows=n)
        for i in text:
            where = np.searchsorted(self._cells[i - 1][0], np.arange(n), side="right") - 1
            cells = self._cells[i - 1][1]
            taken.text[i] = [cells[k] if k >= 0 else "" for k in where]
        for i in numbers:
            values, texts = to_numbers(self._cells[i - 1][1], self.decimal) if i else (np.zeros(0), Counter[str]())
            where = np.searchsorted(self._cells[i - 1][0], np.arange(n), side="right") - 1
            taken.numbers[i] = np.append(values, np.nan)[where]
            taken.texts[i] = texts
        return taken


def widened(table: Table, columns: dict[str, int], time: int, parse: Callable[[list[str]], Stamps]) -> LongTable:
    """Lay a long table out wide.

    Parameters
    ----------
    table : Table
        The long table.
    columns : dict
        What `long_columns` found.
    time : int
        Column of the time stamps.
    parse : callable
        From cells of time to `Stamps`.

    Raises
    ------
    RecordError
        When there are more than `MAX_TAGS` tags or no stamp is understood.
    """
    taken = table.take([time, *columns.values()], [])
    stamps = parse(taken.text[time])
    known = np.flatnonzero(np.isfinite(stamps.seconds))
    if known.size < 2:
        raise RecordError(
            f"{table.source.name}: the time stamps of the long table are not understood; give time_format."
        )
    seconds, row = np.unique(stamps.seconds[known], return_inverse=True)
    tags = np.array([tag.strip() for tag in taken.text[columns["tag"]]], dtype=object)[known]
    values = np.array(taken.text[columns["value"]], dtype=object)[known]
    if "quality" in columns:
        from stiction.records.signals import is_good

        good = [is_good(taken.text[columns["quality"]][k].strip().upper()) for k in known]
        values[~np.array(good)] = "BAD"
    names = list(dict.fromkeys(tags))
    if len(names) > MAX_TAGS:
        raise RecordError(
            f"{table.source.name}: holds {len(names)} tags; {MAX_TAGS} are read at once, export fewer loops."
        )
    cells: dict[str, tuple[NDArray[np.int64], list[str]]] = {}
    for name in names:
        mine = np.flatnonzero(tags == name)
        mine = mine[np.argsort(row[mine], kind="stable")]
        last = np.append(np.diff(row[mine]) > 0, True)
        cells[name] = row[mine][last].astype(np.int64), list(values[mine][last])
    guesses = list(stamps.guesses)
    if lost := len(stamps.seconds) - known.size:
        guesses.append(f"{lost} rows without a readable time stamp were left out.")
    return LongTable(table, Stamps(seconds, stamps.kind, guesses), cells)
