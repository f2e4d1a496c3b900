"""kill -9 of the parent and of workers at random moments: going on gives the rows of an undisturbed run."""

from __future__ import annotations

import contextlib
import os
import signal
import time

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
                workers = [one for one in victim.children(recursive=True) if "loky" in " ".join(one.cmdline())]
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


def test_loop_that_kills_its_worker_is_a_row(tmp_path, monkeypatch):
    """A loop that ends its process twice is "crashed"; the others have their rows."""
    from fleet.small_plant import records
    from stiction.fleet import engine
    from stiction.fleet.batch import Batch, LoopTask
    from stiction.fleet.block_means import common_clock
    from stiction.fleet.find_loops import find_loop_places
    from stiction.fleet.loop_row import WorkSettings

    source = write_plant(tmp_path / "plant.parquet", 6)
    places = find_loop_places([str(source)], {})
    settings = WorkSettings(common_clock(records(6)))
    tasks = tuple(LoopTask(k, place) for k, place in enumerate(places))
    monkeypatch.setattr(engine, "run_batch", _run_batch_with_a_killer)
    pool = engine.ProcessEngine(2)
    found = {}
    for outcomes in pool.run([Batch(tasks[:3], settings), Batch(tasks[3:], settings)], lambda: True):
        found |= {one.number: one.row["status"] for one in outcomes}
    pool.close()
    assert found.pop(2) == "crashed"
    assert len(found) == 5
    assert "crashed" not in found.values()


def _run_batch_with_a_killer(batch):
    from stiction.fleet.batch import run_batch

    if any(task.number == 2 for task in batch.tasks):
        os._exit(9)
    return run_batch(batch)


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
