"""The ledger of an audit: which loops there are, what was found in each, in SQLite or PostgreSQL."""

from __future__ import annotations

import json
import os
import time
from contextlib import closing, contextmanager, suppress
from datetime import datetime
from pathlib import Path
from shutil import copyfile
from typing import TYPE_CHECKING, Any, NamedTuple

from stiction.errors import RecordError
from stiction.fleet.loop_row import LoopRow
from stiction.fleet.stored_windows import replace_windows, select_windows, window_table
from stiction.scratch import ScratchFolder

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from typing import TypeVar

    from sqlalchemy import Connection, Engine

    from stiction.diagnosis.evidence.further import StoredWindow
    from stiction.fleet.stored_windows import KnownWindows

    Value = TypeVar("Value")

__all__ = ["FORMAT_VERSION", "Ledger", "ResultKey", "StoredResult", "sqlite_url"]

FORMAT_VERSION = 1
"""Version of the tables."""
LOCK_KEY = 517_834_621
"""Key of the advisory lock of a PostgreSQL ledger."""
SQLITE = "sqlite:///"
LABELS_FILE = "labels.csv"
RECONNECT_S = 120.0
"""Time for which a server that does not answer is asked again [s]."""


class ResultKey(NamedTuple):
    """What a result belongs to, besides its loop."""

    window: str
    """Start and end of the audited time, as asked for."""
    options: str
    """Digest of the options that results depend on."""
    version: str
    """Version of the package."""

    @classmethod
    def of_run(cls, run: Mapping[str, Any]) -> ResultKey:
        """Key of a run, as `Ledger.read_runs` gives it."""
        return cls(*(run[name] for name in cls._fields))


class StoredResult(NamedTuple):
    """One row of the ledger."""

    loop: int
    """Number of the loop in the ledger."""
    fingerprint: str
    """State of the source when it was read."""
    stage: str
    """"screen" or "diagnose": how far the loop came."""
    signals: str
    """Name of the part that holds its block means; empty when there are none."""
    row: LoopRow
    """The row of the audit."""


class Ledger:
    """The tables of one audit. One process writes at a time."""

    def __init__(self, url: str) -> None:
        import sqlalchemy as sa

        self.url = url
        self._copies = ScratchFolder()
        self.engine = _make_engine(url, self._copies)
        data = sa.MetaData()
        self.loops = sa.Table(
            "stiction_loop", data, sa.Column("id", sa.Integer, primary_key=True),
            sa.Column("tag", sa.Text, nullable=False, unique=True), sa.Column("source", sa.Text, nullable=False),
        )  # fmt: skip
        self.results = sa.Table(
            "stiction_result", data, sa.Column("loop_id", sa.Integer, sa.ForeignKey("stiction_loop.id")),
            *(sa.Column(name, sa.String(80)) for name in ResultKey._fields),
            sa.Column("fingerprint", sa.String(32)), sa.Column("stage", sa.String(16)), sa.Column("signals", sa.Text),
            sa.Column("cpu_s", sa.Float), sa.Column("body", sa.Text),
            sa.PrimaryKeyConstraint("loop_id", "window", "options", "version"),
        )  # fmt: skip
        self.runs = sa.Table(
            "stiction_run", data, sa.Column("id", sa.Integer, primary_key=True), sa.Column("started", sa.String(40)),
            sa.Column("finished", sa.String(40)), *(sa.Column(name, sa.String(80)) for name in ResultKey._fields),
            sa.Column("body", sa.Text),
        )  # fmt: skip
        self.windows = window_table(data)
        self._data = data

    def create(self) -> None:
        """Make the tables that are missing.

        Raises RecordError when the database cannot be reached or written to.
        """
        with self._errors("cannot be opened as a database of results"):
            self._data.create_all(self.engine)

    def close(self) -> None:
        """Close all connections."""
        self.engine.dispose()
        self._copies.delete()

    @contextmanager
    def lock(self, owner: str) -> Iterator[None]:
        """Keep audits from other folders out of a PostgreSQL ledger; SQLite is locked with its folder.

        Raises RecordError when another audit is at work in it; the message names it.
        """
        if self.engine.dialect.name != "postgresql":
            yield
            return
        import sqlalchemy as sa
        from sqlalchemy import exc

        engine = sa.create_engine(self.engine.url, poolclass=sa.NullPool)
        with self._errors("cannot be locked"):
            connection = engine.connect().execution_options(isolation_level="AUTOCOMMIT")
            connection.execute(sa.text("SELECT set_config('application_name', :name, false)"), {"name": owner[:60]})
            taken = connection.execute(sa.text("SELECT pg_try_advisory_lock(:key)"), {"key": LOCK_KEY}).scalar()
            query = "SELECT a.application_name FROM pg_locks l JOIN pg_stat_activity a USING (pid) "
            query += "WHERE l.locktype = 'advisory' AND l.objid = :key AND l.granted"
            holder = None if taken else connection.execute(sa.text(query), {"key": LOCK_KEY}).scalar()
        try:
            if not taken:
                from stiction.sources.database_url import show_url

                who = holder or "another process"
                raise RecordError(
                    f"an audit is writing to this database ({who}); wait until it ends.", where=show_url(self.url)
                )
            yield
        finally:
            with suppress(exc.SQLAlchemyError):
                connection.close()
            engine.dispose()

    def register(self, loops: Sequence[tuple[str, str]]) -> dict[str, int]:
        """Give each loop (tag, source) a number, or find the one that it has: tag -> number."""
        import sqlalchemy as sa

        def write(connection: Connection) -> dict[str, int]:
            stored = sa.select(self.loops.c.tag, self.loops.c.id, self.loops.c.source)
            known = {row.tag: row for row in connection.execute(stored)}
            new = [{"tag": tag, "source": source} for tag, source in loops if tag not in known]
            moved = [(known[tag].id, source) for tag, source in loops if tag in known and known[tag].source != source]
            if new:
                connection.execute(self.loops.insert(), new)
            for number, source in moved:
                connection.execute(self.loops.update().where(self.loops.c.id == number), {"source": source})
            return {row.tag: row.id for row in connection.execute(stored)}

        return self._transact(write)

    def read_loops(self) -> dict[int, str]:
        """Read where each loop is: number -> source, as JSON."""
        import sqlalchemy as sa

        query = sa.select(self.loops.c.id, self.loops.c.source)
        return {row.id: row.source for row in self._transact(lambda connection: connection.execute(query).all())}

    def write_results(self, key: ResultKey, rows: Sequence[tuple[StoredResult, float]]) -> None:
        """Write rows, each with its processor time [s], in one transaction; a row of the same loop is replaced."""
        import sqlalchemy as sa

        table = self.results
        columns = [{**key._asdict(), **_columns(row), "cpu_s": round(cpu_s, 4)} for row, cpu_s in rows]
        if not columns:
            return

        def write(connection: Connection) -> None:
            mine = sa.and_(table.c.window == key.window, table.c.options == key.options, table.c.version == key.version)
            numbers = [row.loop for row, _ in rows]
            connection.execute(table.delete().where(mine, table.c.loop_id.in_(numbers)))
            connection.execute(table.insert(), columns)

        self._transact(write)

    def read_results(self, key: ResultKey) -> dict[int, StoredResult]:
        """Read all rows of a key: number of the loop -> row."""
        import sqlalchemy as sa

        table = self.results
        chosen = [table.c.loop_id, table.c.fingerprint, table.c.stage, table.c.signals, table.c.body]
        query = sa.select(*chosen).where(
            table.c.window == key.window, table.c.options == key.options, table.c.version == key.version
        )
        rows = self._transact(lambda connection: connection.execute(query).mappings().all())
        return {
            row["loop_id"]: StoredResult(
                row["loop_id"],
                row["fingerprint"],
                row["stage"],
                row["signals"],
                LoopRow.from_dict(json.loads(row["body"])),
            )
            for row in rows
        }

    def read_history(self, loop: int) -> list[tuple[str, LoopRow]]:
        """Read all rows of one loop: window and row of each."""
        import sqlalchemy as sa

        table = self.results
        query = sa.select(table.c.window, table.c.body).where(table.c.loop_id == loop)
        return [
            (row.window, LoopRow.from_dict(json.loads(row.body)))
            for row in self._transact(lambda connection: connection.execute(query).all())
        ]

    def read_windows(self, options: str, version: str) -> dict[int, KnownWindows]:
        """Read the windows of all loops, judged with some options by a version of the models: number -> windows."""
        return self._transact(lambda connection: select_windows(connection, self.windows, options, version))

    def write_windows(self, options: str, version: str, rows: Mapping[int, Sequence[StoredWindow]]) -> None:
        """Write windows of loops in one transaction; a window of the same begin is replaced."""
        if any(rows.values()):
            self._transact(lambda connection: replace_windows(connection, self.windows, options, version, rows))

    def used_signals(self) -> set[str]:
        """Names of the parts of block means that a row refers to."""
        import sqlalchemy as sa

        query = sa.select(self.results.c.signals).distinct()
        return {row[0] for row in self._transact(lambda connection: connection.execute(query).all()) if row[0]}

    def begin_run(self, key: ResultKey, body: Mapping[str, Any]) -> int:
        """Note the start of a run and give its number."""
        row = {"started": _now(), "finished": None, **key._asdict(), "body": json.dumps(body)}

        def write(connection: Connection) -> int:
            return int(connection.execute(self.runs.insert().returning(self.runs.c.id), row).scalar_one())

        return self._transact(write)

    def end_run(self, number: int, body: Mapping[str, Any]) -> None:
        """Note the end of a run, with its groups and counts."""
        change = self.runs.update().where(self.runs.c.id == number)
        self._transact(lambda connection: connection.execute(change, {"finished": _now(), "body": json.dumps(body)}))

    def read_runs(self) -> list[dict[str, Any]]:
        """Read all runs, the first one first."""
        query = self.runs.select().order_by(self.runs.c.id)
        rows = self._transact(lambda connection: connection.execute(query).mappings().all())
        return [{**row, "body": json.loads(row["body"])} for row in rows]

    def _transact(self, work: Callable[[Connection], Value]) -> Value:
        """Do work in one transaction; a server that restarts is waited for."""
        from sqlalchemy import exc

        deadline = time.monotonic() + RECONNECT_S
        with self._errors("cannot be used as a database of results"):
            while True:
                try:
                    with self.engine.begin() as connection:
                        return work(connection)
                except (exc.OperationalError, exc.InterfaceError, exc.InternalError):
                    if self.engine.dialect.name == "sqlite" or time.monotonic() > deadline:
                        raise
                    self.engine.dispose()
                    time.sleep(0.5)

    @contextmanager
    def _errors(self, what: str) -> Iterator[None]:
        """Turn errors of the database into a `RecordError` without passwords."""
        from sqlalchemy import exc

        from stiction.sources.database_url import refused_as

        remedy = "check host, access rights and free space; results that were stored before stay"
        with refused_as(what, self.url, remedy):
            try:
                yield
            except exc.DatabaseError as error:
                if "disk is full" in str(error.orig):
                    raise RecordError(
                        "the disk is full; free some space, and run the same command again.", where=self.url
                    ) from None
                if (file := _sqlite_file(self.url)) is None or not file.is_file() or not (damage := _damage_of(file)):
                    raise
                raise RecordError(
                    f"is damaged ({damage}), so results in it are lost, but not {LABELS_FILE} nor the source; delete "
                    f"{file.name}, {file.name}-wal and {file.name}-shm, and run the same audit again: it computes all "
                    "loops anew.",
                    where=file,
                ) from None


def _damage_of(file: Path) -> str:
    """What SQLite finds wrong with a file; empty where it is sound."""
    import sqlite3

    try:
        with closing(sqlite3.connect(file, timeout=30.0)) as connection:
            found = connection.execute("PRAGMA integrity_check(1)").fetchone()[0]
            n_tables = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
    except sqlite3.OperationalError:  # locked, or it cannot be opened
        return ""
    except sqlite3.DatabaseError as error:
        return str(error)
    if found != "ok":
        return " ".join(str(found).split())
    return "" if n_tables else "it is empty"


def _columns(row: StoredResult) -> dict[str, Any]:
    body = json.dumps(row.row.to_dict(), allow_nan=False, separators=(",", ":"))
    return {
        "loop_id": row.loop, "fingerprint": row.fingerprint, "stage": row.stage, "signals": row.signals, "body": body
    }  # fmt: skip


def _now() -> str:
    return datetime.now().astimezone().isoformat(timespec="seconds")


def sqlite_url(path: Path) -> str:
    """URL of the ledger in a file."""
    return f"{SQLITE}{path}"


def _sqlite_file(url: str) -> Path | None:
    """The file of an SQLite ledger; None of another database."""
    return Path(url.removeprefix(SQLITE)) if url.startswith(SQLITE) else None


def _make_engine(url: str, copies: ScratchFolder) -> Engine:
    """Make the engine; of a ledger in a folder that cannot be written to, of a copy, as SQLite writes to read."""
    from sqlalchemy import create_engine, event

    from stiction.errors import ParameterError, Setting
    from stiction.sources.database_url import is_database_url, make_engine

    if (file := _sqlite_file(url)) is not None:
        if file.is_file() and not (os.access(file, os.W_OK) and os.access(file.parent, os.W_OK)):
            for ending in ("", "-wal"):
                with suppress(FileNotFoundError):
                    copyfile(f"{file}{ending}", copies.path() / f"{file.name}{ending}")
            url = sqlite_url(copies.path() / file.name)
        engine = create_engine(url, connect_args={"timeout": 30.0})

        @event.listens_for(engine, "connect")
        def _configure(connection: Any, _: Any) -> None:
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute("PRAGMA synchronous = NORMAL")
            connection.execute("PRAGMA foreign_keys = ON")

        return engine
    if not is_database_url(url):
        raise ParameterError(
            Setting("ledger"), f" = {url!r} is not a database URL",
            remedy="give postgresql+psycopg://USER:PASSWORD@HOST/NAME",
        )  # fmt: skip
    return make_engine(url)
