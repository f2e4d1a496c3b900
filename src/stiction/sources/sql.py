"""Tables of a database, through SQLAlchemy: wide ones, long ones, or the result of a query."""

from __future__ import annotations

from contextlib import suppress
from datetime import datetime
from typing import TYPE_CHECKING, Any

import polars as pl

from stiction.display.number_format import list_first
from stiction.errors import ParameterError, RecordError, Setting
from stiction.sources.database_url import connect, make_engine, refused_as, show_url
from stiction.sources.options import MAX_BYTES
from stiction.sources.table import Origin
from stiction.sources.typed_table import make_series, stack_series, typed_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sqlalchemy import Column, Connection, Table

    from stiction.sources.table import RawTable

__all__ = ["read_database"]

CHUNK_ROWS = 50_000
MAX_NAMES = 10
"""Names that a message lists [-]."""


def read_database(
    url: str,
    *,
    query: str | None = None,
    table: str | None = None,
    time: str | None = None,
    tag: str | None = None,
    value: str | None = None,
    quality: str | None = None,
    columns: Sequence[str] | Mapping[str, Any] | None = None,
    since: datetime | str | float | None = None,
    until: datetime | str | float | None = None,
    tags: Sequence[str] | None = None,
    max_bytes: int = MAX_BYTES,
) -> list[RawTable]:
    """Read a table of a database, or the result of a query, as one table.

    Nothing is written: the transaction is read-only where the database knows that, and is always rolled back. The
    arguments are those of `stiction.read`, and the named columns get the headings of their roles; `columns` may also
    map signals to columns, and `tag` is the column of tags. Rows are in the order of time when that column holds times
    or numbers. No message holds a password.
    """
    if (query is None) == (table is None):
        raise ParameterError("give either query, a SELECT, or table, the name of a table.")
    if tag is not None and (time is None or value is None):
        raise ParameterError(
            f"tag = {tag!r} is the column of tags in a table with one row per tag and time; give time and value too."
        )
    if query is not None and (since is not None or until is not None):
        raise ParameterError("since and until cannot be used with query; write the times into the query.")
    engine = make_engine(url)
    roles = {"Time": time, "Tag": tag, "Value": value, "Quality": quality}
    wanted = list(columns.values()) if hasattr(columns, "values") else list(columns or ())  # pyright: ignore
    wanted = [name for name in wanted if isinstance(name, str)]
    try:
        with connect(engine, url) as connection:
            if table is not None:
                stored = _reflect(connection, table, url)
                select = _select(stored, roles, wanted, tags or (), since, until, url)
                frame = _fetch(connection, select, url, max_bytes)
            else:
                frame = _fetch(connection, query, url, max_bytes)
                frame = frame.select(
                    _choose_columns(frame.columns, roles, wanted, tags or (), f"{show_url(url)}: the query")
                )
                if tags and tag:
                    starts = (pl.col(tag).cast(pl.String).str.starts_with(one) for one in tags)
                    frame = frame.filter(pl.any_horizontal(starts))
    finally:
        engine.dispose()
    where = show_url(url) + (f", table {table}" if table else ", query")
    if frame.height == 0:
        raise RecordError("there is no row; check the table, the tags, since and until.", where=where)
    headings = {name: heading for heading, name in roles.items() if name is not None and heading not in frame.columns}
    frame = frame.rename({name: headings[name] for name in frame.columns if name in headings})
    return [typed_table(Origin(where, table or engine.url.database or "query"), frame)]


def _reflect(connection: Connection, name: str, url: str) -> Table:
    """Read the columns of a table from the database."""
    from sqlalchemy import MetaData, Table, exc, inspect

    schema, _, bare = name.rpartition(".")
    with refused_as("cannot be read", url, "check the access rights of the user"):
        for table, of_schema in ((name, None), (bare, schema or None)):
            with suppress(exc.NoSuchTableError):
                return Table(table, MetaData(), schema=of_schema, autoload_with=connection)
        inspector = inspect(connection)
        names = [*inspector.get_table_names(), *inspector.get_view_names()]
    known = f"give one of {list_first(names, MAX_NAMES)}" if names else "this user has access to none"
    raise RecordError(f"has no table {name!r}; {known}.", where=show_url(url))


def _select(
    table: Table,
    roles: Mapping[str, str | None],
    wanted: Sequence[str],
    tags: Sequence[str],
    since: Any,
    until: Any,
    url: str,
) -> Any:
    """Make the SELECT of a wide or long table."""
    from sqlalchemy import or_, select, types
    from sqlalchemy.sql.expression import type_coerce

    names = _choose_columns(table.c.keys(), roles, wanted, tags, f"{show_url(url)}: table {table.name}")
    kinds = (types.DateTime, types.Date, types.Numeric, types.Integer)
    time: Column[Any] | None = table.c[roles["Time"]] if roles["Time"] else None
    # the type of SQLite's times is only a word: its cells may hold anything, and are given as they are
    chosen = [type_coerce(table.c[name], types.NullType()).label(name) for name in names]
    statement = select(*chosen)
    if tags and roles["Tag"]:
        column = table.c[roles["Tag"]]
        statement = statement.where(or_(*(column.startswith(one, autoescape=True) for one in tags)))
    if since is not None or until is not None:
        if time is None:
            raise ParameterError("since and until need the name of the time column", remedy=("give ", Setting("time")))
        low, high = (_bound(limit, time.type) for limit in (since, until))
        statement = statement.where(time >= low) if since is not None else statement
        statement = statement.where(time < high) if until is not None else statement
    if time is not None and isinstance(time.type, kinds):
        statement = statement.order_by(time)
    return statement


def _bound(limit: Any, kind: Any) -> Any:
    """Give a limit of time as the column stores it."""
    from sqlalchemy import types

    if isinstance(limit, str) and isinstance(kind, (types.DateTime, types.Date)):
        try:
            return datetime.fromisoformat(limit)
        except ValueError:
            raise ParameterError(f"{limit!r} is not a time; write it as 2026-03-02 or 2026-03-02T06:00:00.") from None
    if isinstance(limit, str) and isinstance(kind, (types.Numeric, types.Integer)):
        raise ParameterError(f"{limit!r} is a text, but the time column contains numbers; give a number.")
    return limit


def _fetch(connection: Connection, statement: Any, url: str, max_bytes: int) -> pl.DataFrame:
    """Run a statement and fetch its rows in chunks."""
    options = {"stream_results": True, "yield_per": CHUNK_ROWS}
    with refused_as("refuses the query", url, "correct it"):
        if isinstance(statement, str):
            # sent as it is: neither colons nor per cent signs are placeholders
            result = connection.exec_driver_sql(statement, execution_options={**options, "no_parameters": True})
        else:
            result = connection.execution_options(**options).execute(statement)
        if not result.returns_rows:
            raise RecordError("the query gives no rows; give a SELECT.", where=show_url(url))
        names = list(result.keys())
        if len(set(names)) < len(names):
            raise RecordError("two columns of the query have one name; name each with AS.", where=show_url(url))
        chunks, n_cells = [], 0
        for rows in result.partitions(CHUNK_ROWS):
            n_cells += len(rows) * len(names)
            if 8 * n_cells > max_bytes:
                raise RecordError(
                    f"the rows are larger than {max_bytes:,} bytes; read fewer by tags, since, until.",
                    where=show_url(url),
                )
            chunks.append([make_series(cells) for cells in zip(*rows, strict=True)])
    columns = zip(*chunks, strict=True) if chunks else [[pl.Series(dtype=pl.String)] for _ in names]
    return pl.DataFrame([stack_series(parts).alias(name) for name, parts in zip(names, columns, strict=True)])


def _choose_columns(
    stored: Sequence[str], roles: Mapping[str, str | None], wanted: Sequence[str], tags: Sequence[str], place: str
) -> list[str]:
    """Choose the columns to read: those that have a role, and of a wide table those asked for or of the tags."""
    named = [name for name in roles.values() if name is not None]
    for name in [*named, *wanted]:
        if name not in stored:
            raise RecordError(f"{place} has no column {name!r}; it has {list_first(stored, MAX_NAMES)}.")
    if roles["Tag"] or wanted:
        return list(dict.fromkeys([*named, *wanted]))
    of_tags = [name for name in stored if name.casefold().startswith(tuple(one.casefold() for one in tags))]
    return list(dict.fromkeys([*named, *of_tags])) if tags and roles["Time"] and of_tags else list(stored)
