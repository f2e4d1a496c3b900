"""Audits of many files of which some are unusable, and of what damages the storage of an audit."""

from __future__ import annotations

import gzip
import json
import os
import shutil
import sqlite3
from contextlib import closing
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

import stiction as st
from fleet.in_process_audit import audits_in_this_process
from fleet.small_plant import records, require_same, write_plant
from stiction.errors import RecordError
from stiction.fleet import find_loop_places
from stiction.report import write_audit_page

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.usefixtures("audit_in_process")

UNUSABLE = {
    "empty.csv": lambda _: b"",
    "blank.csv": lambda _: b"\n\n  \n",
    "scan.csv": lambda _: b"%PDF-1.7 something",
    "program.csv": lambda _: b"\x7fELF" + bytes(200),
    "cut.csv.gz": lambda text: gzip.compress(text)[:-40],
    "damaged.parquet": lambda _: b"PAR1" + bytes(range(256)) + b"PAR1",
    "letter.txt": lambda _: b"Dear colleague,\nthe export did not work.\nRegards\n",
    "labels.csv": lambda _: b"file,label\na.csv,stiction\nb.csv,no_stiction\n",
    "pv_only.csv": lambda text: b"\n".join(line.rsplit(b",", 1)[0] for line in text.splitlines()),
    "archive.zip": lambda _: b"PK\x03\x04" + bytes(300),
}
"""File name -> its content, made of a good file of another tag."""


def write_files(folder: Path, good: int, bad: int) -> list[str]:
    """Write `good` files of one loop each, and `bad` unusable ones in ten ways; give the names of these."""
    folder.mkdir()
    kinds = list(UNUSABLE.items())
    names = []
    for k in range(good):
        _write(folder / f"loop_{k:04d}.csv", f"FIC-{k:04d}", k)
    for k in range(bad):
        name, make = kinds[k % len(kinds)]
        names.append(f"x{k:03d}_{name}")
        text = _csv(f"LIC-{k:04d}", k)
        (folder / names[-1]).write_bytes(make(text.encode()))
    return names


def _write(path: Path, tag: str, k: int) -> None:
    path.write_text(_csv(tag, k))


def _csv(tag: str, k: int) -> str:
    base = records()
    record = base[k % len(base)]
    assert record.pv is not None
    rng = np.random.default_rng(k)
    pv = record.pv + rng.normal(0.0, 0.01, len(record))
    rows = (f"{i},{pv[i]:.4f},{record.op[i]:.4f}" for i in range(len(record)))
    return "\n".join([f"time_s,{tag}.PV,{tag}.OP", *rows, ""])


def audit_of_files_equals_that_of_the_good_ones(folder: Path, good: int, bad: int) -> st.Audit:
    names = write_files(folder / "all", good, bad)
    shutil.copytree(folder / "all", folder / "good", ignore=lambda _, files: [one for one in files if one in names])
    expected = st.audit(folder / "good", folder / "audit_good", workers=1)
    found = st.audit(folder / "all", folder / "audit_all", workers=1)
    assert len(expected.rows) == good
    assert [one for one in found.rows if one["status"] != "error"] == list(expected.rows)
    failed = {one["tag"]: one["reason"] for one in found.rows if one["status"] == "error"}
    assert sorted(failed) == sorted(names)
    assert all(name in reason for name, reason in failed.items())
    assert all(reason.endswith(".") and "please report it" not in reason for reason in failed.values())
    return found


@pytest.fixture(scope="module")
def twenty(tmp_path_factory):
    with audits_in_this_process():
        return audit_of_files_equals_that_of_the_good_ones(tmp_path_factory.mktemp("files"), 20, 10)


def test_unusable_files_are_rows_and_change_no_other(twenty):
    assert twenty.counts["error"] == 10
    assert "x000_empty.csv" in json.dumps(twenty.to_dict())
    assert "x000_empty.csv" in write_audit_page(twenty).read_text()
    assert {row["tag"] for row in twenty.not_judged} >= {"x000_empty.csv", "x009_archive.zip"}


@pytest.mark.slow
def test_thousand_files_of_which_fifty_are_unusable(tmp_path):
    found = audit_of_files_equals_that_of_the_good_ones(tmp_path, 950, 50)
    assert (len(found.rows), found.counts["error"]) == (1000, 50)


def test_finished_audit_is_brought_up_to_date(twenty, tmp_path):
    plant = shutil.copytree(twenty.folder.parent / "all", tmp_path / "plant")
    for path in plant.glob("loop_0[0-9]*"):
        if path.name > "loop_0003.csv":
            path.unlink()
    out = tmp_path / "audit"
    assert st.audit(plant, out, workers=1).counts["error"] == 10
    _write(plant / "x000_empty.csv", "LIC-0000", 1)  # now it can be read
    (plant / "loop_0001.csv").write_bytes(b"")  # and this one no more
    found = st.audit(plant, out, workers=1)
    status = {row["tag"]: row["status"] == "error" for row in found.rows}
    assert len(status) == 14
    assert not status["LIC-0000"]
    assert "FIC-0001" not in status
    assert status["loop_0001.csv"]


def test_equal_names_in_folders_and_zones_that_differ(tmp_path):
    lines = _csv("FIC-1", 0).splitlines()
    for k, zone in enumerate(("", "+01:00", "Z", "", "")):
        folder = tmp_path / "plant" / f"unit{k}"
        folder.mkdir(parents=True)
        rows = [f"2026-03-02T{6 + i // 3600:02d}:{i // 60 % 60:02d}:{i % 60:02d}{zone},{row.split(',', 1)[1]}"
                for i, row in enumerate(lines[1:])]  # fmt: skip
        (folder / "trend.csv").write_text("\n".join(["time,PV,OP", *rows, ""]))
    found = st.audit(tmp_path / "plant", tmp_path / "audit", workers=1)
    assert {row["tag"] for row in found.rows} == {f"trend (unit{k}/trend.csv)" for k in range(5)}
    assert found.counts["error"] == 0
    starts = {row["tag"].split("/")[0][-1]: row["start"] for row in found.rows}
    assert starts["0"] == starts["1"] == "2026-03-02T05:00:00+00:00"
    assert starts["2"] == "2026-03-02T06:00:00+00:00"


def test_places_of_files_that_fail_have_the_reason(tmp_path):
    write_files(tmp_path / "plant", 2, 2)
    places = find_loop_places([str(tmp_path / "plant")], {})
    assert [one.tag for one in places] == ["FIC-0000", "FIC-0001", "x000_empty.csv", "x001_blank.csv"]
    assert all("is empty" in one.failure for one in places[2:])


@pytest.mark.parametrize("damage", ["missing", "damaged", "folder gone"])
def test_lost_block_means_are_computed_again(tmp_path, damage):
    source = write_plant(tmp_path / "plant.parquet", 6)
    first = st.audit(source, tmp_path / "audit", workers=1)
    assert any(first.signals(row["tag"]) is not None for row in first.rows)
    copy = shutil.copytree(first.folder, tmp_path / "copy")
    if damage == "folder gone":
        shutil.rmtree(copy / "signals")
    for path in (copy / "signals").glob("part-*"):
        if damage == "missing":
            path.unlink()
        else:
            path.write_bytes(path.read_bytes()[:100])
    require_same(st.audit(source, copy, workers=1), first)


@pytest.mark.parametrize("damage", ["noise", "empty"])
def test_damaged_ledger_says_what_is_lost_and_how_to_rebuild(damage, tmp_path):
    source = write_plant(tmp_path / "plant.parquet", 3)
    st.audit(source, tmp_path / "audit", workers=1)
    path = tmp_path / "audit" / "ledger.sqlite"
    with closing(sqlite3.connect(path)) as database:
        database.execute("PRAGMA journal_mode = DELETE")
    data = bytearray(path.read_bytes())
    data[4096:] = os.urandom(len(data) - 4096)
    path.write_bytes(data if damage == "noise" else b"")
    match = (
        r"is damaged \(.*results in it are lost, but not labels.csv.*delete ledger.sqlite,.*run the same audit again"
    )
    with pytest.raises(RecordError, match=match):
        st.open_audit(tmp_path / "audit")
    path.unlink()
    assert len(st.audit(source, tmp_path / "audit", workers=1).rows) == 3


def test_audit_that_may_only_be_read_can_be_opened(tmp_path, monkeypatch):
    source = write_plant(tmp_path / "plant.parquet", 3)
    found = st.audit(source, tmp_path / "audit", workers=1)
    before = {path: path.stat().st_mtime_ns for path in found.folder.iterdir()}
    monkeypatch.setattr(os, "access", lambda _, mode: mode != os.W_OK)
    opened = st.open_audit(found.folder)
    require_same(opened, found)
    assert opened.history(found.rows[0]["tag"])
    assert {path: path.stat().st_mtime_ns for path in found.folder.iterdir()} == before


def test_full_disk_is_a_full_disk(tmp_path):
    from sqlalchemy import exc

    from stiction.fleet.ledger import Ledger, sqlite_url

    ledger = Ledger(sqlite_url(tmp_path / "ledger.sqlite"))
    ledger.create()

    def full(_):
        raise exc.OperationalError("insert", {}, sqlite3.OperationalError("database or disk is full"))

    with pytest.raises(RecordError, match="the disk is full; free some space"):
        ledger._transact(full)
    ledger.close()


def test_panic_of_a_library_and_lack_of_memory_are_rows(tmp_path, monkeypatch):
    from stiction.fleet import batch
    from stiction.fleet.batch import Batch, LoopTask, run_batch
    from stiction.fleet.block_means import Clock
    from stiction.fleet.loop_work import WorkSettings

    source = write_plant(tmp_path / "plant.parquet", 1)
    [place] = find_loop_places([str(source)], {})
    settings = WorkSettings(Clock(None, 10.0, 60, 1.0, 0, 600))

    def panic(*_):
        raise pl.exceptions.PanicException("out of range")

    monkeypatch.setattr(batch, "screen_loop", panic)
    [outcome] = run_batch(Batch((LoopTask(0, place),), settings))
    assert (outcome.row.status, "cannot be read" in outcome.row.reason) == ("error", True)

    def exhausted(*_):
        raise MemoryError

    ended = []

    def end(code):
        ended.append(code)
        raise SystemExit

    monkeypatch.setattr(batch, "screen_loop", exhausted)
    monkeypatch.setattr(os, "_exit", end)
    with pytest.raises(SystemExit):
        run_batch(Batch((LoopTask(0, place),), settings, parent=os.getpid() + 1))
    assert ended == [batch.MEMORY_EXIT]
