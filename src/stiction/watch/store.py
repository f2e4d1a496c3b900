"""What a watch remembers when it is killed: windows, tags, alarms, notes, messages to send, in one SQLite file."""

from __future__ import annotations

import json
import sqlite3
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from stiction.errors import RecordError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

__all__ = ["FILE", "WatchStore"]

FILE = "watch.sqlite"
TABLES = """
CREATE TABLE IF NOT EXISTS fact (name TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS window (start INTEGER PRIMARY KEY, finish INTEGER NOT NULL, state TEXT NOT NULL,
    closed REAL, judged REAL, tries INTEGER NOT NULL DEFAULT 0, body TEXT NOT NULL DEFAULT '{}');
CREATE TABLE IF NOT EXISTS tag (id INTEGER PRIMARY KEY, source TEXT NOT NULL, address TEXT NOT NULL, name TEXT NOT NULL,
    body TEXT NOT NULL, UNIQUE (source, address));
CREATE TABLE IF NOT EXISTS text (id INTEGER PRIMARY KEY, value TEXT NOT NULL UNIQUE);
CREATE TABLE IF NOT EXISTS alarm (id TEXT PRIMARY KEY, loop TEXT NOT NULL, kind TEXT NOT NULL, open INTEGER NOT NULL,
    raised REAL NOT NULL, body TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS condition (loop TEXT NOT NULL, kind TEXT NOT NULL, body TEXT NOT NULL,
    PRIMARY KEY (loop, kind));
CREATE TABLE IF NOT EXISTS note (id INTEGER PRIMARY KEY, alarm TEXT NOT NULL, time REAL NOT NULL, who TEXT NOT NULL,
    what TEXT NOT NULL, text TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS message (id INTEGER PRIMARY KEY, channel TEXT NOT NULL, ident TEXT NOT NULL,
    body TEXT NOT NULL, tries INTEGER NOT NULL DEFAULT 0, due REAL NOT NULL, sent REAL,
    failure TEXT NOT NULL DEFAULT '', UNIQUE (channel, ident));
"""


class WatchStore:
    """The file. Each change is one transaction; readers do not wait."""

    def __init__(self, folder: Path, *, read_only: bool = False) -> None:
        self.file = folder / FILE
        if read_only and not self.file.is_file():
            raise RecordError(f"is not a watch (it has no {FILE}); start one with stiction watch.", where=folder)
        try:
            self._connection = sqlite3.connect(self.file, timeout=30.0, isolation_level=None, check_same_thread=False)
            self._connection.row_factory = sqlite3.Row
            if not read_only:
                self._connection.execute("PRAGMA journal_mode = WAL")
                self._connection.execute("PRAGMA synchronous = FULL")
                self._connection.executescript(TABLES)
        except sqlite3.Error as error:
            raise RecordError(f"cannot be used ({error}); check the folder and the disk.", where=self.file) from None

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """All changes inside are made, or none."""
        self._connection.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:
            self._connection.execute("ROLLBACK")
            raise
        self._connection.execute("COMMIT")

    def query(self, text: str, *values: object) -> list[dict[str, Any]]:
        """Rows of a statement."""
        return [dict(row) for row in self._connection.execute(text, values)]

    def change(self, text: str, *values: object) -> int:
        """Number of rows that a statement changed."""
        return self._connection.execute(text, values).rowcount

    def fact(self, name: str, default: Any = None) -> Any:
        """A value by its name."""
        rows = self.query("SELECT value FROM fact WHERE name = ?", name)
        return json.loads(rows[0]["value"]) if rows else default

    def set_fact(self, name: str, value: Any) -> None:
        """Keep a value under a name."""
        self.change("INSERT OR REPLACE INTO fact VALUES (?, ?)", name, json.dumps(value))

    def tag_ids(self, source: str, tags: Mapping[str, dict[str, Any]]) -> dict[str, int]:
        """Numbers of the tags of a source, given by address -> what is known: new ones are added."""
        with self.transaction():
            for address, body in tags.items():
                self.change(
                    "INSERT INTO tag (source, address, name, body) VALUES (?, ?, ?, ?) ON CONFLICT (source, address) "
                    "DO UPDATE SET name = excluded.name, body = excluded.body",
                    source, address, body["name"], json.dumps(body),
                )  # fmt: skip
        rows = self.query("SELECT id, address FROM tag WHERE source = ?", source)
        return {row["address"]: row["id"] for row in rows}

    def tags(self, source: str) -> dict[int, dict[str, Any]]:
        """Number of a tag -> what is known of it."""
        rows = self.query("SELECT id, body FROM tag WHERE source = ? ORDER BY id", source)
        return {row["id"]: json.loads(row["body"]) for row in rows}

    def text_id(self, value: str) -> int:
        """Number of a text."""
        self.change("INSERT OR IGNORE INTO text (value) VALUES (?)", value)
        return self.query("SELECT id FROM text WHERE value = ?", value)[0]["id"]

    def texts(self) -> dict[int, str]:
        """Number of a text -> text."""
        return {row["id"]: row["value"] for row in self.query("SELECT id, value FROM text")}

    def close_window(self, start: int, finish: int, body: Mapping[str, Any]) -> None:
        """Note that a window takes no more samples and is to be judged; what was noted before stays."""
        self.change(
            "INSERT OR IGNORE INTO window (start, finish, state, closed, body) VALUES (?, ?, 'closed', ?, ?)",
            start, finish, time.time(), json.dumps(body),
        )  # fmt: skip

    def windows_to_judge(self) -> list[dict[str, Any]]:
        """Closed windows that were not judged, the earliest first."""
        return self.query("SELECT * FROM window WHERE state = 'closed' ORDER BY start")

    def last_window_end(self) -> int:
        """End of the newest closed window [microseconds since 1970]; 0 where there is none."""
        return self.query("SELECT COALESCE(MAX(finish), 0) AS end FROM window")[0]["end"]
