"""What the layouts share: column names of a table, tags in lines above, the time column, and the rows of one tag."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np
import polars as pl

from stiction.display.number_format import count_noun
from stiction.sources.roles.column_names import HeaderNames, header_names, is_unit, parse_column_name, role_of
from stiction.sources.roles.group_columns import flag_role
from stiction.sources.roles.loop_roles import column_label
from stiction.sources.roles.vocabulary import COLUMN_WORDS, TAG_WORDS, UNIT_HEADINGS
from stiction.sources.table import Clock, TagColumn
from stiction.sources.time.parse import parse_time
from stiction.sources.time.stamps import unread_stamp_error
from stiction.sources.time.time_columns import find_time_columns, is_time_heading
from stiction.sources.values.numeric_cells import parse_numbers
from stiction.sources.values.units import to_one_unit

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Sequence

    from numpy.typing import NDArray

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable
    from stiction.sources.time.stamps import Stamps

    Rows = NDArray[np.integer]

MARKS = "\"'[]#:= "
"""Characters around the words of a line that names a tag."""
_TYPE_CODE = re.compile(r"[IDSBRF](?:[48]|16|32|64)|[IDSB]")
_TAG_LINE = re.compile(rf"(?:(?:{'|'.join(map(re.escape, TAG_WORDS))})\s*[:=,]\s*)?([^:,=]{{1,80}})", re.IGNORECASE)
_UNIT_LINE = re.compile(rf"(?:{'|'.join(map(re.escape, UNIT_HEADINGS))})\s*[:=,]\s*([^,\s]{{1,12}})", re.IGNORECASE)
_header_names = lru_cache(maxsize=32)(header_names)  # the files of a data set have one header
_HEADINGS: WeakKeyDictionary[RawTable, HeaderNames] = WeakKeyDictionary()


def table_headings(table: RawTable) -> HeaderNames:
    """Give names, units and descriptions, `table.width` long, also by rows above a header without a signal."""
    if table not in _HEADINGS:
        header = tuple(tuple(row) for row in table.header if not _are_types(row))
        found = _header_names(header)
        above = [row for row in table.above if len(row) == table.width and any(map(is_time_heading, row))]
        if above and not any(map(parse_column_name, found.names)):
            other = header_names([*above, *header])
            if any(map(parse_column_name, other.names)):
                found = other
                forget_note_on_lines_above(table)
        blank = [""] * table.width
        _HEADINGS[table] = found if found.names else HeaderNames(blank, blank, blank)
    return _HEADINGS[table]


def _are_types(row: Sequence[str]) -> bool:
    """Whether a header row holds the types of the columns."""
    words = {cell.strip().upper() for cell in row[1:]} - {""}
    return bool(words) and all(word in COLUMN_WORDS["types"] or _TYPE_CODE.fullmatch(word) for word in words)


def forget_note_on_lines_above(table: RawTable) -> None:
    """Take back the note that lines above the header are not used."""
    table.notes[:] = [note for note in table.notes if "above the header" not in note]


def parse_role(name: str) -> tuple[str, str] | None:
    """Give tag and role of a column name; None where it names no signal."""
    pair = parse_column_name(name)
    return (pair[0], role_of(pair[1]).split()[-1]) if pair else None


def heading_column(table: RawTable, position: int, clock: Clock | None) -> TagColumn:
    """Give a whole column under its heading."""
    names, units, descriptions = table_headings(table)
    return TagColumn(
        names[position], table, clock, partial(table.column, position), units[position], descriptions[position],
        position, spread=table.spreads.get(position),
    )  # fmt: skip


def has_loop(names: Iterable[str]) -> bool:
    """Whether column names make a loop: two of PV, OP and valve position under one tag."""
    pairs = {pair for name in names if (pair := parse_role(name)) and pair[1] in ("pv", "op", "mv")}
    return len(pairs) > len({tag for tag, _ in pairs})


def flag_positions(table: RawTable) -> list[int]:
    """Find the columns of quality or of bad flags: by their headings, or by the words in them."""
    names = table_headings(table).names
    return [i for i, name in enumerate(names) if flag_role(name, table.sample_column(i))]


def flag_loaders(table: RawTable, positions: Iterable[int]) -> dict[str, Callable[[], pl.Series]]:
    """Give the flags of `TagColumn` for some columns."""
    columns = [heading_column(table, i, None) for i in sorted(positions)]
    return {column_label(column): column.load for column in columns}


def find_clock(
    table: RawTable, options: ReadOptions, *, taken: Iterable[int] = (), only: int | None = None
) -> tuple[Clock | None, set[int]]:
    """Find the time of the rows (or None), in `only` if given, and all columns of time or counts but `taken` ones."""
    names, units, _ = table_headings(table)
    if only is not None:
        taken = set(range(table.width)) - {only}
        options = replace(options, columns={"time": only})
    found = find_time_columns(names, units, table, options, taken=set(taken))
    positions = {*found.positions, *found.candidates, found.fraction, found.index} - {None}
    if not found.positions:
        return None, positions
    first = partial(parse_time, _first_rows(table), found, options)
    table.clock |= {*found.positions, found.fraction} - {None}
    return Clock(partial(parse_time, table, found, options), first), positions


def _first_rows(table: RawTable) -> RawTable:
    """The first rows of a table, as text."""

    def read(positions: Sequence[int]) -> pl.DataFrame:
        cells = [[row[i] if i < len(row) else "" for row in table.sample] for i in positions]
        return pl.DataFrame({f"{i}": column for i, column in zip(positions, cells, strict=True)}, schema=None)

    return replace(table, reader=read, _columns={})


def tag_in_line(cells: Sequence[str]) -> str:
    """Give the tag that a line such as ``# Point: FIC-1.PV`` names; empty where it names none or holds more."""
    text = _join_cells(cells)
    if not text or len(text) > 100 or text[-1].isdigit() or _UNIT_LINE.fullmatch(text):
        return ""
    found = _TAG_LINE.fullmatch(text)
    pair = parse_role(found[1].strip()) if found else None
    return found[1].strip() if found and pair and pair[0] else ""


def unit_in_line(cells: Sequence[str]) -> str:
    """Give the unit that a line such as ``Units: t/h`` names; empty where it names none."""
    found = _UNIT_LINE.fullmatch(_join_cells(cells))
    return found[1] if found and is_unit(found[1]) else ""


def _join_cells(cells: Sequence[str]) -> str:
    """Join the cells of a line, without the marks around it."""
    return ",".join(cell.strip() for cell in cells if cell.strip()).strip(MARKS).replace(":,", ":")


def _lines_above(table: RawTable) -> list[list[str]]:
    """All lines above the data, and the metadata as lines of key and value."""
    return [*([key, value] for key, value in table.metadata.items()), *table.above, *table.header]


def last_tag(table: RawTable) -> str:
    """Give the tag that the last line above the data with a tag names; empty where none does."""
    return next(filter(None, map(tag_in_line, reversed(_lines_above(table)))), "")


def first_unit(table: RawTable) -> str:
    """Give the unit that a line above the data names; empty where none does."""
    return next(filter(None, map(unit_in_line, _lines_above(table))), "")


def pick_rows(column: TagColumn, rows: Rows, clock: Clock | None, **changes: Any) -> TagColumn:
    """Give some rows of a column, with the clock of these rows."""

    def pick(load: Callable[[], pl.Series]) -> Callable[[], pl.Series]:
        return lambda: load().gather(rows)

    flags = {heading: pick(load) for heading, load in column.flags.items()}
    spread = (lambda whole=column.spread: whole()[rows]) if column.spread else None
    return replace(column, clock=clock, load=pick(column.load), flags=flags, spread=spread, **changes)


def convert_units(column: TagColumn, units: pl.Series) -> None:
    """Convert the cells of a column, whose unit changes from row to row, to the unit of most of its rows."""
    table, where = column.table, f"{column.table.origin.name}, column {column_label(column)}"
    texts = units.cast(pl.String).fill_null("").str.strip_chars()
    names = texts.unique(maintain_order=True).to_list()
    codes = texts.replace_strict(names, range(len(names)), return_dtype=pl.Int64).to_numpy()
    numbers = parse_numbers(column.load(), table.decimal, where=where).values
    values, column.unit, note = to_one_unit(numbers, names, codes, where)
    column.load = lambda: pl.Series(values)
    table.notes += [f"{column_label(column)}: {note}"] if note else []


def written_mask(cells: pl.Series, words: Collection[str] = ("",)) -> pl.Series:
    """Mark the cells that hold something, and none of some words in capitals."""
    if cells.dtype != pl.String:
        return cells.is_not_null()
    return cells.is_not_null() & ~cells.str.strip_chars().str.to_uppercase().is_in(list(words))


def pick_stamps(clock: Clock, rows: Rows) -> Clock:
    """Give the clock of some rows."""

    def parse() -> Stamps:
        stamps = clock.stamps
        return replace(stamps, seconds=stamps.seconds[rows], notes=list(stamps.notes), first_unread=None)

    return Clock(parse)


def share_clocks(clocks: Sequence[Clock]) -> list[Clock]:
    """Give for each clock the first one with equal stamps."""
    known: dict[tuple[float, ...], list[Clock]] = {}
    shared = []
    for clock in clocks:
        seconds = clock.stamps.seconds
        alike = known.setdefault((seconds.size, *seconds[:1], *seconds[-1:]), [])
        first = next((other for other in alike if np.array_equal(other.stamps.seconds, seconds)), clock)
        shared.append(first)
        alike += [clock] if first is clock else []
    return shared


def readable_rows(table: RawTable, stamps: Stamps, *, ignored: Rows | None = None) -> NDArray[np.bool_]:
    """Mark the rows whose time stamp was understood, and note how many were not, `ignored` ones aside."""
    readable = np.isfinite(stamps.seconds)
    if readable.sum() < 2:
        raise unread_stamp_error(stamps, table.origin.name, table.first_line)
    counted = ~readable
    counted[[] if ignored is None else ignored] = False
    if lost := int(counted.sum()):
        note = f"Left out: {count_noun(lost, 'row')} without a readable time stamp."
        table.notes.extend([] if note in table.notes else [note])
    return readable
