"""``stiction audit`` and ``stiction demo --plant``: files, JSON, exit codes, messages."""

from __future__ import annotations

import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

from fleet.small_plant import ROOT, write_plant
from stiction.atomic_write import safe_file_name
from stiction.errors import RecordError
from stiction.fleet import open_audit


def test_audit_writes_its_files_and_goes_on(run, folder, audit_in_process):
    write_plant(folder / "plant.parquet", 6)
    done = run("audit", "plant.parquet", "--out", "audit", "--workers", "2", "--pages", "1")
    assert done.code == 1, done.err
    assert "6 loops: 5 diagnosed, 0 screened only, 1 at rest" in done.out
    assert "6 loops in 1 part of the source" in done.err
    for name in ("index.html", "audit.toml", "ledger.sqlite", "exports/loops.xlsx", "exports/loops.csv"):
        assert (folder / "audit" / name).is_file()
    assert len(list((folder / "audit" / "loops").glob("*.html"))) == 1
    again = run("audit", "--out", "audit", "--json", "--pages", "0", "--compare", "audit")
    found = json.loads(again.out)
    assert again.code == 1
    assert found["loops"][0]["tag"].startswith("U")
    keys = "tag area status verdict probability loop_state oscillation_cause oscillation_causes period_s S J priority"
    assert set(keys.split()) <= found["loops"][0].keys()
    assert found["counts"]["loops"] == 6
    assert {row["change"] for row in found["changes"]} == {"same"}


def test_states_of_the_work_list_are_checked_and_orders_have_names(run, folder, audit_in_process):
    write_plant(folder / "plant.parquet", 6)
    run("audit", "plant.parquet", "--out", "audit", "--workers", "1", "--pages", "0")
    [sticky] = [row.tag for row in open_audit("audit").rows if row.finding == "sticks"][:1]
    for arguments, message in (
        (["--note", "later"], "--note belongs to --mark; add --mark TAG=STATE."),
        (["--mark", f"{sticky}=foo"], "'foo' is not a state; give one of open, planned, done, rejected."),
        (["--mark", "foo"], "--mark foo has no state"),
        (["--mark", "X=done"], "has no loop 'X'"),
    ):
        refused = run("worklist", "audit", *arguments)
        assert refused.code == 2
        assert message in refused.err
    assert not (folder / "audit" / "labels.csv").exists()
    done = run("worklist", "audit", "--mark", f"{sticky}=done", "--note", "packing", "--author", "Ana")
    assert ", Ana: packing. The records of this audit are from before it" in done.out
    opened = run("worklist", "audit", "--mark", f"{sticky}=open", "--json")
    [item] = [one for one in json.loads(opened.out) if one["tag"] == sticky]
    assert item["state"] == "open"
    assert "in manual, OP ±" in item["test"]
    order = folder / "audit" / "worklist" / "orders" / f"{safe_file_name(sticky)}.html"
    assert f'href="orders/{order.name}"' in (folder / "audit" / "worklist" / "index.html").read_text()
    assert f"control valve of {sticky}" in order.read_text()


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["plant.parquet"], 2, "no folder for the results was given; give one with --out FOLDER"),
        (["none.csv", "--out", "a"], 3, "none.csv: no such file"),
        (["plant.parquet", "--out", "a", "--budget", "soon"], 2, "--budget = 'soon' is not a duration"),
        (["plant.parquet", "--out", "a", "--prior", "2"], 2, "--prior = 2 is not a probability"),
        (["plant.parquet", "--out", "a", "--costs", "1", "-1", "0"], 2, "missed = -1"),
        (["plant.parquet", "--out", "a", "--time-limit", "-1"], 2, "time_limit = -1 s is not positive"),
        (["plant.parquet", "--out", "a", "--loops", "XYZ"], 2, "--loops = 'XYZ' matches none of the 2 loops"),
        (["plant.parquet", "--out", "a", "--map", "none.csv"], 3, "the map cannot be read"),
        (["plant.parquet", "--out", "a", "--connections", "none.csv"], 3, "the connections cannot be read"),
        (["plant.parquet", "--out", "full"], 3, "full: is not an audit and not empty"),
        (["--out", "full"], 3, "full: is not an audit"),
        (["plant.parquet", "--out", "a", "--dask", "tcp://127.0.0.1:9"], 3, "the scheduler cannot be reached"),
        (
            ["plant.parquet", "--out", "a", "--ledger", "postgresql+psycopg://u:pw@127.0.0.1:9/x"],
            3,
            "u:***@127.0.0.1:9/x",
        ),
        (["plant.parquet", "--out", "a", "--ledger", "nonsense"], 2, "--ledger = 'nonsense' is not a database URL"),
        (["-", "--out", "a"], 3, "cannot read the standard input"),
        (["plant.parquet", "--out", "a", "--since", "last"], 2, "--since = 'last' needs a finished audit"),
        (
            ["plant.parquet", "--out", "a", "--page", "U0/FIC-00"],
            2,
            "--page U0/FIC-00: no loop has this tag; give one of",
        ),
        (["plant.parquet", "--out", "a", "--compare", "full"], 3, "--compare full: is not an audit"),
    ],
)
def test_bad_input(run, folder, arguments, code, message, monkeypatch):
    monkeypatch.setattr("stiction.fleet.dask_engine.CONNECT_TIMEOUT_S", 0.5)
    write_plant(folder / "plant.parquet", 2)
    (folder / "full").mkdir()
    (folder / "full" / "letter.txt").write_text("mine")
    done = run("audit", *arguments)
    assert (done.code, done.out) == (code, "")
    assert message in done.err
    assert "Traceback" not in done.err
    assert not (folder / "a" / "signals").exists()  # nothing was computed


STOPPED = "Stopped. The results so far are stored; run the same command again to continue."
COMMAND = ["audit", "plant.parquet", "--out", "audit", "--workers", "2", "--pages", "0"]


def has_rows(folder) -> bool:
    """Whether the first loops of an audit are in its ledger."""
    path = folder / "ledger.sqlite"
    if not path.exists():
        return False
    with closing(sqlite3.connect(f"{path.as_uri()}?mode=ro", uri=True)) as database:
        try:
            return database.execute("SELECT COUNT(*) FROM stiction_result").fetchone()[0] > 0
        except sqlite3.OperationalError:  # the table is not there yet, or is being written
            return False


def start_and_interrupt(folder) -> tuple[subprocess.Popen[str], str]:
    """Start an audit, press Ctrl-C when its first loops are done, and give what it says."""
    process = subprocess.Popen(
        [sys.executable, "-m", "stiction", *COMMAND], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, env=os.environ | {"PYTHONPATH": str(ROOT / "src")}, start_new_session=True,
    )  # fmt: skip
    deadline = time.monotonic() + 240.0
    while not has_rows(folder / "audit") and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to the workers too
    assert process.stderr is not None
    said = ""
    while "Stopping" not in said and (line := process.stderr.readline()):
        said = line
    return process, said


@pytest.mark.processes
def test_ctrl_c_stops_and_the_same_command_goes_on(folder, run):
    write_plant(folder / "plant.parquet", 96, 2000)
    process, said = start_and_interrupt(folder)
    assert said == "Stopping when the running loops are finished (at most 10 s); press again to stop now.\n"
    _, err = process.communicate(timeout=60)
    assert (process.returncode, err.strip()) == (130, STOPPED)
    found = json.loads(run(*COMMAND, "--json").out)
    assert (found["counts"]["loops"], found["counts"]["skipped"]) == (96, 19)
    assert found["counts"]["diagnosed"] == 77


@pytest.mark.processes
def test_second_ctrl_c_stops_at_once(folder):
    write_plant(folder / "plant.parquet", 96, 2000)
    process, _ = start_and_interrupt(folder)
    began = time.monotonic()
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert time.monotonic() - began < 3.0
    assert (process.returncode, err.strip()) == (130, STOPPED)
    require_sound_rows(folder / "audit")


def require_sound_rows(folder) -> None:
    """The ledger is whole, and no loop has two rows."""
    with closing(sqlite3.connect(folder / "ledger.sqlite")) as database:
        assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        rows = database.execute("SELECT COUNT(*), COUNT(DISTINCT loop_id) FROM stiction_result").fetchone()
    assert 0 < rows[0] == rows[1]


def test_page_that_cannot_be_written_gives_its_place_to_the_next(folder, run, monkeypatch, audit_in_process):
    from stiction import report

    write_plant(folder / "plant.parquet", 6)
    run(*COMMAND)
    tried = []

    def write(audit, tag):
        tried.append(tag)
        if len(tried) == 1:
            raise RecordError(f"{tag}: its source is gone.")

    monkeypatch.setattr(report, "write_loop_page", write)
    done = run("audit", "--out", "audit", "--pages", "2")
    assert len(tried) == 3
    assert f"The page of {tried[0]} was not written: {tried[0]}: its source is gone." in done.err


def test_table_has_groups_and_lists_what_was_not_judged(folder, run, audit_in_process):
    write_plant(folder / "plant.parquet", 6)
    done = run(*COMMAND)
    heading = next(line for line in done.out.splitlines() if line.startswith("Loop "))
    assert heading.split() == ["Loop", "Finding", "Next", "step", "S", "[%]", "Period", "Priority"]
    assert "Priority: severity times the probability of a fault" in done.out
    assert "Not judged: U0/FIC-004 (manual)" in done.out


def test_work_list_has_the_notes_and_a_work_order(folder, run, audit_in_process):
    write_plant(folder / "plant.parquet", 6)
    assert run(*COMMAND).code == 1
    sticky = next(row.tag for row in open_audit(folder / "audit").rows if row.verdict == "stiction")
    done = run("worklist", "audit", "--mark", f"{sticky}=planned", "--note", "shutdown in May", "--json")
    assert done.code == 1
    [item] = [one for one in json.loads(done.out) if one["tag"] == sticky]
    assert (item["kind"], item["state"]) == ("repair", "planned")
    assert item["note"].endswith(": shutdown in May")
    orders = [path.read_text() for path in (folder / "audit" / "worklist" / "orders").iterdir()]
    assert any(f"Work order: control valve of {sticky}, repair" in order for order in orders)
    assert "Repair at the next shutdown" in run("worklist", "audit", "--orders", "0").out
    assert run("worklist", "audit", "--mark", sticky).code == 2
    assert run("worklist", "audit", "--mark", "XIC-9=done").code == 2


def test_demo_plant(run, folder, audit_in_process):
    done = run("demo", "--plant", "--json")
    found = json.loads(done.out)
    assert len(found["loops"]) == 56
    assert found["right"] >= 28
    assert found["right"] + found["open"] >= 53
    assert [group["right"] for group in found["groups"]] == [True, True]
    audit = open_audit(folder / "stiction-plant" / "audit")
    sources = {group["root"] for group in found["groups"]}
    assert {row.tag for row in audit.worst(2)} == sources
    followers = {row.tag: row for row in audit.rows if row.follows}
    assert {tag for group in found["groups"] for tag in group["members"]} - sources - followers.keys() <= {
        "UNIT1/FIC-1135"
    }
    for row in followers.values():
        assert row.next_step == row.action == f"Look again after {row.follows} was put right."
    assert (folder / "stiction-plant" / "audit" / "index.html").is_file()


def test_audit_that_cannot_be_written_to_is_shown(run, folder, audit_in_process, monkeypatch):
    write_plant(folder / "plant.parquet", 2)
    code = run("audit", "plant.parquet", "--out", "audit", "--workers", "1", "--pages", "0").code
    before = {path: path.stat().st_mtime_ns for path in (folder / "audit").rglob("*") if path.is_file()}
    access = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: "audit" not in Path(path).parts and access(path, mode))
    shown = run("audit", "--out", "audit")
    assert (shown.code, shown.err) == (code, "")
    assert "audit cannot be written to: the files in it stay as they are." in shown.out
    listed = run("worklist", "audit")
    assert listed.code == 1
    assert "Give --out FOLDER" in listed.out
    assert {path: path.stat().st_mtime_ns for path in before} == before
    assert run("worklist", "audit", "--out", "list").code == 1
    assert (folder / "list" / "worklist.xlsx").is_file()
