"""kill -9 of the parent and of workers at random moments: going on gives the rows of an undisturbed run."""

from __future__ import annotations

import contextlib
import os
import signal
import struct
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import stiction as st
from fleet.small_plant import finish, require_same, require_sound_ledger, start_audit, write_plant

psutil = pytest.importorskip("psutil")
pytestmark = pytest.mark.processes
LOOPS = 12


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    return write_plant(tmp_path_factory.mktemp("plant") / "plant.parquet", LOOPS)


@pytest.fixture(scope="module")
def undisturbed(plant, tmp_path_factory):
    """The audit without a kill, how long it took [s], and its commits."""
    out = tmp_path_factory.mktemp("undisturbed") / "audit"
    began = time.monotonic()
    printed = finish(start_audit(plant, out))
    assert "commits" in printed, printed
    commits = int(printed.split("commits")[-1])
    return st.open_audit(out), time.monotonic() - began, commits


def go_on(plant, out, expected) -> None:
    """Run the audit again until it is done, and compare."""
    printed = finish(start_audit(plant, out))
    assert "commits" in printed, printed
    require_sound_ledger(out, LOOPS)
    require_same(st.open_audit(out), expected)


def kill_in_commit(plant, out, undisturbed, number: int) -> None:
    expected, _, _ = undisturbed
    process = start_audit(plant, out, at_commit=number)
    printed = finish(process)
    assert process.returncode == -signal.SIGKILL, printed
    go_on(plant, out, expected)


def kill_after(plant, out, undisturbed, share: float, *, worker: bool) -> None:
    """Kill the parent, or one worker, after this share of the undisturbed time."""
    expected, duration, _ = undisturbed
    process = start_audit(plant, out)
    time.sleep(share * duration)
    if process.poll() is None:
        with contextlib.suppress(psutil.Error, ProcessLookupError):  # it may have ended by itself
            victim = psutil.Process(process.pid)
            if worker:
                workers = [one for one in victim.children() if "spawn_main" in " ".join(one.cmdline())]
                victim = workers[0] if workers else None
            if victim is not None:
                os.kill(victim.pid, signal.SIGKILL)
    printed = finish(process)
    if worker:
        assert process.returncode == 0, printed
        require_same(st.open_audit(out), expected)
    go_on(plant, out, expected)


def test_killed_in_a_commit(plant, tmp_path, undisturbed):
    kill_in_commit(plant, tmp_path / "audit", undisturbed, undisturbed[2] // 2)


def test_killed_while_it_works(plant, tmp_path, undisturbed):
    kill_after(plant, tmp_path / "audit", undisturbed, 0.7, worker=False)


def test_killed_worker_costs_nothing(plant, tmp_path, undisturbed):
    kill_after(plant, tmp_path / "audit", undisturbed, 0.6, worker=True)


@pytest.mark.slow
@pytest.mark.parametrize("k", range(10))
def test_killed_in_any_commit(plant, tmp_path, undisturbed, k):
    number = int(np.random.default_rng(k).integers(1, undisturbed[2] + 1))
    kill_in_commit(plant, tmp_path / "audit", undisturbed, number)


@pytest.mark.slow
@pytest.mark.parametrize("k", range(10))
def test_killed_at_any_moment(plant, tmp_path, undisturbed, k):
    share = float(np.random.default_rng(100 + k).uniform(0.05, 1.0))
    kill_after(plant, tmp_path / "audit", undisturbed, share, worker=False)


@pytest.mark.slow
@pytest.mark.parametrize("k", range(20))
def test_killed_worker_at_any_moment(plant, tmp_path, undisturbed, k):
    share = float(np.random.default_rng(200 + k).uniform(0.05, 1.0))
    kill_after(plant, tmp_path / "audit", undisturbed, share, worker=True)


def run_two_batches(tmp_path, monkeypatch, run_batch) -> dict[int, str]:
    """Screen six loops in two batches with another `run_batch`: number -> status."""
    from fleet.small_plant import records
    from stiction.fleet import engine as engines
    from stiction.fleet.batch import Batch, LoopTask
    from stiction.fleet.block_means import common_clock
    from stiction.fleet.engine import ProcessEngine
    from stiction.fleet.find_loops import find_loop_places
    from stiction.fleet.loop_work import WorkSettings

    source = write_plant(tmp_path / "plant.parquet", 6)
    settings = WorkSettings(common_clock(records(6)))
    tasks = tuple(LoopTask(k, place) for k, place in enumerate(find_loop_places([str(source)], {})))
    monkeypatch.setattr(engines, "run_batch", run_batch)
    engine = ProcessEngine(2)
    outcomes = engine.run([Batch(tasks[:3], settings), Batch(tasks[3:], settings)], lambda: True)
    found = [(one.number, one.row.status) for each in outcomes for one in each]
    engine.close()
    assert len(found) == 6
    return dict(found)


def test_loop_that_kills_its_worker_is_a_row(tmp_path, monkeypatch):
    """A loop that ends its process twice is "crashed"; the others have their rows."""
    found = run_two_batches(tmp_path, monkeypatch, _run_batch_with_a_killer)
    assert found.pop(2) == "crashed"
    assert set(found.values()) == {"screened"}


def test_worker_killed_while_it_sends_a_result(tmp_path, monkeypatch):
    """Half a result in the pipe neither blocks the audit nor counts as one."""
    monkeypatch.setenv("SENT_HALF", str(tmp_path / "sent_half"))
    found = run_two_batches(tmp_path, monkeypatch, _run_batch_and_send_half)
    assert (tmp_path / "sent_half").is_file()
    assert set(found) == set(range(6))
    assert set(found.values()) == {"screened"}


def _run_batch_with_a_killer(batch):
    from stiction.fleet.batch import run_batch

    if any(task.number == 2 for task in batch.tasks):
        os._exit(9)
    return run_batch(batch)


def _run_batch_and_send_half(batch):
    """The first time send the length of a message and a part of it, and die."""
    from stiction.fleet.batch import run_batch

    try:
        Path(os.environ["SENT_HALF"]).touch(exist_ok=False)
    except FileExistsError:
        return run_batch(batch)
    pipe = sys._getframe(2).f_locals["pipe"]
    os.write(pipe.fileno(), struct.pack("!i", 100_000) + b"x" * 1000)
    os._exit(9)


def test_second_audit_of_a_folder_is_refused(plant, tmp_path):
    out = tmp_path / "audit"
    process = start_audit(plant, out)
    try:
        deadline = time.monotonic() + 60.0
        while not (out / "audit.toml").exists() and time.monotonic() < deadline:
            time.sleep(0.1)
        with pytest.raises(st.RecordError, match=rf"process {process.pid}, since"):
            st.audit(plant, out, workers=1)
    finally:
        process.kill()
        process.communicate()
