"""Databases: SQLite and a real PostgreSQL server, with wide and long tables and all their errors."""

from __future__ import annotations

import sqlite3
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING
from urllib.parse import quote, quote_plus

import polars as pl
import pytest
import sqlalchemy as sa

from sources.postgres import PASSWORD
from stiction.errors import MissingExtraError, ParameterError, RecordError
from stiction.sources import sql
from stiction.sources.database_url import hide_password, show_url
from stiction.sources.sql import read_database

if TYPE_CHECKING:
    from pathlib import Path

N = 240
START = datetime(2026, 3, 2, 6, 0, 0)
TIMES = [START + timedelta(seconds=5 * k) for k in range(N)]
PV = [3.0 + 0.01 * (k % 7) for k in range(N)]
OP = [40.0 + 0.1 * (k % 11) for k in range(N)]


def fill(url: str) -> None:
    """Write a wide and a long table, in an order that is not that of time."""
    engine = sa.create_engine(url)
    data = sa.MetaData()
    zoned = sa.DateTime(timezone=True)
    wide = sa.Table(
        "trend", data, sa.Column("at", sa.DateTime), sa.Column("FIC101.PV", sa.Numeric(12, 4)),
        sa.Column("FIC101.OP", sa.Float), sa.Column("FIC102.PV", sa.Float), sa.Column("note", sa.Text),
    )  # fmt: skip
    long = sa.Table(
        "history", data, sa.Column("name", sa.String(40)), sa.Column("ts", zoned),
        sa.Column("val", sa.Float), sa.Column("ok", sa.Integer),
    )  # fmt: skip
    data.drop_all(engine)
    data.create_all(engine)
    rows = list(zip(TIMES, PV, OP, strict=True))
    with engine.begin() as connection:
        connection.execute(
            wide.insert(),
            [{"at": t, "FIC101.PV": p, "FIC101.OP": o, "FIC102.PV": None, "note": "a:b 50%"} for t, p, o in rows[::-1]],
        )
        connection.execute(
            long.insert(),
            [
                {"name": f"FIC101.{word}", "ts": t.replace(tzinfo=UTC), "val": value, "ok": 192}
                for t, p, o in rows[::-1]
                for word, value in (("PV", p), ("OP", o))
            ]
            + [{"name": "TIC9.PV", "ts": TIMES[0].replace(tzinfo=UTC), "val": 1.0, "ok": 0}],
        )
    engine.dispose()


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.database)])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """URL of a database with the two tables."""
    url = f"sqlite:///{tmp_path}/plant.db" if request.param == "sqlite" else request.getfixturevalue("postgres").url
    fill(url)
    return url


def columns(table) -> dict[str, pl.Series]:
    return {name: table.column(k) for k, name in enumerate(table.header[0])}


def test_wide_table_in_order_of_time(url: str) -> None:
    [table] = read_database(url, table="trend", time="at")
    found = columns(table)
    assert list(found) == ["Time", "FIC101.PV", "FIC101.OP", "FIC102.PV", "note"]
    assert found["Time"].cast(pl.String).str.to_datetime().to_list() == TIMES
    assert found["FIC101.PV"].to_list() == pytest.approx(PV)
    assert found["FIC101.OP"].to_list() == OP
    assert found["FIC102.PV"].null_count() == N
    assert table.origin.stem == "trend"


def test_wide_table_of_some_columns_and_times(url: str) -> None:
    asked = {"since": "2026-03-02T06:01:00", "until": datetime(2026, 3, 2, 6, 2)}
    [table] = read_database(url, table="trend", time="at", columns={"op": "FIC101.OP"}, **asked)
    found = columns(table)
    assert list(found) == ["Time", "FIC101.OP"]
    assert found["FIC101.OP"].to_list() == OP[12:24]


def test_only_the_loops_asked_for(url: str) -> None:
    [table] = read_database(url, table="trend", time="at", tags=["fic102"])
    assert table.header == [["Time", "FIC102.PV"]]
    [table] = read_database(url, table="history", time="ts", tag="name", value="val", tags=["FIC101"])
    assert set(columns(table)["Tag"]) == {"FIC101.PV", "FIC101.OP"}


def test_long_table_has_the_headings_of_its_columns(url: str) -> None:
    [table] = read_database(url, table="history", time="ts", tag="name", value="val", quality="ok")
    found = columns(table)
    assert list(found) == ["Time", "Tag", "Value", "Quality"]
    pv = found["Tag"] == "FIC101.PV"
    assert found["Value"].filter(pv).to_list() == PV
    assert found["Quality"].to_list().count(0) == 1
    stamps = found["Time"].filter(pv)
    if url.startswith("postgresql"):
        assert stamps.dtype == pl.Datetime("us", "UTC")
        assert stamps.to_list() == [time.replace(tzinfo=UTC) for time in TIMES]


def test_query_is_sent_as_it_is(url: str) -> None:
    query = """SELECT at, "FIC101.PV" AS pv FROM trend WHERE note LIKE 'a:b 5%' ORDER BY at LIMIT 3"""
    [table] = read_database(url, query=query, time="at")
    assert table.header == [["Time", "pv"]]
    assert table.column(1).to_list() == pytest.approx(PV[:3])


def test_nothing_is_written(url: str) -> None:
    query = "DELETE FROM trend"
    if url.startswith("postgresql"):
        query = "SELECT nextval('counter')"
        with sa.create_engine(url).begin() as connection:
            connection.execute(sa.text("CREATE SEQUENCE IF NOT EXISTS counter"))
    with pytest.raises(RecordError, match=r"read-only|readonly"):
        read_database(url, query=query)
    assert len(read_database(url, table="trend")[0].column(0)) == N


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"table": "trends"}, "has no table 'trends'; give one of .*trend"),
        ({"table": "trend", "time": "ts"}, "table trend has no column 'ts'; it has at, FIC101.PV"),
        ({"table": "trend", "time": "at", "columns": ["FIC7.PV"]}, "no column 'FIC7.PV'"),
        ({"query": "SELECT * FROM trends"}, "refuses the query .*trends"),
        ({"query": "SELEKT 1"}, "refuses the query .*SELEKT"),
        ({"query": "SELECT at FROM trend", "time": "ts"}, "the query has no column 'ts'; it has at"),
        ({"query": "SELECT at, at FROM trend"}, "two columns of the query have one name"),
        ({"table": "trend", "time": "at", "since": "2027-01-01"}, "there is no row"),
        ({"table": "trend", "max_bytes": 1000}, "larger than 1,000 bytes"),
    ],
)
def test_each_error_has_its_message(url: str, asked: dict, message: str) -> None:
    with pytest.raises(RecordError, match=message) as caught:
        read_database(url, **asked)
    assert_no_password(str(caught.value))
    assert str(caught.value).endswith(".")


def assert_no_password(text: str) -> None:
    for form in (PASSWORD, quote(PASSWORD), quote(PASSWORD, safe=""), quote_plus(PASSWORD), "s/e:c"):
        assert form.lower() not in text.lower()


def test_password_appears_nowhere(postgres) -> None:
    server = postgres.url
    fill(server)
    [table] = read_database(server, table="trend")
    assert_no_password(repr(table))
    wrong = server.replace(quote(PASSWORD, safe=""), "wrong%21word")
    with pytest.raises(RecordError, match=r"cannot be reached .*authentication failed") as caught:
        read_database(wrong, table="trend")
    assert "wrong" not in str(caught.value)
    unencoded = server.replace(quote(PASSWORD, safe=""), PASSWORD)
    with pytest.raises((RecordError, ParameterError)) as caught:
        read_database(unencoded, table="trend")
    assert_no_password(str(caught.value))


def test_server_that_is_not_there() -> None:
    with pytest.raises(RecordError, match=r"ana:\*\*\*@127.0.0.1:1/plant: cannot be reached .*check host") as caught:
        read_database("postgresql+psycopg://ana:hush%40home@127.0.0.1:1/plant", table="trend")
    assert "hush" not in str(caught.value)


def test_wrong_urls(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="unknown kind of database"):
        read_database("plantdb://ana:hush@host/plant", table="trend")
    with pytest.raises(MissingExtraError, match=r"needs pymysql.*pip install pymysql"):
        read_database("mysql+pymysql://ana:hush@host/plant", table="trend")
    with pytest.raises(ParameterError, match="is not a database URL"):
        read_database("postgresql://ana:hush@host:port/plant", table="trend")
    with pytest.raises(RecordError, match="no such file"):
        read_database(f"sqlite:///{tmp_path}/none.db", table="trend")
    assert not list(tmp_path.iterdir())
    with pytest.raises(ParameterError, match="either query"):
        read_database(f"sqlite:///{tmp_path}/none.db")


@pytest.mark.parametrize("secret", ["simple", "p@ss", "a/b", "x:y", "50% off", "é+ü", "'quoted'"])
def test_passwords_of_any_form_are_hidden(secret: str) -> None:
    for written in {secret, quote(secret), quote(secret, safe=""), quote_plus(secret)}:
        url = f"postgresql://ana:{written}@host/plant"
        assert show_url(url) == "postgresql://ana:***@host/plant"
        for form in (secret, written, quote(secret, safe=""), quote_plus(secret)):
            assert form not in hide_password(f"connection with {form} failed", url)


def test_text_among_numbers_of_sqlite_is_kept(tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / "a.db") as database:
        database.execute("CREATE TABLE t (at TIMESTAMP, pv REAL)")
        database.executemany("INSERT INTO t VALUES (?, ?)", [("02.03.2026 06:00", 1.5), ("02.03.2026 06:01", "Bad")])
    [table] = read_database(f"sqlite:///{tmp_path}/a.db", table="t", time="at")
    assert table.column(0).to_list() == ["02.03.2026 06:00", "02.03.2026 06:01"]
    assert table.column(1).to_list() == ["1.5", "Bad"]


def test_chunks_of_different_types_are_joined(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sql, "CHUNK_ROWS", 7)
    numbers = [k if k % 14 < 7 else k + 0.5 for k in range(100)]
    with sqlite3.connect(tmp_path / "a.db") as database:
        database.execute("CREATE TABLE t (at REAL, pv NUMERIC, op)")
        rows = [(k, number, None if k < 20 else number) for k, number in enumerate(numbers)]
        database.executemany("INSERT INTO t VALUES (?, ?, ?)", rows)
    [table] = read_database(f"sqlite:///{tmp_path}/a.db", table="t", time="at")
    assert table.column(1).to_list() == numbers
    assert table.column(2).to_list() == [None] * 20 + numbers[20:]
