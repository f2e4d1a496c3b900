"""The table of the windows of all loops in a ledger."""

from __future__ import annotations

import json
from datetime import datetime
from typing import TYPE_CHECKING, NamedTuple

from stiction.diagnosis.evidence.further import StoredWindow
from stiction.diagnosis.verdict.history import Window

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sqlalchemy import Connection, MetaData, Table

__all__ = ["KnownWindows", "replace_windows", "select_windows", "window_table"]


class KnownWindows(NamedTuple):
    """The windows that a ledger holds of one loop."""

    windows: list[StoredWindow]
    """Those judged by the present models, in the order of time."""
    others: set[str]
    """Begins of those judged by other models."""
    length: float
    """Length of all windows of the loop, whatever judged them [s]."""


def window_table(data: MetaData) -> Table:
    """The table."""
    import sqlalchemy as sa

    return sa.Table(
        "stiction_window", data, sa.Column("loop_id", sa.Integer, sa.ForeignKey("stiction_loop.id")),
        sa.Column("options", sa.String(80)), sa.Column("version", sa.String(80)), sa.Column("begin", sa.String(40)),
        sa.Column("length_s", sa.Float), sa.Column("complete", sa.Integer), sa.Column("digest", sa.String(32)),
        sa.Column("body", sa.Text), sa.PrimaryKeyConstraint("loop_id", "options", "version", "begin"),
    )  # fmt: skip


def select_windows(connection: Connection, table: Table, options: str, version: str) -> dict[int, KnownWindows]:
    """Windows of all loops, judged with some options by a version of the models: number of the loop -> windows."""
    import sqlalchemy as sa

    query = sa.select(table).where(table.c.options == options).order_by(table.c.begin)
    found: dict[int, KnownWindows] = {}
    for row in connection.execute(query).mappings().all():
        known = found.setdefault(row["loop_id"], KnownWindows([], set(), row["length_s"]))
        if row["version"] != version:
            known.others.add(row["begin"])
            continue
        window, begin = Window.from_row(json.loads(row["body"])), datetime.fromisoformat(row["begin"])
        known.windows.append(StoredWindow(begin, row["length_s"], bool(row["complete"]), row["digest"], window))
    return found


def replace_windows(
    connection: Connection, table: Table, options: str, version: str, rows: Mapping[int, Sequence[StoredWindow]]
) -> None:
    """Write windows of loops; one of the same begin is replaced."""
    import sqlalchemy as sa

    key = {"options": options, "version": version}
    columns = [
        {
            "loop_id": loop, "begin": one.begin.isoformat(), "length_s": one.length, "complete": int(one.complete),
            "digest": one.digest, "body": json.dumps(one.window.to_row(), allow_nan=False), **key,
        }
        for loop, windows in rows.items() for one in windows
    ]  # fmt: skip
    for loop, windows in rows.items():
        begins = [one.begin.isoformat() for one in windows]
        mine = sa.and_(table.c.options == options, table.c.version == version, table.c.loop_id == loop)
        connection.execute(table.delete().where(mine, table.c.begin.in_(begins)))
    connection.execute(table.insert(), columns)
