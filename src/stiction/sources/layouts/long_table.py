"""Long tables: a row for each tag and time, with the tag's name in a column, or a loop's and a signal's in two."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from stiction.errors import RecordError
from stiction.sources.layouts import headings
from stiction.sources.roles.column_names import normalise_name
from stiction.sources.roles.group_columns import flag_role
from stiction.sources.roles.vocabulary import COLUMN_WORDS
from stiction.sources.time.text_stamps import is_timestamp
from stiction.sources.time.time_columns import is_stamp_column
from stiction.sources.values.number_text import is_number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from stiction.sources.options import ReadOptions
    from stiction.sources.table import RawTable, TagColumn

__all__ = ["find_long_columns", "find_series_columns", "read"]

MAX_TAGS = 20_000
"""Tags that are read at once [-]."""
_TEXTS = ("owner", "tag", "unit", "description")


def find_long_columns(names: Sequence[str], sample: Sequence[Sequence[str]] = (), decimal: str = ".") -> dict[str, int]:
    """Find the columns of a long table: tag, value, and where there are some owner, unit and description.

    Returns positions by what a column holds, else nothing. Where no heading tells, the tags are names of signals in
    `sample`, the first rows, and the first numbers are the values. The owner is the loop of a tag that names a signal.

    >>> find_long_columns(["Tag", "Attribute", "When", "Value"], [["FIC-1", "PV", "2026-02-01 10:00", "3.5"]])
    {'tag': 1, 'value': 3, 'owner': 0}
    """
    words = [normalise_name(name) for name in names]
    known = ("tag", "value", "unit", "description")
    places = {key: [i for i, word in enumerate(words) if word in COLUMN_WORDS[key]] for key in known}
    found = {key: positions[0] for key, positions in places.items() if positions}
    cells = [[cell for row in sample if i < len(row) and (cell := row[i].strip())] for i in range(len(names))]
    flags = [i for i, name in enumerate(names) if flag_role(name, cells[i])]
    if sample:
        tags = [i for i, column in enumerate(cells) if i not in flags and _are_tags(column)]
        values = [i for i, column in enumerate(cells) if i not in {*tags, *flags} and _are_values(column, decimal)]
        if tags and (values or "value" in found):
            found |= {"tag": tags[0], "value": found.get("value", values[0] if values else -1)}
        by_name = [i for key in ("attribute", "tag") for i, word in enumerate(words) if word in COLUMN_WORDS[key]]
        signals = [i for i in by_name if _are_signals(cells[i])]
        if signals and not tags:
            found["tag"] = signals[0]
    tag_cells = set(cells[found["tag"]]) if "tag" in found else set()
    if any((pair := headings.parse_role(cell)) and not pair[0] for cell in tag_cells):
        free = [i for i in range(len(names)) if i not in {*found.values(), *flags} and cells[i]]
        owners = [i for key in ("tag", "loop_name") for i in free if words[i] in COLUMN_WORDS[key]]
        owners = owners or [i for i in free if _are_texts(cells[i], decimal)]
        found |= {"owner": owners[0]} if owners else {}
    return found if {"tag", "value"} <= set(found) else {}


def _are_tags(cells: Sequence[str]) -> bool:
    """Whether each cell names a measured signal, of a loop or of several."""
    pairs = {headings.parse_role(cell) for cell in set(cells)}
    known = bool(pairs) and all(pair and pair[1] not in ("mode", "bad", "quality") for pair in pairs)
    return known and (len(pairs) > 1 or all(pair and pair[0] for pair in pairs))


def _are_signals(cells: Sequence[str]) -> bool:
    """Whether most cells name a signal and no loop; a controller has other parameters too."""
    pairs = [headings.parse_role(cell) for cell in set(cells)]
    signals = sum(bool(pair and not pair[0]) for pair in pairs)
    return signals > 0 and 2 * signals >= len(pairs) and not any(pair and pair[0] for pair in pairs)


def _are_texts(cells: Sequence[str], decimal: str) -> bool:
    return not any(is_number(cell, decimal) or is_timestamp(cell) for cell in cells)


def _are_values(cells: Sequence[str], decimal: str) -> bool:
    return bool(cells) and all(is_number(cell, decimal) and not is_timestamp(cell) for cell in cells)


def _find(table: RawTable, options: ReadOptions) -> dict[str, int]:
    """Columns of a long table, whose headings make no loop; a user who names a column of a signal overrules cells."""
    names = headings.table_headings(table).names
    if table.width > 40 or headings.has_loop(names):
        return {}
    upper = {name.strip().upper() for name in names}
    named = [column for signal, column in options.columns.items() if signal != "time"]
    is_named = any(not isinstance(column, str) or column.strip().upper() in upper for column in named)
    return find_long_columns(names, () if is_named else table.sample, table.decimal)


def read(table: RawTable, options: ReadOptions) -> list[TagColumn] | None:
    """Give the tags of a long table, each with its rows, in the order in which they first appear."""
    if not (found := _find(table, options)):
        return None
    clock, time = headings.find_clock(table, options, taken=found.values())
    if clock is None:
        stamped = [i for i in range(table.width) if i not in found.values() and is_stamp_column(table, i)]
        clock, time = headings.find_clock(table, options, only=stamped[0]) if stamped else (None, set())
    if clock is None:
        raise RecordError("is a long table without a time column; export the time stamps too.", where=table.origin.name)
    # One kind of column after the other, and none for longer than it is needed: a text column takes much memory.
    readable = headings.readable_rows(table, clock.stamps)
    table.drop(time - set(found.values()))
    table.load(found[key] for key in _TEXTS if key in found)
    texts = {key: table.column(found[key]).cast(pl.String).fill_null("") for key in _TEXTS if key in found}
    keys = [key for key in ("owner", "tag") if key in found]
    tags = _group(texts, keys, readable)
    series: list[int] = []
    if not all(map(_is_single, (clock.stamps.seconds[one.to_numpy()] for one in tags["row"]))):
        free = set(range(table.width)) - {*found.values(), *time, *headings.flag_positions(table)}
        series = find_series_columns(table, texts, keys, clock.stamps.seconds, sorted(free))
        texts |= {f"series {i}": table.column(i).cast(pl.String).fill_null("") for i in series}
        tags = _group(texts, [*(f"series {i}" for i in series), *keys], readable) if series else tags
    units = texts.get("unit") if (tags["n_units"] > 1).any() else None
    del texts
    table.drop(found[key] for key in _TEXTS if key in found)
    if tags.height > MAX_TAGS:
        raise RecordError(
            f"contains {tags.height} tags, but at most {MAX_TAGS} can be read at once; export fewer loops.",
            where=table.origin.name,
        )
    # Each owner with one signal is a description, not a loop.
    is_loop = (pl.col("owner") != "") & (pl.lit(tags.height) > pl.col("owner").n_unique())
    tags = tags.with_columns(name=pl.when(is_loop).then(pl.format("{}.{}", "owner", "tag")).otherwise("tag"))
    for i in series:
        tags = tags.with_columns(name=pl.format("{}.{}", f"series {i}", "name"))
        named = headings.table_headings(table).names[i] or f"column {i}"
        table.notes.append(f"Column {named} is part of the tags, as it tells series apart that have the same times.")
    whole = headings.heading_column(table, found["value"], clock)
    whole.flags = headings.flag_loaders(table, {*headings.flag_positions(table)} - {*found.values(), *time})
    used = {*found.values(), *time, *series, *headings.flag_positions(table)}
    left = [name for i, name in enumerate(headings.table_headings(table).names) if i not in used and name]
    table.notes += [f"Columns of the long table that are not used: {', '.join(left[:10])}."] if left else []
    rows = [one.to_numpy() for one in tags["row"]]
    clocks = headings.share_clocks([headings.pick_stamps(clock, one) for one in rows])
    texts_of_tags = tags.select("name", "unit", "description").iter_rows(named=True)
    columns = [
        headings.pick_rows(whole, one, own, **text, position=None, own_clock=True)
        for text, one, own in zip(texts_of_tags, rows, clocks, strict=True)
    ]
    for column, one, n_units in zip(columns, rows, tags["n_units"], strict=True):
        if units is not None and n_units > 1:
            headings.convert_units(column, units.gather(one))
    return columns


def _group(texts: dict[str, pl.Series], keys: list[str], readable: NDArray[np.bool_]) -> pl.DataFrame:
    """Give the rows of each series, its first unit and description, and how many units it has."""
    first = [pl.col(key).first() for key in texts if key not in keys]
    n_units = pl.col("unit").n_unique() if "unit" in texts else pl.lit(1)
    return (
        pl.LazyFrame(texts)
        .with_row_index("row")
        .filter(pl.Series(readable))
        .group_by(keys, maintain_order=True)
        .agg("row", *first, n_units.alias("n_units"))
        .with_columns(pl.col(*keys).str.strip_chars())
        .filter(pl.col("tag") != "")
        .with_columns(pl.lit("").alias(key) for key in _TEXTS if key not in texts)
        .collect()
    )


def _is_single(seconds: NDArray[np.float64]) -> bool:
    """Whether times rise or fall all along, so that none is there twice."""
    steps = np.diff(seconds)
    return bool((steps > 0.0).all() or (steps < 0.0).all())


MAX_SERIES = 1000
"""Different cells of a column that tells series apart [-]."""


def find_series_columns(
    table: RawTable,
    texts: Mapping[str, pl.Series],
    keys: Sequence[str],
    seconds: NDArray[np.float64],
    free: Sequence[int],
    *,
    max_columns: int = 3,
    max_double_share: float = 0.01,
) -> list[int]:
    """Find the fewest `free` columns, names first, with which at most `max_double_share` of the rows [-] are double."""
    finite = pl.Series(np.isfinite(seconds))
    frame = pl.DataFrame({**{key: texts[key] for key in keys}, "time": seconds}).filter(finite)

    def count_double(names: Sequence[str]) -> int:
        return frame.height - frame.select(*names, "time").n_unique()

    allowed = max_double_share * frame.height
    if not free or count_double(keys) <= allowed:
        return []
    for i in free:
        column = table.column(i).cast(pl.String).fill_null("").filter(finite).alias(f"{i}")
        if 1 < column.n_unique() <= MAX_SERIES:
            frame = frame.with_columns(column)
    headings = table.header[0] if table.header else [""] * table.width

    def rank(i: int) -> tuple[bool, bool, int]:
        is_name = normalise_name(headings[i]) in (*COLUMN_WORDS["tag"], *COLUMN_WORDS["loop_name"])
        return not is_name, all(is_number(cell, table.decimal) for cell in table.sample_column(i)), i

    left = sorted((i for i in free if f"{i}" in frame.columns), key=rank)
    chosen: list[int] = []
    while left and len(chosen) < max_columns:
        double = {i: count_double([*keys, *(f"{k}" for k in (*chosen, i))]) for i in left}
        best = min(left, key=lambda i: max(double[i], allowed))
        chosen.append(best)
        if double[best] <= allowed:
            return chosen
        left.remove(best)
    return []
