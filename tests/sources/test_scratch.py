"""Temporary files: one folder for each run, nothing left behind however it ends."""

from __future__ import annotations

import gzip
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from stiction import scratch
from stiction.sources import byte_source, open_loops

SCRIPT = """
import sys, time
from stiction.apps import cli
from stiction.sources import open_loops

def work(tokens):
    loops = open_loops(sys.argv[1])
    print("ready", len(loops), flush=True)
    sys.stdin.readline()
    return 0

cli._run = work
sys.exit(cli.main([]))
"""
ENDS = {"normal": None, "Ctrl-C": "SIGINT", "terminated": "SIGTERM", "hung up": "SIGHUP"}


@pytest.fixture
def packed(tmp_path: Path) -> Path:
    path = tmp_path / "loop.csv.gz"
    path.write_bytes(gzip.compress(b"time,PV,OP\n" + b"".join(b"%d,%d,%d\n" % (k, k % 5, k % 7) for k in range(99))))
    return path


def start(packed: Path, folder: Path) -> subprocess.Popen[str]:
    folder.mkdir(exist_ok=True)
    kept = {name: value for name, value in os.environ.items() if not name.startswith("STICTION_")}
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(packed)], env=kept | {"TMPDIR": str(folder)},
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline() == "ready 1\n"
    assert list(folder.rglob("*.inflated"))
    return process


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("end", ENDS)
def test_nothing_is_left_at_the_end(packed: Path, tmp_path: Path, end: str) -> None:
    name = ENDS[end]
    if name is not None and signal.getsignal(getattr(signal, name)) == signal.SIG_IGN:
        pytest.skip(f"{name} is ignored here, as under nohup")
    process = start(packed, tmp_path / "tmp")
    if name is None:
        process.communicate("\n")
    else:
        process.send_signal(getattr(signal, name))
        process.communicate()
    assert process.returncode == {None: 0, "SIGINT": 130, "SIGTERM": 143, "SIGHUP": 129}[name]
    assert list((tmp_path / "tmp").iterdir()) == []


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_next_start_removes_what_a_killed_run_left_but_not_that_of_a_live_one(
    packed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "tmp"
    killed, alive = start(packed, folder), start(packed, folder)
    killed.kill()
    killed.communicate()
    (folder / f"{scratch.PREFIX}of-a-user").mkdir()  # without a lock: not ours
    assert len(list(folder.iterdir())) == 3
    monkeypatch.setattr(scratch, "gettempdir", lambda: str(folder))
    scratch.remove_abandoned()
    assert len(list(folder.iterdir())) == 2
    assert len(list(folder.rglob("*.inflated"))) == 1
    alive.communicate("\n")
    assert [path.name for path in folder.iterdir()] == [f"{scratch.PREFIX}of-a-user"]


def test_workers_share_the_copies(packed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    inflate, calls = byte_source.inflate, []

    def counted(path, *arguments):
        calls.append(path)
        return inflate(path, *arguments)

    monkeypatch.setattr(byte_source, "inflate", counted)
    with scratch.shared_copies():
        root = Path(os.environ[scratch.SHARED_VARIABLE])
        first, second = (open_loops(packed).read()[0] for _ in range(2))
        assert first.op.tolist() == second.op.tolist()
        assert len(calls) == 1
        assert len(list(root.rglob("*.inflated"))) == 1
        os.utime(packed, (1, 1))  # another file of this name
        open_loops(packed)
        assert len(calls) == 2
    assert not root.exists()
    assert scratch.SHARED_VARIABLE not in os.environ


def test_folder_of_a_dead_worker_is_removed(tmp_path: Path) -> None:
    process = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, text=True)
    left = scratch.run_folder() / f"{process.stdout.strip()}-left"
    left.mkdir()
    own = scratch.ScratchFolder()
    assert own.path().is_dir()
    assert not left.exists()
    own.delete()
    assert not own._path.exists()


def test_command_started_by_a_run_has_a_folder_of_its_own(packed: Path, tmp_path: Path) -> None:
    folder, foreign = tmp_path / "tmp", tmp_path / "of another run"
    folder.mkdir()
    foreign.mkdir()
    before = foreign.stat().st_mtime_ns
    names = (scratch.RUN_VARIABLE, scratch.SHARED_VARIABLE)
    process = subprocess.run(
        [sys.executable, "-m", "stiction", "read", str(packed)],
        env={**os.environ, **dict.fromkeys(names, str(foreign)), "TMPDIR": str(folder)},
        capture_output=True,
        text=True,
    )
    assert process.returncode == 0, process.stderr
    assert foreign.stat().st_mtime_ns == before  # nothing was ever in it
    assert not list(folder.iterdir())
