"""Loops of a long database table: found by their tags, read part by part, audited like the same loops in a file."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from datetime import datetime, timedelta

import pytest

import stiction as st
from fleet.small_plant import records
from stiction.fleet import find_loop_places
from stiction.fleet.source_parts import read_loop

LONG = {"table": "history", "time": "ts", "tag_column": "name", "value": "val"}


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    path = tmp_path_factory.mktemp("db") / "plant.db"
    start = datetime(2026, 3, 2)
    rows = []
    for record in records(20, 300):
        for word, x in (("PV", record.pv), ("OP", record.op), ("SP", record.sp)):
            name = f"{record.tag.split('/')[1]}.{word}"
            rows += [
                ((start + timedelta(seconds=k)).isoformat(" ", "microseconds"), name, float(v)) for k, v in enumerate(x)
            ]
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("CREATE TABLE history (ts TIMESTAMP, name TEXT, val REAL)")
        connection.executemany("INSERT INTO history VALUES (?, ?, ?)", rows)
        connection.commit()
    return f"sqlite:///{path}"


def test_loops_are_found_without_reading_the_table(database, monkeypatch):
    from stiction.sources import sql

    monkeypatch.setattr(sql, "read_database", None)  # the discovery must not call it
    places = find_loop_places([database], LONG)
    assert [place.tag for place in places] == [f"FIC-{k:03d}" for k in range(20)]
    assert len({place.part for place in places}) == 2


def test_each_loop_is_read_alone(database):
    for place, record in list(zip(find_loop_places([database], LONG), records(20, 300), strict=True))[::7]:
        found = read_loop(place)
        assert (found.tag, len(found)) == (place.tag, 300)
        assert found.op == pytest.approx(record.op)


def test_audit_of_a_table_goes_on_after_new_rows(database, tmp_path, audit_in_process):
    until = "2026-03-02T00:03:00"
    found = st.audit(database, tmp_path / "audit", workers=1, loops="FIC-00[0-2]", until=until, reading=LONG)
    assert [row["samples"] for row in found.rows] == [180] * 3
    new = st.audit(database, tmp_path / "audit", workers=1, loops="FIC-00[0-2]", since="last", reading=LONG)
    assert [(row["start"], row["samples"]) for row in new.rows] == [("2026-03-02T00:03:00", 120)] * 3
