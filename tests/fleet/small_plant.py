"""A small plant as a Parquet file, the audit of it in a process of its own, and what must be equal afterwards."""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
from contextlib import closing
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import stiction as st
from stiction.records.parquet_writer import to_parquet

if TYPE_CHECKING:
    from stiction.fleet import Audit

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = """
import os, signal, sys
import stiction as st
from sqlalchemy import Engine, event

if __name__ == "__main__":
    source, out, at_commit, extra = sys.argv[1], sys.argv[2], int(sys.argv[3]), eval(sys.argv[4])
    commits = []

    @event.listens_for(Engine, "commit")
    def kill(connection):
        commits.append(1)
        if len(commits) == at_commit:
            os.kill(os.getpid(), signal.SIGKILL)

    st.audit(source, out, progress=lambda p: print(p.stage, p.done, flush=True), **extra)
    print("commits", len(commits))
"""
"""Kills itself inside a commit: after its statements, before it is done."""


@cache
def records(loops: int = 24, samples: int = 600) -> tuple[st.LoopRecord, ...]:
    """Loops of one plant: every third valve sticks, and every fifth loop rests in manual."""
    found = []
    for k in range(loops):
        rng = np.random.default_rng(k)
        valve = st.Kano(5.0, 3.0) if k % 3 == 0 else st.Ideal()
        loop = st.Loop(st.PID(0.2, 10.0), valve, st.FOPDT(3.0, 8.0 + k % 7, 6.0), dt=1.0, noise=0.05)
        load = np.cumsum(rng.normal(0.0, 0.02, samples))
        manual = np.full(samples, 50.0) if k % 5 == 4 else None
        run = st.simulate(
            loop, 150.0, float(samples), load, k, manual=manual, pv_start=148.0, op_start=50.0,
            tag=f"U{k % 2}/FIC-{k:03d}", loop_type="flow",
        )  # fmt: skip
        found.append(run)
    return tuple(found)


def write_plant(path: Path, loops: int = 24, samples: int = 600) -> Path:
    """Write the plant."""
    to_parquet(records(loops, samples), path)
    return path


def start_audit(source: Path, out: Path, *, at_commit: int = 0, **options: Any) -> subprocess.Popen[str]:
    """Start an audit; with `at_commit` it kills itself inside that commit."""
    script = out.parent / "run_audit.py"
    script.write_text(SCRIPT)
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src")}
    command = [sys.executable, str(script), str(source), str(out), str(at_commit), repr({"workers": 2, **options})]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment)


def finish(process: subprocess.Popen[str]) -> str:
    """Wait for the end of an audit, and give what it printed."""
    return process.communicate(timeout=900)[0]


def require_same(found: Audit, expected: Audit) -> None:
    """Every loop has exactly one row, equal to the undisturbed one, and readable block means."""
    assert [row["tag"] for row in found.rows] == [row["tag"] for row in expected.rows]
    assert found.rows == expected.rows
    assert found.groups == expected.groups
    for row in found.rows:
        means, twin = found.signals(row["tag"]), expected.signals(row["tag"])
        assert (means is None) == (twin is None)
        assert means is None or twin is None or np.array_equal(means.op, twin.op)


def require_sound_ledger(folder: Path, loops: int) -> None:
    """The database is whole, and holds one row of each loop."""
    with closing(sqlite3.connect(folder / "ledger.sqlite")) as database:
        assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        rows = database.execute("SELECT COUNT(*), COUNT(DISTINCT loop_id) FROM stiction_result").fetchone()
    assert rows == (loops, loops)
