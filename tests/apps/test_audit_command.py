"""``stiction audit`` and ``stiction demo --plant``: files, JSON, exit codes, messages."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time

import pytest

from fleet.small_plant import ROOT, write_plant


def test_audit_writes_its_files_and_goes_on(run, folder):
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


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["plant.parquet"], 2, "no folder for the results was named; give one with --out FOLDER"),
        (["none.csv", "--out", "a"], 3, "none.csv: no such file"),
        (["plant.parquet", "--out", "a", "--budget", "soon"], 2, "budget = 'soon' is no time"),
        (["plant.parquet", "--out", "a", "--prior", "2"], 2, "prior = 2 is no share"),
        (["plant.parquet", "--out", "a", "--costs", "1", "-1", "0"], 2, "missed = -1"),
        (["plant.parquet", "--out", "a", "--time-limit", "-1"], 2, "time_limit = -1 s is not positive"),
        (["plant.parquet", "--out", "a", "--loops", "XYZ"], 2, "matches none of the 2 loops"),
        (["plant.parquet", "--out", "a", "--map", "none.csv"], 3, "the map cannot be read"),
        (["plant.parquet", "--out", "a", "--connections", "none.csv"], 3, "the connections cannot be read"),
        (["plant.parquet", "--out", "full"], 3, "full: is not an audit and not empty"),
        (["--out", "full"], 3, "full: is no audit"),
        (["plant.parquet", "--out", "a", "--dask", "tcp://127.0.0.1:9"], 3, "the scheduler cannot be reached"),
        (
            ["plant.parquet", "--out", "a", "--ledger", "postgresql+psycopg://u:pw@127.0.0.1:9/x"],
            3,
            "u:***@127.0.0.1:9/x",
        ),
        (["plant.parquet", "--out", "a", "--ledger", "nonsense"], 2, "is no database URL"),
        (["-", "--out", "a"], 3, "cannot read the standard input"),
        (["plant.parquet", "--out", "a", "--since", "last"], 2, "needs a finished audit"),
    ],
)
def test_bad_input(run, folder, arguments, code, message):
    write_plant(folder / "plant.parquet", 2)
    (folder / "full").mkdir()
    (folder / "full" / "letter.txt").write_text("mine")
    done = run("audit", *arguments)
    assert (done.code, done.out) == (code, "")
    assert message in done.err
    assert "Traceback" not in done.err


def test_ctrl_c_stops_and_the_same_command_goes_on(folder, run):
    write_plant(folder / "plant.parquet", 24, 2000)
    command = [
        sys.executable,
        "-m",
        "stiction",
        "audit",
        "plant.parquet",
        "--out",
        "audit",
        "--workers",
        "2",
        "--pages",
        "0",
    ]
    process = subprocess.Popen(
        command,
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={"PYTHONPATH": str(ROOT / "src")},
    )
    deadline = time.monotonic() + 120.0
    while not list((folder / "audit").glob("signals/part-*.parquet")) and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130, (out, err)
    assert err.strip().endswith("Stopped. What is done is kept; the same command goes on.")
    done = run("audit", "plant.parquet", "--out", "audit", "--workers", "2", "--pages", "0", "--json")
    assert json.loads(done.out)["counts"]["diagnosed"] == 20


def test_demo_plant(run, folder):
    done = run("demo", "--plant", "--json")
    found = json.loads(done.out)
    assert len(found["loops"]) == 56
    assert found["right"] >= 53
    assert [group["right"] for group in found["groups"]] == [True, True]
    assert (folder / "stiction-plant" / "audit" / "index.html").is_file()
