"""The loops of a long database table, found from its tags alone, so that no process reads the whole table."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

__all__ = ["LOOPS_PER_PART", "find_loops_of_table", "find_table_state"]

LOOPS_PER_PART = 16
"""Loops that are read with one query [-]."""


def find_loops_of_table(url: str, options: Mapping[str, Any]) -> list[list[tuple[str, list[str]]]]:
    """Find the loops of a long table, in parts that are read together.

    Parameters
    ----------
    url : str
        URL of the database.
    options : mapping
        Options of `stiction.read`.

    Returns
    -------
    list of list of (str, list of str)
        Of each part the tag of each loop and the tags of its signals. Empty where the table is not long, the loops
        cannot be told from the names of the tags, or they fit in one part.

    Raises
    ------
    RecordError
        When the database cannot be reached, or has no such table or column.
    """
    if not {"table", "time", "tag_column", "value"} <= options.keys() or "tags" in options:
        return []
    if options.get("map"):
        from stiction.sources.roles.map_file import read_map

        signals: dict[str, list[str]] = defaultdict(list)
        for row in read_map(options["map"]):
            signals[row.loop].append(row.tag)
    else:
        signals = _group_tags(_distinct_tags(url, str(options["table"]), str(options["tag_column"])))
    loops = list(signals.items())
    if len(loops) <= LOOPS_PER_PART:
        return []
    return [loops[first : first + LOOPS_PER_PART] for first in range(0, len(loops), LOOPS_PER_PART)]


def find_table_state(url: str, options: Mapping[str, Any]) -> str:
    """Find the newest time of a table; constant where the audited time ends, or a query or no time is given."""
    import sqlalchemy as sa

    if "until" in options or not {"table", "time"} <= options.keys():
        return ""
    column = options["time"]
    [newest] = _select(url, str(options["table"]), lambda table: sa.select(sa.func.max(table.c[column])), column)
    return str(newest)


def _distinct_tags(url: str, table: str, column: str) -> list[str]:
    import sqlalchemy as sa

    tags = _select(url, table, lambda one: sa.select(one.c[column]).distinct().order_by(one.c[column]), column)
    return [str(tag) for tag in tags if tag is not None]


def _select(url: str, name: str, query: Callable[[Any], Any], column: str) -> list[Any]:
    """First column of the rows that a query of a table gives."""
    import sqlalchemy as sa

    from stiction.sources.database_url import connect, make_engine, refused_as

    schema, _, bare = name.rpartition(".")
    engine = make_engine(url)
    try:
        with connect(engine, url) as connection, refused_as("cannot be read", url, "check table and columns"):
            return [
                row[0] for row in connection.execute(query(sa.table(bare, sa.column(column), schema=schema or None)))
            ]
    finally:
        engine.dispose()


def _group_tags(tags: Iterable[str]) -> dict[str, list[str]]:
    """Tags of the signals of each loop that has an OP and a PV; empty when a tag names no signal."""
    from stiction.sources.roles.column_names import parse_column_name, role_of

    signals: dict[str, dict[str, str]] = defaultdict(dict)
    for tag in tags:
        pair = parse_column_name(tag)
        if pair is None or not pair[0]:
            return {}
        signals[pair[0]][role_of(pair[1]).removeprefix("fallback ")] = tag
    loops = {loop: list(roles.values()) for loop, roles in signals.items() if {"op", "pv"} <= roles.keys()}
    if signals and not loops:
        raise RecordError("No tag of the table has both an OP and a PV; assign the tags with a map.")
    return loops
