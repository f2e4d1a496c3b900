"""What a user waits for at the command line: import, help, one diagnosis; cold and warm, and the memory they take."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

from bench import Row, Section

import stiction as st

REPEATS = 5


def start() -> Section:
    """Processes of their own; cold means that no compiled kernel is in the disk cache."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        record = _record(folder)
        stiction = (str(Path(sys.executable).with_name("stiction")),)
        programs = [
            ("import stiction", (sys.executable, "-c", "import stiction")),
            ("stiction --help", (*stiction, "--help")),
            ("stiction diagnose FILE", (*stiction, "diagnose", str(record), "--json")),
        ]
        notes = ()
        if find_spec("stiction.apps") is None:
            programs, notes = programs[:1], ("the command line is not there yet",)
        rows = []
        for what, command in programs:
            warm = folder / "warm"
            run(command, warm)
            cold = [run(command, folder / f"cold-{len(what)}-{k}") for k in range(REPEATS)]
            again = [run(command, warm) for _ in range(REPEATS)]
            rows.append(Row(f"{what}, cold", statistics.median(t for t, _ in cold), "s"))
            rows.append(Row(f"{what}, warm", statistics.median(t for t, _ in again), "s"))
            rows.append(Row(f"{what}, peak memory", max(m for _, m in cold + again), "MiB"))
    return Section("Start", rows, notes)


def run(command: tuple[str, ...], kernels: Path) -> tuple[float, float]:
    """Wall time [s] and peak memory [MiB] of a program whose compiled kernels live in the folder `kernels`."""
    begin = time.perf_counter()
    child = subprocess.Popen(
        command,
        env=os.environ | {"NUMBA_CACHE_DIR": str(kernels)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    assert child.stderr is not None
    told = child.stderr.read().decode()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode not in (0, 1):
        raise SystemExit(f"{' '.join(command)} ended with {child.returncode}: {told.strip().splitlines()[-1:]}")
    per_mebibyte = 1024.0 if sys.platform == "linux" else 1024.0**2
    return time.perf_counter() - begin, usage.ru_maxrss / per_mebibyte


def _record(folder: Path) -> Path:
    """A sticky loop of 2 000 samples as a plant would export it."""
    loop = st.Loop(st.PID(0.2, 10.0), st.Kano(3.0, 1.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.05)
    record = st.simulate(loop, 10.0, 2_000.0, seed=1, pv_start=0.0)
    path = folder / "FIC-101.csv"
    lines = ["time,sp,pv,op"]
    lines += [
        f"{k},{r:g},{y:.4f},{u:.4f}" for k, (r, y, u) in enumerate(zip(record.sp, record.pv, record.op, strict=True))
    ]
    path.write_text("\n".join(lines) + "\n")
    return path
