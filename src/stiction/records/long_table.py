"""Tables whose tags have time stamps of their own: a row for each tag and time, or a time column for each tag.

So a historian stores by exception. A stored value stands until the tag's next one; nothing is drawn between them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction.display.number_format import count_noun
from stiction.errors import RecordError
from stiction.records.columns import signal_of
from stiction.records.dialects import OWNER_WORDS, SIGNAL_WORDS, TAG_WORDS, VALUE_WORDS
from stiction.records.numbers import is_number, one_unit, to_numbers, usual_unit
from stiction.records.resample import untangled
from stiction.records.signals import not_good
from stiction.records.table import LOOK_AHEAD, Columns
from stiction.records.timestamps import Stamps, is_stamp

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from stiction.records.table import Table

__all__ = ["LongTable", "apart", "long_columns", "widened"]

NO_NUMBERS = {word for signal in ("mode", "bad", "quality") for word in SIGNAL_WORDS[signal]}
MAX_TAGS = 400
_BEST = 10.0
"""Percentile of a tag's steps that is taken as the time between two scans [%]."""
_LONGEST_REST = 20.0
"""Usual steps of the file (their 90th percentile) over which a value is held; beyond it all tags are missing."""


def long_columns(names: Sequence[str], sample: Sequence[Sequence[str]] = (), decimal: str = ".") -> dict[str, int]:
    """Columns of tag, value, quality and owner of the tag, a loop, of a long table; none where it is none.

    Parameters
    ----------
    names : sequence of str
        Column names.
    sample : sequence of rows
        First rows: where no name tells, tags stand in a column of names of signals, values in the first of numbers.
    decimal : str
        Decimal mark of the numbers.

    Examples
    --------
    >>> from stiction.records.long_table import long_columns
    >>> long_columns(["Tag", "Timestamp", "Value"]), long_columns(["Time", "FIC-1.PV", "FIC-1.OP"])
    ({'tag': 0, 'value': 2}, {})
    >>> long_columns(["what", "when", "x"], [["FIC-1.PV", "2026-02-01 10:00", "3.5"]])
    {'tag': 0, 'value': 2}
    >>> long_columns(["Loop", "Signal", "When", "Value"], [["FIC-1", "PV", "2026-02-01 10:00", "3.5"]])
    {'tag': 1, 'value': 3, 'owner': 0}
    """
    words = [name.strip().upper() for name in names]
    roles = {"tag": TAG_WORDS, "value": VALUE_WORDS, "quality": SIGNAL_WORDS["quality"]}
    given = {role: places[0] for role, known in roles.items() if (places := _places(words, known))}
    if sample:
        columns = [[row[i].strip() for row in sample if i < len(row) and row[i].strip()] for i in range(len(names))]
        tags = [i for i, cells in enumerate(columns) if cells and _are_tags(cells)]
        values = [
            i
            for i, cells in enumerate(columns)
            if i not in tags and cells and all(is_number(cell, decimal) and not is_stamp(cell) for cell in cells)
        ]
        if tags and (values or "value" in given):
            given = {**given, "tag": tags[0], "value": given.get("value", values[0] if values else -1)}
        by_name = _places(words, TAG_WORDS)
        signals = [i for i in by_name if columns[i] and all(map(signal_of, columns[i]))]
        if signals and not tags:
            given["tag"] = signals[0]
        pairs = [signal_of(cell) for cell in columns[given["tag"]]] if "tag" in given else []
        owners = [i for i in (*by_name, *_places(words, OWNER_WORDS)) if i != given.get("tag") and columns[i]]
        if owners and any(pair and not pair[0] for pair in pairs):
            given["owner"] = owners[0]
    return given if {"tag", "value"} <= set(given) else {}


def _places(words: Sequence[str], known: Sequence[str]) -> list[int]:
    return [i for i, word in enumerate(words) if word in known]


def _are_tags(cells: Sequence[str]) -> bool:
    """Whether each cell names a signal that is a number, of a loop or of several."""
    pairs = {signal_of(cell) for cell in set(cells)}
    known = all(pair and pair[1] not in NO_NUMBERS for pair in pairs)
    return known and (len(pairs) > 1 or all(pair and pair[0] for pair in pairs))


class LongTable:
    """Such a table laid out wide, a row for each time at which any tag was stored (see `table.Table`)."""

    def __init__(
        self,
        table: Table,
        stamps: Stamps,
        names: Sequence[str],
        cells: list[tuple[NDArray[np.int64], list[str]]],
        units: Sequence[str] = (),
    ) -> None:
        self.source, self.first_line, self.decimal, self.guesses = (
            *(table.source, table.first_line, table.decimal),
            list(table.guesses),
        )
        self.stamps = stamps
        self.header = [["time", *names], *([["", *units]] if units else [])]
        self._cells = cells
        steps = [np.diff(stamps.seconds[rows]) for rows, _ in self._cells if len(rows) > 2]
        self.dt = min(map(_scan, steps), default=0.0)
        usual = float(np.percentile(np.diff(stamps.seconds), 90.0)) if len(stamps.seconds) > 1 else 0.0
        self.hold = _LONGEST_REST * usual
        self._stands = [self._until(i, names[i - 1]) for i in range(1, len(names) + 1)]
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
        """Row of the value that stands at each row, -1 where none does, shape (n_rows,)."""
        return np.append(self._cells[column - 1][0], -1)[self._which(column)]

    def _until(self, column: int, name: str) -> float:
        """How long a value of a column stands [s]: a set point and a mode until the next."""
        pair, rows = signal_of(name), self._cells[column - 1][0]
        if len(rows) < 3 or not pair or pair[1] in (*SIGNAL_WORDS["sp"], "WSP", *NO_NUMBERS):
            return np.inf
        return max(self.hold, _LONGEST_REST * float(np.percentile(np.diff(self.stamps.seconds[rows]), 90.0)))

    def _which(self, column: int) -> NDArray[np.int64]:
        """Which of a column's values stands at each row, -1 where none does, shape (n_rows,)."""
        rows, seconds = self._cells[column - 1][0], self.stamps.seconds
        which = np.searchsorted(rows, np.arange(seconds.size), side="right") - 1
        age = seconds - seconds[np.append(rows, 0)[which]]
        return np.where(age <= self._stands[column - 1], which, -1)

    def take(self, text: Sequence[int], numbers: Sequence[int]) -> Columns:
        """Give tags as text or as numbers at every row."""
        n = len(self.stamps.seconds)
        taken = Columns(rows=n)
        for i in text:
            where = self._which(i)
            cells = self._cells[i - 1][1]
            taken.text[i] = [cells[k] if k >= 0 else "" for k in where]
        for i in numbers:
            found = to_numbers(self._cells[i - 1][1] if i else [], self.decimal)
            one_unit(found.units, f"{self.source.name}, {self.header[0][i]}")
            taken.numbers[i] = np.append(found.values, np.nan)[self._which(i)]
            taken.texts[i] = found.texts
        return taken


def _scan(steps: NDArray[np.float64]) -> float:
    """Time between two scans of a tag [s]: a short number where one is as near as the steps are to one another."""
    usual, least = (float(np.percentile(steps, share)) for share in (50.0, _BEST))
    dt = usual if least >= 0.7 * usual else least
    near = 0.005 * dt if least < (1.0 - 1e-6) * usual else 1e-6 * dt
    shorter = (float(f"{dt:.{digits}g}") for digits in range(1, 5))
    return next((short for short in shorter if abs(short - dt) <= near), dt)


def widened(
    table: Table, columns: dict[str, int], time: Sequence[int], parse: Callable[[dict[int, list[str]]], Stamps]
) -> LongTable:
    """Lay a long table out wide.

    Parameters
    ----------
    table : Table
        The long table.
    columns : dict
        What `long_columns` found.
    time : sequence of int
        Columns of the time stamps.
    parse : callable
        From cells of all time columns to `Stamps`.

    Raises
    ------
    RecordError
        When there are more than `MAX_TAGS` tags or no stamp is understood.
    """
    taken = table.take(sorted({*time, *columns.values()}), [])
    stamps = parse(taken.text)
    known = np.flatnonzero(np.isfinite(stamps.seconds))
    if known.size < 2:
        row, cell = stamps.unread or (0, "")
        raise RecordError(
            f"{table.source.name}, line {table.first_line + row}: {cell!r} is no time stamp known here; "
            "give time_format='...' (--time-format)."
        )
    tags = np.array([tag.strip() for tag in taken.text[columns["tag"]]], dtype=object)[known]
    values = np.array(taken.text[columns["value"]], dtype=object)[known]
    guesses = list(stamps.guesses)
    if "owner" in columns:
        tags = _owned(tags, np.array([cell.strip() for cell in taken.text[columns["owner"]]], dtype=object)[known])
    if "quality" in columns:
        values[not_good(taken.text[columns["quality"]], "of the quality", guesses)[known]] = "BAD"
    names = list(dict.fromkeys(tags))
    if len(names) > MAX_TAGS:
        raise RecordError(
            f"{table.source.name}: holds {len(names)} tags; {MAX_TAGS} are read at once, export fewer loops."
        )
    if lost := len(stamps.seconds) - known.size:
        guesses.append(f"Left out: {count_noun(lost, 'row')} without a readable time stamp.")
    mine = [np.flatnonzero(tags == name) for name in names]
    clocks = [untangled(replace(stamps, seconds=stamps.seconds[known][rows], guesses=[])) for rows in mine]
    columns_of = [(clock.seconds, list(values[rows])) for clock, rows in zip(clocks, mine, strict=True)]
    guesses += dict.fromkeys(guess for clock in clocks for guess in clock.guesses)
    jumps = _jumps(clocks)
    units = [usual_unit(cells[:LOOK_AHEAD], table.decimal) for _, cells in columns_of]
    return _joined(table, names, columns_of, Stamps(stamps.seconds, stamps.kind, guesses, None, *jumps), units)


def _jumps(clocks: Iterable[Stamps]) -> tuple[int, int]:
    """Most jumps of any clock, and how many of that one's were changes of summer time."""
    return max(((clock.clock_jumps, clock.summer_time) for clock in clocks), key=lambda one: (one[0], -one[1]))


def _owned(tags: NDArray[np.object_], owners: NDArray[np.object_]) -> NDArray[np.object_]:
    """Bare signals with the loop's name before them, where names are of loops: one of them has several signals."""
    several = len(set(zip(owners, tags, strict=True))) > len(set(owners))
    joined = [f"{owner}.{tag}" if several and owner else tag for owner, tag in zip(owners, tags, strict=True)]
    return np.array(joined, dtype=object)


def apart(
    table: Table,
    names: Sequence[str],
    units: Sequence[str],
    times: Mapping[int, int],
    groups: Sequence[Sequence[int]],
    parse: Callable[[int, list[str]], Stamps],
    empty: Sequence[str] = ("",),
) -> list[LongTable]:
    """Lay out a table in which columns have time stamps of their own.

    Parameters
    ----------
    table : Table
        The table.
    names, units : sequence of str
        Those of its columns.
    times : mapping
        Column -> column of its time stamps.
    groups : sequence of sequences of int
        Columns that go into one table each.
    parse : callable
        From a column of time and its cells to `Stamps`.
    empty : sequence of str
        Cells, in capitals, at which nothing was stored.

    Returns
    -------
    list of LongTable
        One for each group; none where all time columns tell the same time, row by row, or the first cannot be read.
    """
    taken = table.take(sorted({*times, *times.values()}), [])
    stamps = {column: untangled(parse(column, taken.text[column])) for column in sorted(set(times.values()))}
    first, *others = stamps.values()
    if not np.isfinite(first.seconds).any() or (others and all(_same_clock(first, other) for other in others)):
        return []
    stored = {}
    for column, time in times.items():
        seconds, cells = stamps[time].seconds, taken.text[column]
        rows = [k for k, cell in enumerate(cells) if cell.strip().upper() not in empty and np.isfinite(seconds[k])]
        stored[column] = seconds[rows], [cells[k] for k in rows]
    guesses = list(dict.fromkeys(guess for one in stamps.values() for guess in one.guesses))
    jumps = _jumps(stamps.values())
    told = Stamps(first.seconds, first.kind, guesses, None, *jumps)
    return [
        _joined(table, [names[i] for i in own], [stored[i] for i in own], told, [units[i] for i in own])
        for own in groups
    ]


def _same_clock(one: Stamps, other: Stamps) -> bool:
    """Whether two time columns say the same in every row."""
    return bool(np.allclose(one.seconds, other.seconds, rtol=0.0, atol=1e-3, equal_nan=True))


def _joined(
    table: Table,
    names: Sequence[str],
    columns: Sequence[tuple[NDArray[np.float64], list[str]]],
    stamps: Stamps,
    units: Sequence[str] = (),
) -> LongTable:
    """Columns, each of times and cells, on all their times; of a column's cells at one time the last counts."""
    seconds = np.unique(np.concatenate([when for when, _ in columns]))
    cells, lost = [], 0
    for when, texts in columns:
        order = np.argsort(when, kind="stable")
        row = np.searchsorted(seconds, when[order])
        last = np.append(np.diff(row) > 0, True) if row.size else np.zeros(0, dtype=bool)
        lost += sum(texts[order[k]] != texts[order[k + 1]] for k in np.flatnonzero(~last))
        cells.append((row[last].astype(np.int64), [texts[k] for k in order[last]]))
    if lost:
        told = f"Left out: {count_noun(lost, 'value')} with the time stamp of the tag's next, which is another."
        stamps = replace(stamps, guesses=[*stamps.guesses, told])
    return LongTable(table, replace(stamps, seconds=seconds), names, cells, units)
