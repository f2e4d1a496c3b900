"""Long tables: a row for each tag and time, with the tag's name in a column, or a loop's and a signal's in two."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiction.errors import RecordError
from stiction.sources.layouts.headings import (
    UNIT_HEADINGS,
    find_clock,
    has_loop,
    is_stamp_column,
    parse_role,
    table_headings,
)
from stiction.sources.layouts.row_groups import TagRows, columns_of_rows, readable_rows
from stiction.sources.roles.column_names import normalise_name
from stiction.sources.roles.vocabulary import LOOP_NAME_WORDS, TAG_WORDS, VALUE_WORDS
from stiction.sources.time.parse import is_timestamp
from stiction.sources.values.numeric_cells import is_number

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable
    from stiction.sources.tag_column import TagColumn

__all__ = ["find_long_columns", "read", "recognises"]

ATTRIBUTE_WORDS = ("ATTRIBUTE", "PARAMETER", "PROPERTY", "SIGNAL", "FIELD", "ITEM", "ELEMENT", "_FIELD")
"""A column that names the signal of the loop in another column."""
DESCRIPTION_WORDS = ("DESCRIPTION", "DESC", "DESCRIPTOR")
"""A column of the description of each tag."""
NO_MEASUREMENTS = ("mode", "bad", "quality")
"""Roles of texts, which other columns may hold too."""
MAX_TAGS = 20_000
"""Tags that are read at once [-]."""
MAX_COLUMNS = 40
"""Columns of a long table [-]."""


def find_long_columns(names: Sequence[str], sample: Sequence[Sequence[str]] = (), decimal: str = ".") -> dict[str, int]:
    """Find the columns of a long table: tag, value, and where there are some owner, quality, unit and description.

    Where no heading tells, the tag stands in a column of names of signals in `sample`, the first rows, and the value in
    the first column of numbers. The owner is the loop of which the tag names only a signal. The result, from what a
    column holds to its position, is empty when the table is not a long one.

    Examples
    --------
    >>> find_long_columns(["Tag", "Timestamp", "Value"]), find_long_columns(["Time", "FIC-1.PV", "FIC-1.OP"])
    ({'tag': 0, 'value': 2}, {})
    >>> find_long_columns(["what", "when", "x"], [["FIC-1.PV", "2026-02-01 10:00", "3.5"]])
    {'tag': 0, 'value': 2}
    >>> find_long_columns(["Tag", "Attribute", "When", "Value"], [["FIC-1", "PV", "2026-02-01 10:00", "3.5"]])
    {'tag': 1, 'value': 3, 'owner': 0}
    """
    words = [normalise_name(name) for name in names]
    roles = [parse_role(name) for name in names]
    wanted = {"tag": TAG_WORDS, "value": VALUE_WORDS, "unit": UNIT_HEADINGS, "description": DESCRIPTION_WORDS}
    places = {key: [i for i, word in enumerate(words) if word in known] for key, known in wanted.items()}
    places["quality"] = [i for i, role in enumerate(roles) if role == ("", "quality")]
    found = {key: positions[0] for key, positions in places.items() if positions}
    cells = [[cell for row in sample if i < len(row) and (cell := row[i].strip())] for i in range(len(names))]
    if sample:
        tags = [i for i, column in enumerate(cells) if i not in places["quality"] and _are_tags(column)]
        values = [i for i, column in enumerate(cells) if i not in tags and _are_values(column, decimal)]
        if tags and (values or "value" in found):
            found |= {"tag": tags[0], "value": found.get("value", values[0] if values else -1)}
        by_name = [i for i in range(len(names)) if words[i] in (*ATTRIBUTE_WORDS, *TAG_WORDS)]
        signals = [i for i in by_name if _are_signals(cells[i])]
        signals.sort(key=lambda i: words[i] not in ATTRIBUTE_WORDS)
        if signals and not tags:
            found["tag"] = signals[0]
    if "tag" in found and any((pair := parse_role(cell)) and not pair[0] for cell in set(cells[found["tag"]])):
        owner_words = (*TAG_WORDS, *LOOP_NAME_WORDS)
        free = [i for i in range(len(names)) if i not in found.values() and cells[i]]
        owners = [i for i in free if words[i] in owner_words] or [i for i in free if _are_texts(cells[i], decimal)]
        found |= {"owner": owners[0]} if owners else {}
    return found if {"tag", "value"} <= set(found) else {}


def _are_tags(cells: Sequence[str]) -> bool:
    """Whether each cell names a measured signal, of a loop or of several."""
    pairs = {parse_role(cell) for cell in set(cells)}
    known = bool(pairs) and all(pair and pair[1] not in NO_MEASUREMENTS for pair in pairs)
    return known and (len(pairs) > 1 or all(pair and pair[0] for pair in pairs))


def _are_signals(cells: Sequence[str]) -> bool:
    """Whether most cells name a signal and no loop; a controller has other parameters too."""
    pairs = [parse_role(cell) for cell in set(cells)]
    signals = sum(bool(pair and not pair[0]) for pair in pairs)
    return signals > 0 and 2 * signals >= len(pairs) and not any(pair and pair[0] for pair in pairs)


def _are_texts(cells: Sequence[str], decimal: str) -> bool:
    return not any(is_number(cell, decimal) or is_timestamp(cell) for cell in cells)


def _are_values(cells: Sequence[str], decimal: str) -> bool:
    return bool(cells) and all(is_number(cell, decimal) and not is_timestamp(cell) for cell in cells)


def recognises(table: RawTable, options: ReadOptions) -> bool:
    """Whether a table has a column of tags and one of values, and its headings make no loop."""
    return bool(_find(table, options))


def _find(table: RawTable, options: ReadOptions) -> dict[str, int]:
    names = table_headings(table).names
    if table.width > MAX_COLUMNS or has_loop(names):
        return {}
    headings = {name.strip().upper() for name in names}
    named = [column for signal, column in options.columns.items() if signal != "time"]
    user_named = any(not isinstance(column, str) or column.strip().upper() in headings for column in named)
    return find_long_columns(names, () if user_named else table.sample, table.decimal)


def read(table: RawTable, options: ReadOptions) -> list[TagColumn]:
    """Give the tags of a long table, each with its rows, in the order in which they first appear.

    Raises
    ------
    RecordError
        When there is no time column, no stamp is understood, or there are more than `MAX_TAGS` tags.
    """
    found = _find(table, options)
    clock, time = find_clock(table, options, taken=found.values())
    if clock is None:
        stamped = [i for i in range(table.width) if i not in found.values() and is_stamp_column(table, i)]
        clock, time = find_clock(table, options, only=stamped[0]) if stamped else (None, set())
    if clock is None:
        raise RecordError(f"{table.origin.name}: is a long table without a time column; export the time stamps too.")
    table.load({*time, *found.values()})
    stamps = clock.stamps
    table.drop(time - set(found.values()))
    tags = _group_rows(table, found, readable_rows(table, stamps))
    return columns_of_rows(table, stamps, tags, found["value"], found.get("quality"))


def _group_rows(table: RawTable, found: dict[str, int], readable: NDArray[np.bool_]) -> Iterator[TagRows]:
    """Give the rows of each tag, in the order in which tags first appear."""
    import polars as pl

    keys = [key for key in ("owner", "tag") if key in found]
    texts = [key for key in ("unit", "description") if key in found]
    frame = pl.DataFrame([table.column(found[key]).cast(pl.String).fill_null("").alias(key) for key in keys + texts])
    grouped = (
        frame.lazy()
        .with_columns(readable=pl.Series(readable))
        .with_row_index("row")
        .filter(pl.col("readable"))
        .group_by(keys, maintain_order=True)
        .agg("row", *(pl.col(text).first() for text in texts))
        .with_columns(pl.col(*keys).str.strip_chars())
        .filter(pl.col("tag") != "")
        .collect()
    )
    if grouped.height > MAX_TAGS:
        raise RecordError(
            f"{table.origin.name}: holds {grouped.height} tags; {MAX_TAGS} are read at once, export fewer loops."
        )
    n_owners = grouped["owner"].n_unique() if "owner" in found else grouped.height
    for row in range(grouped.height):
        one = grouped[row]
        name, owner = one["tag"][0], one["owner"][0] if "owner" in found else ""
        # Each owner with one signal is a description, not a loop.
        name = f"{owner}.{name}" if owner and grouped.height > n_owners else name
        unit, description = (one[text][0] if text in found else "" for text in ("unit", "description"))
        yield TagRows(name, one["row"][0].to_numpy(), unit, description)
